// The event engine: moves the modal state from sample to sample through all contact events.
#ifndef CORE_SOLVE_EVENT_ENGINE_H
#define CORE_SOLVE_EVENT_ENGINE_H

#include "core/solve/contact_events.h"
#include "core/solve/flight.h"
#include "core/solve/modal_state.h"
#include "core/solve/power_contact.h"
#include "core/solve/recorder.h"
#include "core/solve/sustained_contact.h"
#include "core/solve/taylor_step.h"

// All zero is empty.
typedef struct EventEngine {
    ModalState state;
    TaylorStep arc;
    Flight flight;
    SustainedContact pressing;
    PowerContact ode;
    Recorder record;
    double work;                   // solver steps since the last check
    size_t idle;                   // steps of contact in a row without time passing
    struct RoundingGrowth *growth; // of a single mass, or NULL
    double *track; // of the last FLIGHT_BUFFER_MAX samples, all modes: sample k at (k - 1) %
                   // FLIGHT_BUFFER_MAX; NULL: not wanted
} EventEngine;

// `tolerance` is of contacts under a power law. Cleared by event_engine_clear, also after a
// failure.
Status event_engine_make(EventEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem);
void event_engine_clear(EventEngine *engine);

// A second run of the same scene without any record. It owns `state` and `ode` and borrows the
// rest.
Status event_engine_shadow(EventEngine *engine, const EventEngine *of, Run *run, double tolerance,
                           Response *response);

// Applies the events at t = 0 of masses that start on a stop; the first sample is the state after.
Status event_engine_settle(EventEngine *engine);

// Moves to the next sample or several, at most to sample `until`, and records them.
Status event_engine_step(EventEngine *engine, size_t until);
void event_engine_take_sample(EventEngine *engine);

// Moves from the present instant to the next sample, and records it.
Status event_engine_finish_interval(EventEngine *engine);

// Moves from the present sample over `length` [s].
Status event_engine_cross(EventEngine *engine, double length);

// STATUS_UNSTABLE where the motion is not finite, else as modal_state_check.
Status event_engine_check(EventEngine *engine);

#endif
