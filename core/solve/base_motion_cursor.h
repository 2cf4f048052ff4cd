// The base as a stepping solver meets it: what a_g does from a given instant on, and for how long.
// Not its making (excite/).
#ifndef CORE_SOLVE_BASE_MOTION_CURSOR_H
#define CORE_SOLVE_BASE_MOTION_CURSOR_H

#include <stdbool.h>

#include "core/excitation/base_motion.h"
#include "core/solve/linear_motion.h"

typedef struct BaseCursor {
    const Base *base;
    double sample_rate;
    size_t ratio; // BASE_SAMPLED: output samples per base sample where the grids coincide, else 0
} BaseCursor;

void base_cursor_make(BaseCursor *cursor, const Base *base, double sample_rate);

// Over the whole interval after output sample n; false where a_g has a kink inside it.
bool base_cursor_interval(const BaseCursor *cursor, size_t n, Slice *slice);

// From `offset` seconds after output sample n on. Returns for how long it holds, INFINITY if for
// the whole interval.
double base_cursor_slice(const BaseCursor *cursor, size_t n, double offset, Slice *slice);

// a_g at output sample n, right-continuous [m/s^2].
double base_cursor_at(const BaseCursor *cursor, size_t n);

#endif
