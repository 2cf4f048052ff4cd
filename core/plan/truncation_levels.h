// How far each mode of a structure will move, told from the scene before anything runs, dampers
// left aside. Guesses that err on the large side; not a motion. Used by truncation.c.
#ifndef CORE_PLAN_TRUNCATION_LEVELS_H
#define CORE_PLAN_TRUNCATION_LEVELS_H

#include "core/plan/plan.h"

// Of one mode's q. Of a mode that is fast beside the base, what follows the base is the same wave
// in every other such mode; the rest swings at the mode's own frequency.
typedef struct Level {
    double pushed[2];   // the wave, where it is largest: its two phases
    double peak, rms;   // of the rest; the peak is seldom larger
    double accelerated; // rms of the rest's mean q'' over sample intervals
    double start;       // q at t = 0
    double least;       // a peak of all of it that is seldom missed
    double sure;        // likewise of rms and acceleration, over these
} Level;

// What the waves have in common.
typedef struct Wave {
    double rms;         // over the largest
    double least;       // a largest that is seldom missed, over the largest that is seldom exceeded
    double accelerated; // rms of the second derivative over rms [rad^2/s^2]
} Wave;

// levels[k] of all modes of the plan.
Status levels_make(const Plan *plan, const Scene *scene, Level *levels, Wave *wave);

#endif
