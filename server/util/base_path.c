#include "server/util/base_path.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static char base[LINK_BASE_SIZE];

void base_path_set(const char *path) {
    snprintf(base, sizeof base, "%s", path);
}

const char *base_path(void) {
    return base;
}

const char *base_path_strip(const char *path) {
    const size_t size = strlen(base);
    if (size == 0 || strncmp(path, base, size) != 0)
        return path;
    if (path[size] == '/')
        return path + size;
    return path[size] == '\0' ? "/" : path;
}

void base_path_apply(char *text, size_t size) {
    const size_t base_size = strlen(base);
    for (char *at = text; base_size > 0 && *at != '\0'; at++) {
        const bool is_path = *at == '/' && (at == text || at[-1] == '<');
        const size_t rest = strlen(at) + 1;
        if (!is_path || (size_t)(at - text) + base_size + rest > size)
            continue;
        memmove(at + base_size, at, rest);
        memcpy(at, base, base_size);
        at += base_size;
    }
}
