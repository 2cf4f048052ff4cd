// Statistics over the runs of a study that ended, of the numbers in their summaries.
#ifndef CORE_STUDY_STATISTICS_H
#define CORE_STUDY_STATISTICS_H

#include "core/study/stopping_rule.h"
#include "core/study/study_run.h"

// The numbers of a summary that have statistics; the spectra have none here.
typedef enum StatisticsMetric {
    STATISTICS_PEAK_DISPLACEMENT,
    STATISTICS_RMS_DISPLACEMENT,
    STATISTICS_PEAK_ACCELERATION,
    STATISTICS_RMS_ACCELERATION,
    STATISTICS_IMPACTS,
    STATISTICS_PEAK_CONTACT_FORCE,
    STATISTICS_METRICS,
    STATISTICS_PSD = STATISTICS_METRICS,
} StatisticsMetric;
extern const char *const statistics_metric_names[]; // NULL-terminated, psd the last

#define STATISTICS_CONFIDENCE 0.95 // of the intervals of means

// Statistics of one metric, over the runs in which it is known. NAN where they are too few.
typedef struct RunStatistic {
    int metric; // StatisticsMetric
    char *unit;
    uint64_t count;
    double value; // of the study's own scene
    double mean, standard_deviation, standard_error;
    double low, high; // of the mean, by Student's t
    double minimum, q05, q25, median, q75, q95, maximum;
    uint64_t minimum_seed, maximum_seed; // numbers of the runs; the first of equal ones
} RunStatistic;

// Accuracy of the trajectories.
typedef struct RunTrust {
    uint64_t whole;   // runs without a trust horizon before their end
    uint64_t beyond;  // runs that continue beyond it: their statistics alone are valid there
    uint64_t unknown; // runs without an error estimate
    double shortest_horizon;
    double largest_error_estimate, largest_energy_residual;
} RunTrust;

// One metric of a summary; NAN: unknown.
double statistics_value(const Summary *summary, int metric);

// Quantile of sorted values, at least one, linear between order statistics as numpy.quantile.
double statistics_quantile(const double *sorted, size_t count, double share);

// Fills the statistics of a metric. `statistic` holds its defaults, which remain where the known
// values are too few, and the caller's `value`.
Status statistics_fill(const RunTable *table, int metric, RunStatistic *statistic,
                       Problem *problem);

// Spread of one metric.
Status statistics_spread(const RunTable *table, int metric, RunSpread *spread, Problem *problem);

void statistics_trust(const RunTable *table, RunTrust *trust);

#endif
