// What a document says of two things, a and b: every object in it that has both is a row, and what
// else it tells once is a line. Not a reader by Field rows: a comparison may tell more with every
// version. Used by command/compare.c.
#ifndef SERVER_CODEC_PAIRS_H
#define SERVER_CODEC_PAIRS_H

#include "core/base/field.h"

enum { PAIRS_MOST = 2000, PAIRS_TEXT = 160 };

typedef struct Pair {
    char *name;  // "peak_displacement", or the pointer of an input
    char *a, *b; // b NULL: told once, in a
    char *rest;  // "difference 0.1, unit m"; "" if there is none
} Pair;

typedef struct Pairs {
    Pair *at;
    size_t count;
} Pairs;

// In the document's order. STATUS_UNREADABLE if it is no JSON object. Cleared by pairs_clear in any
// case.
Status pairs_read(const char *text, size_t size, Pairs *pairs, Problem *problem);
void pairs_clear(Pairs *pairs);

#endif
