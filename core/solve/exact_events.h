// Touching, bouncing, resting and leaving: what happens at an instant, and finding that instant on
// an arc. Used by exact.c.
#ifndef CORE_SOLVE_EXACT_EVENTS_H
#define CORE_SOLVE_EXACT_EVENTS_H

#include "core/solve/exact_state.h"

// Finds the first event on the arc, at s; in flight *side is the stop that is reached.
bool exact_find_event(Exact *exact, const Arc *arc, double *s, Side *side);

void exact_touch(Exact *exact, Side side); // flight ends
void exact_release(Exact *exact);          // contact or rest ends
void exact_pass_sample(Exact *exact);      // the present interval's end: records the next sample
void exact_note(Exact *exact);             // takes peaks and the energy balance at this instant

// Tells the estimate of what rounding does that the present phase ends, or the run.
void exact_end_phase(Exact *exact);

#endif
