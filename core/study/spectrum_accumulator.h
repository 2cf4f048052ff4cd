// The spectra of an ensemble's runs, added one by one. Only the densities of the first runs are
// kept, to estimate the freedom of their differences.
#ifndef CORE_STUDY_SPECTRUM_ACCUMULATOR_H
#define CORE_STUDY_SPECTRUM_ACCUMULATOR_H

#include "core/study/stopping_rule.h"
#include "core/study/study_run.h"

enum { SPECTRUM_ACCUMULATOR_KEPT = 16 };

// All zero is empty.
typedef struct SpectrumAccumulator {
    size_t channels, rows;
    size_t count;    // runs
    double *mean;    // channel by channel
    double *squares; // sums of squared deviations
    double *first;   // of SPECTRUM_ACCUMULATOR_KEPT runs, run by run; NULL: not requested
} SpectrumAccumulator;

// Adds the spectra of a run, of the same shape as those before. `keeps_first`: for
// spectrum_accumulator_spread.
Status spectrum_accumulator_add(SpectrumAccumulator *sums, const Spectrum *spectrum,
                                bool keeps_first, Problem *problem);

// Spread of the runs: norm of the difference over norm of the mean density, of the channel with the
// largest error among `all` runs.
RunSpread spectrum_accumulator_spread(const SpectrumAccumulator *sums, size_t all);

// Fills frequencies and spectra: mean, deviation and confidence interval of the mean. `like` is the
// spectrum of any of the runs.
Status spectrum_accumulator_report(const SpectrumAccumulator *sums, const Spectrum *like,
                                   Reals *frequency, RunSpectra *spectra, Problem *problem);

void spectrum_accumulator_clear(SpectrumAccumulator *sums);

#endif
