// The spectra of an ensemble's runs, folded one by one: nothing of a run is kept but the first
// few's densities, by which the freedom of their differences is told. Not the statistics of runs:
// ensemble_statistics.h. Used by ensemble_run.c and the tests.
#ifndef CORE_STUDY_SPECTRUM_ACCUMULATOR_H
#define CORE_STUDY_SPECTRUM_ACCUMULATOR_H

#include "core/study/ensemble.h"
#include "core/study/stopping_rule.h"

enum { SPECTRA_KEPT = 16, SPECTRA_VALUES = 1 << 18 };

// All zero is empty.
typedef struct SpectraFold {
    size_t channels, rows;
    size_t count;    // runs
    double *mean;    // channel by channel
    double *squares; // sums of squared deviations
    double *first;   // of SPECTRA_KEPT runs, run by run; NULL: not wanted
} SpectraFold;

// Adds a run's spectra, all of one shape; the first ones make room. `keeps_first`: for
// spectra_spread.
Status spectra_add(SpectraFold *fold, const Spectrum *spectrum, bool keeps_first, Problem *problem);

// How the runs differ: the norm of the difference over the norm of the mean density, of the channel
// whose error is the largest among `all` runs.
Spread spectra_spread(const SpectraFold *fold, size_t all);

// Fills frequencies and spectra of the answer; `like` is any of the runs'.
Status spectra_tell(const SpectraFold *fold, const Spectrum *like, Ensemble *answer,
                    Problem *problem);

void spectra_clear(SpectraFold *fold);

#endif
