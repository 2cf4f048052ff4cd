// The study "tradeoff": the cost of accuracy in CPU time, measured on the scene itself.
#ifndef CORE_STUDY_TRADEOFF_H
#define CORE_STUDY_TRADEOFF_H

#include "core/study/pareto.h"
#include "core/study/study.h"

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

#endif
