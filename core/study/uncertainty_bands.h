// Quantiles of the spectra of many runs, frequency by frequency. They need all densities of a
// frequency at once, so those of every run are kept.
#ifndef CORE_STUDY_UNCERTAINTY_BANDS_H
#define CORE_STUDY_UNCERTAINTY_BANDS_H

#include "core/study/study_run.h"

enum { UNCERTAINTY_BANDS_MAX = 1 << 22 }; // limit on the densities kept of all runs

// Densities run by run, channel by channel. All zero is empty.
typedef struct UncertaintyBands {
    size_t channels, rows, runs;
    double *at;
} UncertaintyBands;

// Keeps the spectra of a run, of the same shape as those before; the first one allocates memory for
// `max` of them.
Status uncertainty_bands_add(UncertaintyBands *bands, const Spectrum *spectrum, size_t max,
                             Problem *problem);
void uncertainty_bands_clear(UncertaintyBands *bands);

// Fills frequencies and spectra: mean and quantiles, and the values of `own`. `progress` may stop
// the sorting.
Status uncertainty_bands_report(const UncertaintyBands *bands, const Spectrum *own,
                                const Progress *progress, Reals *frequency, RunSpectra *spectra,
                                Problem *problem);

#endif
