// What a document says of two things, a and b: every object in it that has both is a row, and what
// else it tells once is a line. Not a reader by Field rows: a comparison may tell more with every
// version. A list of it that is of one kind of thing can be had as a table. Used by
// command/compare.c.
#ifndef SERVER_CODEC_PAIRS_H
#define SERVER_CODEC_PAIRS_H

#include "core/base/field.h"

enum { PAIRS_MAX = 2000, PAIRS_TEXT = 160, LISTING_CELL = 32 };

typedef struct Pair {
    char *name;  // "peak_displacement", or the pointer of an input
    char *a, *b; // b NULL: told once, in a
    char *rest;  // "difference 0.1, unit m"; "" if there is none
} Pair;

typedef struct Pairs {
    Pair *at;
    size_t count;
} Pairs;

// Cell (row, column) is cells[row * columns + column].
typedef struct Listing {
    char (*cells)[LISTING_CELL];
    size_t columns, rows;
} Listing;

// In the document's order. STATUS_UNREADABLE if it is no JSON object. Cleared by pairs_clear in any
// case.
Status pairs_read(const char *text, size_t size, Pairs *pairs, Problem *problem);
void pairs_clear(Pairs *pairs);

// Of each object in the document's list of that name these members, numbers to four digits and "-"
// for what is not there; no rows if there is no such list. Ends as pairs_read does.
Status listing_read(const char *text, size_t size, const char *list, const char *const *members,
                    Listing *listing, Problem *problem);
void listing_clear(Listing *listing);

#endif
