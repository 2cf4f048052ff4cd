// The motion of the adaptive solver: all modes and masses as one state for math/ode.h, what of it
// is watched, and what a step of it means to the state and its ledger. Not the events nor the
// stepping (adaptive.c). Used by adaptive.c.
#ifndef CORE_SOLVE_ADAPTIVE_MOTION_H
#define CORE_SOLVE_ADAPTIVE_MOTION_H

#include "core/math/ode.h"
#include "core/solve/time_stepping.h"

// Of each damper.
enum { ADAPTIVE_FIRST, ADAPTIVE_SECOND, ADAPTIVE_PEAK, ADAPTIVE_WATCHED };

typedef struct Adaptive {
    Steps *steps;
    Ode *ode;
    size_t size; // of y
    double *y, *before, *scale, *rates, *force;
    double *strain; // of the dampers' buffers, at the last step [J]
    double *rated;  // how often the motion's rate was asked for since it was last counted
    double *block;
    double speed;  // sqrt(p'p + q'W^2 q) at most, so far
    double push;   // |a_g| over an interval at most, so far [m/s^2]
    Slice slice;   // of the base
    double at;     // the time at which it begins, and that of the state, since the start [s]
    size_t events; // of the state as of the last step
} Adaptive;

// Freed by adaptive_motion_free, also after a failure.
Status adaptive_motion_make(Adaptive *own, Steps *steps);
void adaptive_motion_free(Adaptive *own);

// From the state's present state, anew.
Status adaptive_motion_start(Adaptive *own);
// Is the motion, or the base, far beyond what errors were measured by at the last start? A base
// that has been still sets moving what was measured by nothing.
bool adaptive_motion_has_outgrown(const Adaptive *own);
// The state's state becomes y, `length` seconds later; what was summed up goes where it belongs.
void adaptive_motion_take(Adaptive *own, double length);

#endif
