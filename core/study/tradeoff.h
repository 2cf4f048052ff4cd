// The study "tradeoff": the cost of accuracy in CPU time, measured on the scene itself.
#ifndef CORE_STUDY_TRADEOFF_H
#define CORE_STUDY_TRADEOFF_H

#include "core/simulation/error_metrics.h"
#include "core/study/study.h"

typedef enum TradeoffStatus {
    TRADEOFF_MEASURED,
    TRADEOFF_REFUSED, // too expensive or invalid: not run
    TRADEOFF_FAILED,  // its run failed
} TradeoffStatus;
extern const char *const tradeoff_status_names[];

// One candidate: a solver with a step or a tolerance, or something else that may be traded for
// speed. The first part is its difference from the scene: what is absent is as there.
typedef struct TradeoffPoint {
    char *name;   // "rk4, step 1e-05 s"
    char *solver; // of the solvers' table
    double step, tolerance;
    char *contact_model;
    double sample_rate, duration;
    uint64_t segment;
    uint64_t modes;

    int status;                     // TradeoffStatus
    char *why;                      // it was not measured
    double cpu_minimum, cpu_median; // of one run [s]
    uint64_t runs;                  // timed
    double steps;                   // solver steps
    Errors errors;
    bool is_best; // nothing is both cheaper and closer by the metric
    // Not written to JSON:
    double estimate; // of its solver steps
} TradeoffPoint;

typedef struct TradeoffPoints {
    TradeoffPoint *at;
    size_t count;
} TradeoffPoints;

extern const Field tradeoff_point_fields[];

// The candidates of a completed simulation without results, of the named solvers (none: all).
// Cleared by fields_clear; after STATUS_NO_MEMORY those made so far.
Status candidate_settings_list(const Texts *names, const Simulation *simulation,
                               TradeoffPoints *points);

// The simulation with the settings of a point, completed under `limits`. Cleared by
// simulation_clear in any case.
Status candidate_settings_apply(const Simulation *simulation, const TradeoffPoint *point,
                                const SimulationLimits *limits, Simulation *target,
                                Problem *problem);

// Estimated solver steps of a point.
double candidate_settings_cost(const Simulation *simulation, const TradeoffPoint *point);

// The request.
typedef struct TradeoffStudy {
    Variant variant;
    double error; // wanted; NAN until completed: the metric's default
    int metric;   // Metric
    uint64_t repeats;
    uint64_t trial;     // another number measures anew
    double point_steps; // limit on the solver steps of a point
    Texts solvers;      // none: all
} TradeoffStudy;

typedef struct TradeoffReference {
    char *solver;
    ReferenceSummary yardstick;
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

// Marks the Pareto-optimal points: no other is as cheap and as close, and better in one of both.
void tradeoff_mark_best(TradeoffPoints *points, int metric);

// Recommends the cheapest point that keeps `error`, or a closer one that takes hardly longer.
Status tradeoff_recommend(const TradeoffPoints *points, int metric, double error,
                          TradeoffRecommendation *recommendation);

#endif
