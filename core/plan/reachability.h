// What of a scene's mechanics its run will need, proved from bounds before it begins: whether
// anything forces the structure, whether any free mass can come to a stop, whether anything moves
// at all. Not a motion: that is solve/. Used by simulation/.
#ifndef CORE_PLAN_REACHABILITY_H
#define CORE_PLAN_REACHABILITY_H

#include "core/excitation/base_motion.h"
#include "core/plan/plan.h"

typedef struct Regime {
    bool is_unforced; // the base is still
    bool is_at_rest;  // and nothing else moves
    bool is_clear;    // no mass comes to a stop; so too where there is no mass
    // Of the mass that comes nearest to a stop, by the bounds: how far it may come from the middle
    // of its stops, as a part of the way to them. INFINITY: not bounded, or more than 1 and not
    // looked into further [-]
    double reach;
} Regime;

// `base` is the one made for this plan's run. Where memory is short nothing is proved.
Regime regime_find(const Plan *plan, const Base *base);

#endif
