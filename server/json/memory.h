// Jansson's memory. Private to json/.
#ifndef SERVER_JSON_MEMORY_H
#define SERVER_JSON_MEMORY_H

#include <jansson.h>
#include <stdbool.h>

// json_loadb, but `*is_out_of_memory` says that memory ran out, whatever the error is; then the
// result is NULL.
json_t *json_memory_load(const char *text, size_t size, size_t flags, json_error_t *error,
                         bool *is_out_of_memory);

// Where blocks come from: malloc, but for tests.
extern void *(*json_memory_source)(size_t size);

#endif
