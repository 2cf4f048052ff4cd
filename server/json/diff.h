// Where two JSON documents differ: JSON Pointer and both values. Not a judgement of what they say.
// Used by api/compare.c and api/cache.c.
#ifndef SERVER_JSON_DIFF_H
#define SERVER_JSON_DIFF_H

#include <stddef.h>

#include "core/base/status.h"
#include "server/util/bytes.h"

enum { DIFFER_MAX = 200, DIFFER_VALUE_MAX = 400 };

// One place; where a value is missing, or an array's rest is, there is none.
typedef struct Difference {
    char *pointer;
    char *a, *b;  // JSON text; NULL: not there, or longer than DIFFER_VALUE_MAX
    char *detail; // for people, where a value is not shown; NULL
} Difference;

typedef struct Differences {
    Difference *at;
    size_t count; // at most DIFFER_MAX
    size_t more;  // beyond
} Differences;

// Objects are compared member by member, arrays of numbers longer than 16 as a whole, other arrays
// item by item; the member `besides` of the documents (NULL: none) is left out. Cleared by
// differences_clear in any case. STATUS_INTERNAL: one is not JSON.
Status json_diff(const char *a, const char *b, const char *besides, Differences *differences,
                 Problem *problem);
void differences_clear(Differences *differences);

// [{"pointer", "a", "b", "detail"}], what is not there null.
void differences_write(Bytes *bytes, const Differences *differences);

#endif
