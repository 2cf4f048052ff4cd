// What a tradeoff study will take, in solver steps, before anything runs. Used by tradeoff.c, which
// foretells the whole, and tradeoff_measure.c, which shows progress by it.
#ifndef CORE_STUDY_TRADEOFF_BUDGET_H
#define CORE_STUDY_TRADEOFF_BUDGET_H

#include "core/study/tradeoff.h"

// About as many steps as a timing takes at least, because short runs are timed many at once.
#define BUDGET_BATCH 1e5

// The limits of one point, of those of every run (or NULL).
SimulationLimits budget_point(const TradeoffStudy *study, const SimulationLimits *limits);

// Foretold steps of one run of each point.
void budget_foretell(const Simulation *simulation, const TradeoffPoints *points, double *steps);

// Leaves out the steps that are finer than one that takes more than `most`. Returns how many points
// are left.
size_t budget_trim(TradeoffPoints *points, double *steps, double most);

// A point whose run takes so many steps, with its timings.
double budget_timed(const TradeoffStudy *study, double steps);

#endif
