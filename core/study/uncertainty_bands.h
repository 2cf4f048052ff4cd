// What drawn runs came to, statistic by statistic and frequency by frequency. Not the runs. Used by
// sensitivity_run.c.
#ifndef CORE_STUDY_UNCERTAINTY_BANDS_H
#define CORE_STUDY_UNCERTAINTY_BANDS_H

#include "core/study/sensitivity.h"

enum { BAND_DENSITIES = 1 << 22 }; // kept of all runs, at most

// Densities of runs, run by run, channel by channel. All zero is empty.
typedef struct BandDensities {
    size_t channels, rows, runs, room;
    double *at;
} BandDensities;

// Keeps a run's spectra, all of one shape; the first makes room for `most` of them.
Status band_keep(BandDensities *kept, const Spectrum *spectrum, size_t most, Problem *problem);
void band_clear(BandDensities *kept);

// Fills statistics, failures and spectra of the answer. The table's "seed" is the run's number.
// Sorting many densities takes long: `progress` may stop it.
Status band_tell(const EnsembleRuns *table, const Status *statuses, const BandDensities *kept,
                 const Outcome *own, bool has_force, const Progress *progress, Sensitivity *answer,
                 Problem *problem);

#endif
