// Jansson 2.14 ignores that its lexer's text buffer cannot grow, and then reads past its end. While
// a text is parsed a reserve, allocated before, serves the buffer when memory runs out: requests of
// a power of two, as the buffer doubles. All other requests fail from then on, so that the parser
// soon stops. Strings of an array may be served likewise, at most twice the bytes of the text.
#include "server/json/memory.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>

enum { BUFFER_FIRST = 16 }; // bytes of the lexer's buffer before it grows

void *(*json_memory_source)(size_t size) = malloc;

static _Thread_local struct {
    char *at; // NULL: no text is being parsed
    size_t size, used;
    bool has_failed;
} reserve;

static void *memory_allocate(size_t size) {
    if (!reserve.has_failed) {
        void *block = json_memory_source(size);
        if (block != NULL || reserve.at == NULL)
            return block;
        reserve.has_failed = true;
    }
    if (size <= BUFFER_FIRST || (size & (size - 1)) != 0 || size > reserve.size - reserve.used)
        return NULL;
    char *block = reserve.at + reserve.used;
    reserve.used += size;
    return block;
}

static void memory_free(void *block) {
    const uintptr_t at = (uintptr_t)block, first = (uintptr_t)reserve.at;
    if (reserve.at == NULL || at < first || at >= first + reserve.size)
        free(block);
}

static void memory_install(void) {
    json_set_alloc_funcs(memory_allocate, memory_free);
}

json_t *json_memory_load(const char *text, size_t size, size_t flags, json_error_t *error,
                         bool *is_out_of_memory) {
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, memory_install);
    reserve.size = 4 * size + 4096;
    reserve.used = 0;
    reserve.has_failed = false;
    reserve.at = json_memory_source(reserve.size);
    json_t *root = reserve.at != NULL ? json_loadb(text, size, flags, error) : NULL;
    *is_out_of_memory = reserve.at == NULL || reserve.has_failed;
    if (*is_out_of_memory) {
        json_decref(root);
        root = NULL;
    }
    free(reserve.at);
    reserve.at = NULL;
    reserve.has_failed = false;
    return root;
}
