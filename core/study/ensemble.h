// The study "ensemble": many seeds of one random base motion. Means with their confidence, spread,
// mean spectra, and a row for each run.
#ifndef CORE_STUDY_ENSEMBLE_H
#define CORE_STUDY_ENSEMBLE_H

#include "core/study/statistics.h"

// The request.
typedef struct EnsembleStudy {
    Variant variant;
    uint64_t runs;       // at most, one for each seed
    uint64_t first_seed; // COUNT_ABSENT until completed: the scene's own
    double target;       // relative error of the metric's mean; NAN: none, all runs are made
    int metric;          // StatisticsMetric of the target; CHOICE_ABSENT without one
} EnsembleStudy;

typedef union EnsembleStatistics {
    struct {
        RunStatistic peak_displacement, rms_displacement, peak_acceleration, rms_acceleration,
            impacts, peak_contact_force;
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

// The answer.
typedef struct Ensemble {
    Variant variant;
    uint64_t runs, first_seed; // requested
    uint64_t made, failed;
    double steps;      // solver steps of all runs
    double confidence; // of the intervals
    EnsembleTarget target;
    EnsembleStatistics statistics;
    RunTrust trust;
    StudyFailures failures;
    Reals frequency; // [Hz]
    RunSpectra spectra;
    RunTable table; // the numbers are seeds
} Ensemble;

#endif
