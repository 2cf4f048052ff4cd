// Which points are worth their time, and which one to take. Pure arithmetic on a table of points.
// Used by tradeoff.c.
#ifndef CORE_STUDY_PARETO_H
#define CORE_STUDY_PARETO_H

#include "core/study/tradeoff.h"

// Marks the points that are best: no other is both as cheap and as close, and better in one.
void pareto_mark(TradeoffPoints *points, int metric);

// The cheapest point that keeps `error`, or a closer one that takes hardly longer, with the reason.
// STATUS_NO_MEMORY.
Status pareto_recommend(const TradeoffPoints *points, int metric, double error,
                        TradeoffRecommendation *choice);

#endif
