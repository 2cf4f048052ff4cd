// Statistics over the runs of a study that ended: of the numbers in their summaries and of their
// spectra, and when an ensemble under a target has enough runs.
#ifndef CORE_STUDY_STATISTICS_H
#define CORE_STUDY_STATISTICS_H

#include "core/study/study.h"

// Differences among the runs made so far. The stopping rule of an ensemble under a target follows
// from them: how far the mean of the runs made may be from the mean of all runs requested.
typedef struct RunSpread {
    size_t count;    // runs
    double relative; // standard deviation of one run over the mean; INFINITY: unknown, or no mean
    double skewness;
    double freedom; // independent numbers that share the spread: 1 of a statistic, more of spectra
} RunSpread;

#define STOPPING_RULE_CONFIDENCE 0.99
enum { STOPPING_RULE_PILOT = 8 }; // runs before the first check

// Relative error of the mean of `count` of `all` runs against the mean of all, which is exceeded
// with a probability of 1 - STOPPING_RULE_CONFIDENCE; 0 if count >= all.
double stopping_rule_error(const RunSpread *spread, size_t count, size_t all);

// Smallest number of runs, at least those made, whose estimated error is within `target`.
size_t stopping_rule_predict(const RunSpread *spread, size_t all, double target);

// Number of runs at the check that follows the one at `count`.
size_t stopping_rule_next_check(size_t count);

// The metrics by which studies compare runs, in one enumeration: numbers of the summary, of which
// the usual ones come first, and their reductions by the dampers. Constant, name there, unit.
#define STUDY_METRICS_USUAL(X)                                                                     \
    X(PEAK_DISPLACEMENT, peak_displacement, "m")                                                   \
    X(RMS_DISPLACEMENT, rms_displacement, "m")                                                     \
    X(PEAK_ACCELERATION, peak_acceleration, "m/s^2")                                               \
    X(RMS_ACCELERATION, rms_acceleration, "m/s^2")                                                 \
    X(IMPACTS, impacts, NULL)                                                                      \
    X(PEAK_CONTACT_FORCE, peak_contact_force, "N")
#define STUDY_METRICS_SUMMARY(X)                                                                   \
    STUDY_METRICS_USUAL(X)                                                                         \
    X(PEAK_STOREY_DRIFT, peak_storey_drift, "m")                                                   \
    X(PEAK_BASE_SHEAR, peak_base_shear, "N")
#define STUDY_METRICS(X)                                                                           \
    STUDY_METRICS_SUMMARY(X)                                                                       \
    X(PEAK_DISPLACEMENT_REDUCTION, peak_displacement_reduction, NULL)                              \
    X(RMS_DISPLACEMENT_REDUCTION, rms_displacement_reduction, NULL)                                \
    X(PEAK_ACCELERATION_REDUCTION, peak_acceleration_reduction, NULL)                              \
    X(RMS_ACCELERATION_REDUCTION, rms_acceleration_reduction, NULL)                                \
    X(PEAK_STOREY_DRIFT_REDUCTION, peak_storey_drift_reduction, NULL)                              \
    X(PEAK_BASE_SHEAR_REDUCTION, peak_base_shear_reduction, NULL)

#define STUDY_METRIC_CONSTANT(constant, name, unit) STATISTICS_##constant,
typedef enum StatisticsMetric {
    STUDY_METRICS(STUDY_METRIC_CONSTANT) STUDY_METRIC_COUNT,
    STATISTICS_USUAL = STATISTICS_PEAK_STOREY_DRIFT, // their number, as the next
    STATISTICS_METRICS = STATISTICS_PEAK_DISPLACEMENT_REDUCTION,
    STATISTICS_PSD = STATISTICS_METRICS, // of a target; spectra have no statistics here
} StatisticsMetric;
extern const char *const study_metric_names[];      // NULL-terminated
extern const char *const statistics_metric_names[]; // those of the summary, then psd; likewise

#define STUDY_METRIC_NAME(constant, name, unit) #name, // for lists of names

// All metrics of a run, or statistics of them over runs. NAN: unknown.
#define STUDY_METRIC_MEMBER(constant, name, unit) double name;
typedef union StudyMetrics {
    struct {
        STUDY_METRICS(STUDY_METRIC_MEMBER)
    };
    double of[STUDY_METRIC_COUNT];
} StudyMetrics;
extern const Field study_metrics_fields[];

const char *study_metric_unit(int metric); // NULL: none
// Whether a run needs output.reduction for it.
bool study_metric_is_reduction(int metric);
// Validates that the scene can have a metric, which is the value at `place`.
Status study_metric_check(const Simulation *simulation, int metric, const char *place,
                          Problem *problem);
// A number of a summary by its name; NAN: unknown.
double study_summary_value(const Summary *summary, const char *name);
// Of a run that ended; without its reductions where output.reduction was not requested.
StudyMetrics study_metrics_of(const RunRecord *run);

#define STATISTICS_CONFIDENCE 0.95 // of the intervals of means

// Statistics of one metric, over the runs in which it is known. NAN where they are too few.
typedef struct RunStatistic {
    int metric; // StatisticsMetric
    char *unit;
    uint64_t count;
    double value; // of the study's own scene
    double mean, standard_deviation, standard_error;
    double low, high; // of the mean, by Student's t
    union {
        struct {
            double minimum, q05, q16, q25, median, q75, q84, q95, maximum;
        };
        double quantiles[9];
    };
    uint64_t minimum_seed, maximum_seed; // numbers of the runs; the first of equal ones
} RunStatistic;

