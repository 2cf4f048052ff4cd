// A sampled base on the finer grid of the output, where that is a whole number of times as fine:
// linear between its samples, as it was. Not a resampling: no other grids.
#ifndef CORE_SOLVE_REFINE_H
#define CORE_SOLVE_REFINE_H

#include "core/base/progress.h"
#include "core/base/status.h"
#include "core/excitation/base_motion.h"

// How many values it takes for a run of `samples` output samples; 0: there is nothing to refine.
size_t refine_count(const Base *base, double sample_rate, size_t samples);

// Writes them to `values`, which `fine` borrows. STATUS_CANCELLED where the progress says so.
Status refine_base(const Base *base, double sample_rate, size_t count, double *values,
                   const Progress *progress, Base *fine, Problem *problem);

#endif
