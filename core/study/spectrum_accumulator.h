// The spectra of an ensemble's runs, folded one by one: nothing of a run is kept but the first
// few's densities, by which the freedom of their differences is told. Not the statistics of runs:
// ensemble_statistics.h. Used by ensemble_run.c and the tests.
#ifndef CORE_STUDY_SPECTRUM_ACCUMULATOR_H
#define CORE_STUDY_SPECTRUM_ACCUMULATOR_H

#include "core/study/ensemble.h"
#include "core/study/stopping_rule.h"

enum { SPECTRUM_ACCUMULATOR_KEPT = 16, STUDY_DENSITIES_MAX = 1 << 18 };

// All zero is empty.
typedef struct SpectrumAccumulator {
    size_t channels, rows;
    size_t count;    // runs
    double *mean;    // channel by channel
    double *squares; // sums of squared deviations
    double *first;   // of SPECTRUM_ACCUMULATOR_KEPT runs, run by run; NULL: not wanted
} SpectrumAccumulator;

// Adds a run's spectra, all of one shape; the first ones make room. `keeps_first`: for
// spectrum_accumulator_spread.
Status spectrum_accumulator_add(SpectrumAccumulator *fold, const Spectrum *spectrum,
                                bool keeps_first, Problem *problem);

// How the runs differ: the norm of the difference over the norm of the mean density, of the channel
// whose error is the largest among `all` runs.
Spread spectrum_accumulator_spread(const SpectrumAccumulator *fold, size_t all);

// Fills frequencies and spectra of the answer; `like` is any of the runs'.
Status spectrum_accumulator_report(const SpectrumAccumulator *fold, const Spectrum *like,
                                   Ensemble *answer, Problem *problem);

void spectrum_accumulator_clear(SpectrumAccumulator *fold);

#endif
