// The candidates that are worth their time, and the recommended one.
#ifndef CORE_STUDY_PARETO_H
#define CORE_STUDY_PARETO_H

#include "core/study/candidate_settings.h"

typedef struct TradeoffRecommendation {
    uint64_t point; // its number, from 1; COUNT_ABSENT: none keeps the error
    char *why;
} TradeoffRecommendation;

// Marks the Pareto-optimal points: no other is as cheap and as close, and better in one of both.
void pareto_mark(TradeoffPoints *points, int metric);

// The cheapest point that keeps `error`, or a closer one that takes hardly longer.
Status pareto_recommend(const TradeoffPoints *points, int metric, double error,
                        TradeoffRecommendation *recommendation, Problem *problem);

#endif
