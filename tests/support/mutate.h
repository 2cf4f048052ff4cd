// Mutated texts for the fuzzers: seeds with bytes changed, left out, repeated, or known pieces put
// in.
#ifndef TESTS_SUPPORT_MUTATE_H
#define TESTS_SUPPORT_MUTATE_H

#include <stddef.h>
#include <stdint.h>

enum { MUTATE_TEXT_MAX = 4096 };

typedef struct Mutator {
    const char *const *seeds, *const *pieces;
    size_t seed_count, piece_count;
    uint64_t state;
} Mutator;

// Below `count`, by Vigna's splitmix64.
size_t mutate_draw(Mutator *mutator, size_t count);

// A text of its own size, so that a byte read behind it is seen; the caller frees it. NULL without
// memory.
char *mutate_text(Mutator *mutator, size_t *size);

// Prints what is wrong with the text; the exit code.
int mutate_refuse(const char *wrong, const char *text, size_t size);

#endif
