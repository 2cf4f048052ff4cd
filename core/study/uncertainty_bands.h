// What drawn runs came to, statistic by statistic and frequency by frequency. Not the runs. Used by
// sensitivity_run.c.
#ifndef CORE_STUDY_UNCERTAINTY_BANDS_H
#define CORE_STUDY_UNCERTAINTY_BANDS_H

#include "core/study/sensitivity.h"

enum { UNCERTAINTY_DENSITIES_MAX = 1 << 22 }; // kept of all runs, at most

// Densities of runs, run by run, channel by channel. All zero is empty.
typedef struct UncertaintyDensities {
    size_t channels, rows, runs, room;
    double *at;
} UncertaintyDensities;

// Keeps a run's spectra, all of one shape; the first makes room for `most` of them.
Status uncertainty_bands_add(UncertaintyDensities *kept, const Spectrum *spectrum, size_t most,
                             Problem *problem);
void uncertainty_bands_clear(UncertaintyDensities *kept);

// Fills statistics, failures and spectra of the answer. The table's "seed" is the run's number.
// Sorting many densities takes long: `progress` may stop it.
Status uncertainty_bands_report(const EnsembleRuns *table, const Status *statuses,
                                const UncertaintyDensities *kept, const Outcome *own,
                                bool has_force, const Progress *progress, Sensitivity *answer,
                                Problem *problem);

#endif
