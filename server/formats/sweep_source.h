// Where the rows of a sweep's table come from: the answer itself, or whoever reads them out of a
// store. Not what they mean (core/study/sweep.h). Used by what shows them.
#ifndef SERVER_FORMATS_SWEEP_SOURCE_H
#define SERVER_FORMATS_SWEEP_SOURCE_H

#include "core/study/sweep.h"

enum {
    SWEEP_CELL_POINT,  // its number, rising
    SWEEP_CELL_STATUS, // SweepStatus
    SWEEP_CELL_METRIC, // the first of them
    SWEEP_CELLS = SWEEP_CELL_METRIC + SWEEP_METRICS,
};
enum { SWEEP_PIECE = 256 }; // rows that are asked for at once, at most

typedef struct SweepSource {
    size_t rows; // that are there
    // Column `cell` of rows first ... first + count - 1. False: they cannot be read any more.
    bool (*read)(void *context, size_t cell, size_t first, size_t count, double *target);
    void *context;
} SweepSource;

SweepSource sweep_source(const Sweep *sweep); // of its own table, which is borrowed

// The text of an axis at a point: a scalar in JSON.
const char *sweep_axis_text(const Sweep *sweep, size_t axis, double point);

#endif
