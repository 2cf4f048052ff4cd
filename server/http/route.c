// A pattern is literal text with {names}. A name takes what stands before the character that
// follows it in the pattern, or the rest of the segment: at least one character, never a '/'.
#include "server/http/route.h"

#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/spelling.h"

bool route_match(const char *pattern, const char *path, RouteSpan spans[REQUEST_PARAMETERS],
                 size_t *count) {
    *count = 0;
    while (*pattern != '\0') {
        if (*pattern != '{') {
            if (*path++ != *pattern++)
                return false;
            continue;
        }
        const char *close = strchr(pattern, '}');
        if (close == NULL || *count == REQUEST_PARAMETERS)
            return false;
        pattern = close + 1;
        size_t size = strcspn(path, "/");
        if (*pattern != '\0' && *pattern != '/') {
            const char *stop = memchr(path, *pattern, size);
            if (stop == NULL)
                return false;
            size = (size_t)(stop - path);
        }
        if (size == 0)
            return false;
        spans[(*count)++] = (RouteSpan){path, size};
        path += size;
    }
    return *path == '\0';
}

static void allow_add(char allow[64], const char *method) {
    text_list(allow, 64, method);
    if (strcmp(method, "GET") == 0)
        text_list(allow, 64, "HEAD");
}

const Route *route_find(const Route *table, const char *method, const char *path,
                        RouteSpan spans[REQUEST_PARAMETERS], size_t *count, char allow[64]) {
    const char *fitting = NULL;
    allow[0] = '\0';
    for (const Route *route = table; route->method != NULL; route++) {
        if (fitting != NULL ? strcmp(route->pattern, fitting) != 0
                            : !route_match(route->pattern, path, spans, count))
            continue;
        fitting = route->pattern;
        if (strcmp(route->method, method) == 0)
            return route;
        allow_add(allow, route->method);
    }
    return NULL;
}

// The pattern with its {names} filled from the segments of `path` at the same place, so that the
// distance between the two is that of the literal text. A name that shares its segment with literal
// text stays as it is.
static void fill(const char *pattern, const char *path, char *target, size_t size) {
    size_t used = 0;
    target[0] = '\0';
    while (*pattern == '/') {
        const size_t pattern_size = strcspn(pattern + 1, "/") + 1;
        const size_t path_size = *path == '/' ? strcspn(path + 1, "/") + 1 : 0;
        const bool is_name = pattern[1] == '{' && pattern[pattern_size - 1] == '}' &&
                             memchr(pattern + 2, '{', pattern_size - 2) == NULL;
        const bool takes_path = is_name && path_size > 1;
        const char *from = takes_path ? path : pattern;
        const size_t from_size = takes_path ? path_size : pattern_size;
        if (used + from_size >= size)
            return;
        memcpy(target + used, from, from_size);
        used += from_size;
        target[used] = '\0';
        pattern += pattern_size;
        path += path_size;
    }
}

bool route_nearest(const Route *table, const char *path, char target[ROUTE_SEGMENT_MAX]) {
    char filled[ROUTE_SEGMENT_MAX];
    const char *const candidates[] = {target, filled, NULL}; // the nearest so far, and one more
    target[0] = '\0';
    if (strlen(path) >= sizeof filled)
        return false;
    for (const Route *route = table; route->method != NULL; route++) {
        if (strncmp(route->pattern, "/web/", 5) == 0)
            continue; // a page asks for its own files, and their names may be anything
        fill(route->pattern, path, filled, sizeof filled);
        if (spelling_nearest(candidates, path) == filled)
            memcpy(target, filled, sizeof filled);
    }
    return target[0] != '\0';
}
