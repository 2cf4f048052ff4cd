// What dampers add to the error of modes left out: their impacts strike those modes too, and are
// themselves others where a storey keeps only a part of what gives way to a blow. Guesses, from how
// far the modes move. Used by truncation.c.
#ifndef CORE_PLAN_TRUNCATION_BLOWS_H
#define CORE_PLAN_TRUNCATION_BLOWS_H

#include "core/plan/truncation_levels.h"

// Of one damper.
typedef struct Blows {
    const Plan *plan;
    const Level *levels;
    size_t storey;
    double impulse, time;     // of one impact: J [N s], T_c [s]
    double count, remembered; // impacts of the run; those that the motion still has of them
    double carried;           // of what one impact gets wrong, by the next, as a logarithm
    double speed, reach;      // of the storey [m/s], [m]
    double yield;             // 1/m and what gives way at the storey [1/kg]
    double moved, pulled;     // what one impact does to the motion, all modes [m], [m/s^2]
    // Of the modes left out so far: likewise; what they would have given way; their own speed.
    double struck, struck_pull, stiff, still;
} Blows;

typedef struct Blow {
    double displacement, acceleration, rms; // of displacement
} Blow;

// For a damper; false: it never reaches its stops.
bool blows_start(Blows *blows, const Plan *plan, size_t damper, const Level *levels,
                 const Wave *wave);
// Mode k is left out too: what all that are come to.
Blow blows_leave(Blows *blows, size_t k);

#endif