// The statistic of a study over the runs of a scene.
typedef struct RunAggregate {
    bool is_max;
    double quantile; // NAN: the mean, unless is_max
} RunAggregate;

// The aggregate of at least one number; NAN if one is NAN. Sorts `values`, unless it is a mean.
double run_aggregate(const RunAggregate *aggregate, double *values, size_t count);

// The 95 % confidence interval over all possible runs: of a mean by Student's t, of a quantile by
// order statistics, whatever the distribution; NAN where there is none, as of a largest value.
// Sorts `values` for a quantile.
void run_aggregate_interval(const RunAggregate *aggregate, double *values, size_t count,
                            double interval[2]);

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

// Quantile of sorted values, linear between order statistics as numpy.quantile; NAN of none.
double statistics_quantile(const double *sorted, size_t count, double share);

// Fills the statistics of a metric. `statistic` holds its defaults, which remain where the known
// values are too few, and the caller's `value`. STATUS_NO_MEMORY.
Status statistics_fill(const RunTable *table, int metric, RunStatistic *statistic);

// Spread of one metric. STATUS_NO_MEMORY.
Status statistics_spread(const RunTable *table, int metric, RunSpread *spread);

void statistics_trust(const RunTable *table, RunTrust *trust);

// Densities of many runs at each frequency; a study fills some of the lists.
typedef struct RunSpectrum {
    char *channel, *unit;
    Reals mean, standard_deviation, low, high; // the last two of the mean
    Reals value;                               // of the study's own scene
    Reals q05, q16, median, q84, q95;
    uint64_t quantile_runs; // whose quantiles they are; COUNT_ABSENT: none
} RunSpectrum;

typedef struct RunSpectra {
    RunSpectrum *at;
    size_t count;
} RunSpectra;

enum {
    SPECTRUM_ACCUMULATOR_FIRST = 16,    // runs kept for spectrum_accumulator_spread
    SPECTRUM_ACCUMULATOR_MAX = 1 << 22, // limit on the densities kept of all runs
};

// The spectra of many runs, added one by one. All zero is empty.
typedef struct SpectrumAccumulator {
    size_t channels, rows;
    size_t count;    // runs
    Spectrum first;  // of the first of them
    double *mean;    // channel by channel
    double *squares; // sums of squared deviations
    size_t kept_max; // runs of which all densities are kept, the first ones
    double *kept;    // run by run
} SpectrumAccumulator;

// Adds the spectra of a run, of the same shape as those before; the densities of the first
// `kept_max` runs are kept, and the first spectrum is taken. STATUS_NO_MEMORY.
Status spectrum_accumulator_add(SpectrumAccumulator *sums, Spectrum *spectrum, size_t kept_max);

// Spread of the runs: norm of the difference over norm of the mean density, of the channel with the
// largest error among `all` runs. Needs SPECTRUM_ACCUMULATOR_FIRST kept runs.
RunSpread spectrum_accumulator_spread(const SpectrumAccumulator *sums, size_t all);

// What is reported of the densities beside their mean.
enum {
    SPECTRUM_INTERVALS = 1, // deviation and confidence interval of the mean
    SPECTRUM_QUANTILES = 2, // of the runs kept
};

// Fills frequencies and spectra. `value`: of the study's own scene; NULL: none. `progress` may stop
// the sorting for quantiles. STATUS_NO_MEMORY, STATUS_CANCELLED, STATUS_UNSTABLE where deviations
// overflow.
Status spectrum_accumulator_report(const SpectrumAccumulator *sums, const Spectrum *value, int what,
                                   const Progress *progress, Reals *frequency, RunSpectra *spectra,
                                   Problem *problem);

void spectrum_accumulator_clear(SpectrumAccumulator *sums);

// Sobol indices: the parts of a result's variance that its uncertain inputs cause, alone and in
// all.
//
// Results of the runs of N base samples, which have k + 2 runs each: of row A, of row B, and for
// each input in turn of row A with that input from row B. NAN: unknown.
typedef struct SobolRuns {
    const double *values; // of run r of sample j at values[((k + 2) j + r) * stride]
    size_t stride;
    size_t samples, inputs; // N and k
} SobolRuns;

// Of one input, each with its 95 % confidence interval. NAN and no interval: unknown.
typedef struct SobolIndex {
    uint64_t samples; // whose runs are all known
    double first, total;
    Reals first_interval_95, total_interval_95;
} SobolIndex;
extern const Field sobol_index_fields[];

// The indices of an input into an empty `index`. Unknown where the results do not differ or fewer
// than two samples are known. STATUS_NO_MEMORY.
Status sobol_index_estimate(const SobolRuns *runs, size_t input, SobolIndex *index);

// The lognormal distribution of numbers that are known to lie within intervals, by maximum
// likelihood, with confidence intervals.

// The number is above `low`, 0 if that is not known, and at most `high`, INFINITY likewise.
typedef struct CensoredNumber {
    double low, high;
} CensoredNumber;

typedef struct LognormalFit {
    double median, dispersion; // exp(mu), and the standard deviation of the logarithm
    double median_interval[2], dispersion_interval[2];
} LognormalFit;

// Intervals have this confidence. False where the likelihood has no maximum: it then grows as the
// dispersion tends to 0 or to infinity, or there are no lower or no upper bounds.
bool lognormal_fit(const CensoredNumber *numbers, size_t count, double confidence,
                   LognormalFit *fit);

#endif
