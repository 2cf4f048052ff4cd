// The study "ensemble": many seeds of one random base. What is asked, and what comes of it: means
// with their confidence, spread, the mean spectra, and a row for each run. Not how:
// ensemble_run.c makes the runs, ensemble_statistics.h and ensemble_spectra.h fold them. Used by
// whoever shows them.
#ifndef CORE_STUDY_ENSEMBLE_H
#define CORE_STUDY_ENSEMBLE_H

#include "core/study/study.h"

// What a target may be of: the statistics in the order of EnsembleStatistics, then the spectra.
typedef enum EnsembleMetric {
    ENSEMBLE_PEAK_DISPLACEMENT,
    ENSEMBLE_RMS_DISPLACEMENT,
    ENSEMBLE_PEAK_ACCELERATION,
    ENSEMBLE_RMS_ACCELERATION,
    ENSEMBLE_IMPACTS,
    ENSEMBLE_PEAK_CONTACT_FORCE,
    ENSEMBLE_STATISTICS,
    ENSEMBLE_PSD = ENSEMBLE_STATISTICS,
} EnsembleMetric;
extern const char *const ensemble_metric_names[]; // NULL-terminated

// What is asked.
typedef struct EnsembleStudy {
    Study study;
    uint64_t runs;       // at most, one for each seed
    uint64_t first_seed; // COUNT_ABSENT until completed: the scene's own
    double target;       // NAN: none, all are run
    int metric;          // EnsembleMetric, of the target; CHOICE_ABSENT without one
} EnsembleStudy;

// One number of each run, over the runs that know it. NAN where they are too few.
typedef struct EnsembleStatistic {
    char *unit;
    uint64_t count;
    double mean, standard_deviation, standard_error;
    double low, high; // of the mean, by Student's t
    double minimum, q05, q25, median, q75, q95, maximum;
    uint64_t minimum_seed, maximum_seed; // the first of equal ones
} EnsembleStatistic;

typedef struct EnsembleStatistics {
    EnsembleStatistic peak_displacement, rms_displacement, peak_acceleration, rms_acceleration,
        impacts, peak_contact_force;
} EnsembleStatistics;

EnsembleStatistic *ensemble_statistic(EnsembleStatistics *statistics, int metric);

// How far single trajectories can be trusted.
typedef struct EnsembleTrust {
    uint64_t whole;   // runs that can be to their end
    uint64_t beyond;  // that go on beyond their horizon: there only statistics hold
    uint64_t unknown; // whose error nothing estimates
    double shortest_horizon;
    double largest_error_estimate, largest_energy_residual;
} EnsembleTrust;

// Runs that failed for one reason.
typedef struct EnsembleFailure {
    char *reason; // "unstable"
    uint64_t count, first_seed;
    char *detail; // of the first
} EnsembleFailure;

typedef struct EnsembleFailures {
    EnsembleFailure *at;
    size_t count;
} EnsembleFailures;

// One channel's densities over the runs, at each frequency.
typedef struct EnsembleSpectrum {
    char *channel, *unit;
    Reals mean, standard_deviation;
    Reals low, high; // of the mean, each frequency for itself
} EnsembleSpectrum;

typedef struct EnsembleSpectra {
    EnsembleSpectrum *at;
    size_t count;
} EnsembleSpectra;

// One run: the scene with this seed.
typedef struct EnsembleRun {
    uint64_t seed;
    char *why; // it failed; NULL: it did not
    double steps;
    Summary summary;
} EnsembleRun;

typedef struct EnsembleRuns {
    EnsembleRun *at;
    size_t count;
} EnsembleRuns;

// What became of the target; all absent without one.
typedef struct EnsembleTarget {
    double error; // wanted
    int metric;
    double confidence; // that the error against all runs is no larger than estimated
    uint64_t pilot;    // runs that came before the first prediction; what follows is of them
    uint64_t predicted_runs;
    double estimated_error; // at the end; 0 once all were run
    bool is_kept;
    char *why;
} EnsembleTarget;

// The answer.
typedef struct Ensemble {
    Variant variant;
    uint64_t runs, first_seed; // asked
    uint64_t made, failed;
    double steps;      // of all runs, counted
    double confidence; // of the intervals
    EnsembleTarget target;
    EnsembleStatistics statistics;
    EnsembleTrust trust;
    EnsembleFailures failures;
    Reals frequency; // [Hz]
    EnsembleSpectra spectra;
    EnsembleRuns table;
} Ensemble;

// The scene with this seed and nothing sampled: what one run of the table is. `simulation` must
// have a random base; `target` is cleared by simulation_clear.
Status ensemble_member(const Simulation *simulation, uint64_t seed, Simulation *target,
                       Problem *problem);

#endif
