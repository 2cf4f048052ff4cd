// Properties of a scene that are proved before the run from bounds: whether the base moves, whether
// anything moves, and whether any free mass can reach a stop.
#ifndef CORE_PLAN_REACHABILITY_H
#define CORE_PLAN_REACHABILITY_H

#include "core/excitation/base_motion.h"
#include "core/plan/plan.h"

typedef struct Regime {
    bool is_unforced; // the base does not move
    bool is_at_rest;  // nothing moves
    bool is_clear;    // no mass reaches a stop; true without a mass
    // Bound on the distance of a mass from the middle of its stops over half their distance, the
    // largest of all masses; INFINITY: 1 or more, or unknown [-]
    double reach;
} Regime;

// `base` is the motion that the plan's run has.
Regime regime_find(const Plan *plan, const Base *base);

#endif
