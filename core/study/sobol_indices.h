// Sobol indices: the parts of a result's variance that its uncertain inputs cause, alone and in
// all.
#ifndef CORE_STUDY_SOBOL_INDICES_H
#define CORE_STUDY_SOBOL_INDICES_H

#include <stddef.h>

// Results of the runs of N base samples, which have k + 2 runs each: of row A, of row B, and for
// each input in turn of row A with that input from row B. NAN: unknown.
typedef struct SobolRuns {
    const double *values; // of run r of sample j at values[((k + 2) j + r) * stride]
    size_t stride;
    size_t samples, inputs; // N and k
} SobolRuns;

// Of one input, each with the interval that contains it with a probability of 95 % (NAN: unknown).
typedef struct SobolIndex {
    size_t count; // samples whose runs are all known
    double first, first_interval[2];
    double total, total_interval[2];
} SobolIndex;

// The indices of an input. All NAN where the results do not differ or fewer than two samples are
// known.
void sobol_index_estimate(const SobolRuns *runs, size_t input, SobolIndex *index);

#endif
