// The statistics of an ensemble's runs, over those that came to an end. Not of their spectra:
// ensemble_spectra.h. Used by ensemble_run.c, by the study sensitivity and the tests.
#ifndef CORE_STUDY_STATISTICS_H
#define CORE_STUDY_STATISTICS_H

#include "core/study/ensemble.h"
#include "core/study/stopping_rule.h"

#define ENSEMBLE_INTERVAL 0.95 // confidence of the intervals of means

// The number that a statistic is of; NAN: not known.
double statistics_value(const Summary *summary, int metric);

void statistics_sort(double *values, size_t count); // the smallest first

// Below it lies that share of so many sorted numbers, at least one, as NumPy's.
double statistics_quantile(const double *sorted, size_t count, double share);

// Fills what the table has of one statistic.
Status statistics_fold(const EnsembleRuns *table, int metric, EnsembleStatistic *statistic,
                       Problem *problem);

// How the runs differ in one statistic.
Status statistics_spread(const EnsembleRuns *table, int metric, Spread *spread, Problem *problem);

void statistics_trust(const EnsembleRuns *table, EnsembleTrust *trust);

// Failures by their reason, in the order of their seeds: statuses[i] is the table's row i's.
Status statistics_failures(const EnsembleRuns *table, const Status *statuses,
                           EnsembleFailures *failures, Problem *problem);

#endif
