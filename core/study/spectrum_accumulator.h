// The spectra of many runs, added one by one: means, deviations and quantiles of their densities.
#ifndef CORE_STUDY_SPECTRUM_ACCUMULATOR_H
#define CORE_STUDY_SPECTRUM_ACCUMULATOR_H

#include "core/study/stopping_rule.h"
#include "core/study/study_run.h"

// Densities of many runs at each frequency; a study fills some of the lists.
typedef struct RunSpectrum {
    char *channel, *unit;
    Reals mean, standard_deviation, low, high; // the last two of the mean
    Reals value, q05, median, q95;             // the first of the study's own scene
} RunSpectrum;

typedef struct RunSpectra {
    RunSpectrum *at;
    size_t count;
} RunSpectra;

enum {
    SPECTRUM_ACCUMULATOR_FIRST = 16,    // runs kept for spectrum_accumulator_spread
    SPECTRUM_ACCUMULATOR_MAX = 1 << 22, // limit on the densities kept of all runs
};

// All zero is empty.
typedef struct SpectrumAccumulator {
    size_t channels, rows;
    size_t count;    // runs
    double *mean;    // channel by channel
    double *squares; // sums of squared deviations
    size_t kept_max; // runs of which all densities are kept, the first ones
    double *kept;    // run by run
} SpectrumAccumulator;

// Adds the spectra of a run, of the same shape as those before; the densities of the first
// `kept_max` runs are kept.
Status spectrum_accumulator_add(SpectrumAccumulator *sums, const Spectrum *spectrum,
                                size_t kept_max, Problem *problem);

// Spread of the runs: norm of the difference over norm of the mean density, of the channel with the
// largest error among `all` runs. Needs SPECTRUM_ACCUMULATOR_FIRST kept runs.
RunSpread spectrum_accumulator_spread(const SpectrumAccumulator *sums, size_t all);

// Fills frequencies and spectra: mean, deviation and confidence interval of the mean. `like` is the
// spectrum of any of the runs. With quantiles, which need all runs kept: mean and quantiles, and
// `like` as the value; `progress` may then stop the sorting.
Status spectrum_accumulator_report(const SpectrumAccumulator *sums, const Spectrum *like,
                                   bool has_quantiles, const Progress *progress, Reals *frequency,
                                   RunSpectra *spectra, Problem *problem);

void spectrum_accumulator_clear(SpectrumAccumulator *sums);

#endif
