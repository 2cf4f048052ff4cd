// The base's acceleration from a given instant on, and sampled bases on a finer grid.
#ifndef CORE_SOLVE_BASE_MOTION_CURSOR_H
#define CORE_SOLVE_BASE_MOTION_CURSOR_H

#include <stdbool.h>

#include "core/base/progress.h"
#include "core/base/status.h"
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

// From `offset` seconds after output sample n on. Returns how long the slice holds [s], INFINITY if
// for the whole interval.
double base_cursor_slice(const BaseCursor *cursor, size_t n, double offset, Slice *slice);

// a_g at output sample n, right-continuous [m/s^2].
double base_cursor_at(const BaseCursor *cursor, size_t n);

// A sampled base on the grid of the output, where that divides the base's: linear between its
// samples as before. Returns the number of values that a run of `samples` output samples needs; 0:
// the grids are alike, or do not coincide.
size_t base_cursor_refined_count(const Base *base, double sample_rate, size_t samples);
// Writes them to `values`, which `fine` borrows. STATUS_CANCELLED if the progress requests a stop.
Status base_cursor_refine(const Base *base, double sample_rate, size_t count, double *values,
                          const Progress *progress, Base *fine, Problem *problem);

#endif
