// The study "tradeoff": the cost of accuracy in CPU time, measured on the scene itself.
#ifndef CORE_STUDY_TRADEOFF_H
#define CORE_STUDY_TRADEOFF_H

#include "core/study/candidate_settings.h"
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
                          TradeoffRecommendation *recommendation, Problem *problem);

#endif
