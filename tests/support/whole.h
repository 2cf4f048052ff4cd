// A struct with every kind of row, for tests of what walks rows.
// Not a thing of the program. Used by the tests of codec/.
#ifndef TESTS_SUPPORT_WHOLE_H
#define TESTS_SUPPORT_WHOLE_H

#include "core/base/field.h"

typedef struct Part {
    char *material;
    double stiffness; // absent unless given
    double damping;   // 0.5
} Part;

typedef struct PartList {
    Part *at;
    size_t count;
} PartList;

typedef struct Common {
    double offset;
} Common;

// Two shapes under the tag "shape".
typedef struct Round {
    Variant variant;
    Common common;
    double radius; // required
} Round;

typedef struct Square {
    Variant variant;
    Common common;
    Reals sides;
} Square;

typedef struct Extra {
    Texts names; // "one"
    int rule;
} Extra;

typedef struct Whole {
    Common common;
    double mass; // required
    double slope;
    uint64_t steps; // 7
    uint64_t storey;
    bool is_open; // true
    char *title;
    int rule;
    Reals samples;
    Texts channels;
    Texts labels;
    Part left;
    Part right;
    Extra extra;
    PartList parts;
    Variant *shape;
    Variant *spare;
} Whole;

extern const Kind shape_round, shape_square;
extern const Field whole_fields[];

#endif
