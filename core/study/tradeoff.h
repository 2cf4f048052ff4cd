// The study "tradeoff": what speed costs in accuracy, measured on the scene itself. What is asked,
// and the table that answers. Not how: tradeoff.c runs it, tradeoff_ladder.h lists what is tried,
// simulation/compare.h measures, tradeoff_choice.h chooses. Used by whoever shows a table or a
// chart.
#ifndef CORE_STUDY_TRADEOFF_H
#define CORE_STUDY_TRADEOFF_H

#include "core/simulation/error_metrics.h"
#include "core/study/study.h"

// What is asked.
typedef struct TradeoffStudy {
    Study study;
    double error; // wanted; NAN until completed: the metric's usual one
    int metric;   // Metric
    uint64_t repeats;
    uint64_t trial;     // another number measures anew
    double point_steps; // no point may take more solver steps
    Texts solvers;      // none: all
} TradeoffStudy;

typedef enum TradeoffStatus {
    TRADEOFF_MEASURED,
    TRADEOFF_REFUSED, // foretold or judged impossible: not begun
    TRADEOFF_FAILED,  // begun and not brought to an end
} TradeoffStatus;
extern const char *const tradeoff_status_names[];

// One way to run the scene. The first part says how it differs from the scene; what is absent is as
// there.
typedef struct TradeoffPoint {
    char *name;   // "rk4, step 1e-05 s"
    char *solver; // of the solvers' table
    double step, tolerance;
    char *contact_model;
    double sample_rate, duration;
    uint64_t segment;
    uint64_t modes;

    int status;                     // TradeoffStatus
    char *why;                      // of one that was not measured
    double cpu_minimum, cpu_median; // of one run [s]
    uint64_t runs;                  // that were timed
    double steps;                   // that the solver counted
    Errors errors;
    bool is_best; // nothing is both cheaper and closer by the metric
} TradeoffPoint;

typedef struct TradeoffPoints {
    TradeoffPoint *at;
    size_t count;
} TradeoffPoints;

// What the points are compared with.
typedef struct TradeoffReference {
    char *solver;
    Yardstick yardstick;
} TradeoffReference;

typedef struct TradeoffRecommendation {
    uint64_t point; // its number, from 1; COUNT_ABSENT: none keeps the error
    char *why;
} TradeoffRecommendation;

// The answer.
typedef struct Tradeoff {
    Variant variant;
    int metric;
    double error;
    uint64_t repeats, trial;
    TradeoffReference reference;
    TradeoffPoints points;
    TradeoffRecommendation recommendation;
} Tradeoff;

extern const Field tradeoff_point_fields[];

#endif
