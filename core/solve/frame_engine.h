// The stepping of the general engine: from sample to sample, past all events between.
// Not the whole run (frame.c) and not the motion of one stretch (frame_arc.h, frame_flight.h,
// frame_press.h, frame_ode.h). Used by frame.c and frame_neighbour.c.
#ifndef CORE_SOLVE_FRAME_ENGINE_H
#define CORE_SOLVE_FRAME_ENGINE_H

#include "core/solve/contact_events.h"
#include "core/solve/flight.h"
#include "core/solve/modal_state.h"
#include "core/solve/power_contact.h"
#include "core/solve/recorder.h"
#include "core/solve/sustained_contact.h"
#include "core/solve/taylor_step.h"

// All zero is empty.
typedef struct FrameEngine {
    Frame frame;
    FrameArc arc;
    FrameFlight flight;
    FramePress pressing;
    FrameOde ode;
    FrameTrail trail;
    FrameRecord record;
    double work;   // since the progress was asked
    size_t idle;   // steps of contact in a row that took no time
    double *track; // of the last TRAIL_MAX samples, all modes: sample k at (k - 1) % TRAIL_MAX;
                   // NULL: not wanted
} FrameEngine;

// `tolerance` is of contacts under a power law. Cleared by frame_engine_clear, also after a
// failure.
Status frame_engine_make(FrameEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem);
void frame_engine_clear(FrameEngine *engine);

// A run of its own that shares what the other has made once, and of which only the motion matters.
// Its own are `frame` and `ode`; the rest is the other's to clear.
Status frame_engine_shadow(FrameEngine *engine, const FrameEngine *of, Run *run, double tolerance,
                           Response *response);

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
Status frame_engine_settle(FrameEngine *engine);

// To the next sample or several, but not beyond sample `until`, and takes them; a shadow takes
// none.
Status frame_engine_step(FrameEngine *engine, size_t until);
void frame_engine_take_sample(FrameEngine *engine);

// From the present sample over `length` [s].
Status frame_engine_cross(FrameEngine *engine, double length);

// Whether the motion is finite, the limits are kept and the progress lets the run go on.
Status frame_engine_check(FrameEngine *engine);

#endif
