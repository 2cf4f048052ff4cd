// Bytes of a canonical form, as canonical_write hands them over. `bytes` are the caller's to free.
#ifndef TESTS_SUPPORT_TAKEN_H
#define TESTS_SUPPORT_TAKEN_H

#include <stdlib.h>
#include <string.h>

#include "tests/support/test.h"

typedef struct Taken {
    unsigned char *bytes;
    size_t count;
} Taken;

static inline void take(void *context, const void *bytes, size_t size) {
    Taken *taken = context;
    taken->bytes = realloc(taken->bytes, taken->count + size);
    assert_non_null(taken->bytes);
    memcpy(taken->bytes + taken->count, bytes, size);
    taken->count += size;
}

#endif
