// The event engine: steps the modal state from sample to sample, past all events between. The
// motions are those of taylor_step.h, flight.h, sustained_contact.h and power_contact.h.
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
    FlightBuffer buffer;
    Recorder record;
    double work;                   // since Progress was asked
    size_t idle;                   // steps of contact in a row that took no time
    struct RoundingGrowth *growth; // of a single mass, told of each event; NULL: none
    double *track; // of the last FLIGHT_BUFFER_MAX samples, all modes: sample k at (k - 1) %
                   // FLIGHT_BUFFER_MAX; NULL: not wanted
} EventEngine;

// `tolerance` is of contacts under a power law. Cleared by event_engine_clear, also after a
// failure.
Status event_engine_make(EventEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem);
void event_engine_clear(EventEngine *engine);

// A run of its own that shares what the other has made once, and of which only the motion matters.
// Its own are `state` and `ode`; the rest is the other's to clear.
Status event_engine_shadow(EventEngine *engine, const EventEngine *of, Run *run, double tolerance,
                           Response *response);

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
Status event_engine_settle(EventEngine *engine);

// To the next sample or several, but not beyond sample `until`, and takes them; a shadow takes
// none.
Status event_engine_step(EventEngine *engine, size_t until);
void event_engine_take_sample(EventEngine *engine);

// From the present instant to the next sample, and takes it.
Status event_engine_finish_interval(EventEngine *engine);

// From the present sample over `length` [s].
Status event_engine_cross(EventEngine *engine, double length);

// Whether the motion is finite, the limits are kept and Progress lets the run go on.
Status event_engine_check(EventEngine *engine);

#endif
