// The differences of two JSON documents: the JSON Pointer of each, and both values.
#ifndef SERVER_JSON_DIFF_H
#define SERVER_JSON_DIFF_H

#include "core/base/status.h"
#include "server/util/bytes.h"

enum { DIFF_MAX = 200, DIFF_VALUE_MAX = 400 }; // differences written; bytes of a value

typedef struct DiffFormat {
    const char *a, *b; // names of the two values
    bool is_full;      // with null for a value that is missing or too long, and "detail"
} DiffFormat;

// Appends [{"pointer", A, B, "detail"}, ...] with the first DIFF_MAX differences; *count has all.
// Objects are compared member by member, arrays of more than 16 numbers as a whole, other arrays
// element by element. The member `ignored` of the documents (NULL: none) is left out.
// STATUS_INTERNAL: a document is not JSON; nothing is appended then.
Status json_diff(const char *a, const char *b, const char *ignored, const DiffFormat *format,
                 Bytes *bytes, size_t *count, Problem *problem);

#endif
