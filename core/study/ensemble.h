// The study "ensemble": many seeds of one random base motion, or draws of uncertain inputs. Means
// with their confidence, spread, mean spectra, and a row for each run.
#ifndef CORE_STUDY_ENSEMBLE_H
#define CORE_STUDY_ENSEMBLE_H

#include "core/study/inputs.h"
#include "core/study/statistics.h"

// The request.
typedef struct EnsembleStudy {
    Variant variant;
    uint64_t runs;       // at most, one for each seed; under sobol_indices base samples
    uint64_t first_seed; // COUNT_ABSENT until completed: the scene's own
    double target;       // relative error of the metric's mean; NAN: none, all runs are made
    int metric;          // StatisticsMetric of the target; CHOICE_ABSENT without one
    UncertainInputs inputs;
    int sampling; // SamplingMethod; CHOICE_ABSENT without inputs
    bool sobol_indices;
} EnsembleStudy;

#define ENSEMBLE_STATISTIC(constant, name, unit) RunStatistic name;
typedef union EnsembleStatistics {
    struct {
        STUDY_METRICS_SUMMARY(ENSEMBLE_STATISTIC)
    };
    RunStatistic of[STATISTICS_METRICS];
} EnsembleStatistics;

// Result of the target; all absent without one.
typedef struct EnsembleTarget {
    double error; // requested
    int metric;
    double confidence; // that the error against all runs is no larger than estimated
    uint64_t pilot;    // runs made before the first prediction, which follows
    uint64_t predicted_runs;
    double estimated_error; // at the end; 0 if all runs were made
    bool is_kept;
    char *why;
} EnsembleTarget;

// A number that was drawn for each run, in the order of the rows' inputs.
typedef struct EnsembleInput {
    char *pointer, *unit;
    bool is_factor;       // of the number there, or of all rows of the buffer's table
    uint64_t drawn_again; // values out of range
} EnsembleInput;

// Sobol indices of one input for one metric.
typedef struct EnsembleIndex {
    char *pointer;
    int metric; // StatisticsMetric
    SobolIndex sobol;
} EnsembleIndex;

// The answer.
typedef struct Ensemble {
    Variant variant;
    StudyRuns made;
    uint64_t first_seed; // requested
    double confidence;   // of the intervals
    EnsembleTarget target;
    EnsembleStatistics statistics;
    RunTrust trust;
    Reals frequency; // [Hz]
    RunSpectra spectra;
    int sampling; // SamplingMethod; CHOICE_ABSENT without inputs, and nothing in the next four
    struct {
        EnsembleInput *at;
        size_t count;
    } inputs;
    struct {
        EnsembleIndex *at;
        size_t count;
    } indices;
    Reals time;              // [s]
    RunSpectra displacement; // over time, of one channel
    RunTable table;          // the numbers are seeds
} Ensemble;

#endif
