// Contact under power laws in the general engine: while any buffer is pressed, all modes and masses
// together are integrated step by step; flight stays exact. Not the integrator (math/ode.h). Used
// by frame.c.
#ifndef CORE_SOLVE_FRAME_ODE_H
#define CORE_SOLVE_FRAME_ODE_H

#include "core/math/ode.h"
#include "core/solve/frame_events.h"
#include "core/solve/frame_state.h"

typedef struct FrameOde {
    Frame *frame;
    Ode *ode;
    double *y, *before, *scale, *rates;
    double *strain;  // of the dampers' buffers, at the last step [J]
    double *turn;    // of the dampers: the sign of their law's kink function
    bool is_turned;  // one of these a moment ago
    double *elastic; // scratch
    double *block;
    Slice slice;   // of the base
    double at;     // the time at which it begins, and that of the state, since the start [s]
    size_t events; // of the frame as of the last step: others have changed the state since
} FrameOde;

// What a step adds up to.
typedef struct FrameOdeStep {
    double length;
    double input, damping; // the base's work, and that lost in the structure [J]
    double ground;         // integral of a_g [m/s]
    bool is_event;         // at its end
    FrameEvent event;
} FrameOdeStep;

// Room for the contacts of one run, none where its law needs none. Freed by frame_ode_clear, also
// after a failure.
Status frame_ode_make(FrameOde *ode, Frame *frame, Problem *problem);
void frame_ode_clear(FrameOde *ode);

// Whether the present state is one to be integrated.
bool frame_ode_serves(const FrameOde *ode);

// One step of the frame's state, at most `length` long, up to an event at most; writes the rows of
// dampers in contact, and a_g is `slice` from now on.
Status frame_ode_step(FrameOde *ode, const Slice *slice, double length, FrameOdeStep *step,
                      Problem *problem);

#endif
