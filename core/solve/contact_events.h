// Contact events: how they change the state of the masses, and the location of the first one on a
// Taylor step.
#ifndef CORE_SOLVE_CONTACT_EVENTS_H
#define CORE_SOLVE_CONTACT_EVENTS_H

#include "core/solve/modal_state.h"
#include "core/solve/taylor_step.h"

typedef struct ContactEvent {
    size_t damper;
    double s;
    Side side;       // of the stop
    bool is_inwards; // of PHASE_INSIDE: back into contact
    bool is_jump;    // of PHASE_RESTING: the force is already below 0
    // Under a power law what ends a step without an event: N is no more negligible, or the law's
    // kink is passed, upwards 1 or downwards -1.
    bool is_onset;
    int kink;
} ContactEvent;

// Finds the first event on the step; of simultaneous ones that of the first damper.
bool contact_event_find(const ModalState *state, const TaylorStep *arc, ContactEvent *event);

// Locates the first zero crossing of the polynomial `gap`, whose start is not negative; a negative
// gap[0] is set to 0. Replaces *first by the candidate if none is found yet or its s is smaller.
void contact_event_locate(double *gap, size_t degree, ContactEvent candidate, bool *is_found,
                          ContactEvent *first);

// Likewise for a damper in flight that touches a stop; r is its relative displacement.
void contact_event_find_touch(const ModalState *state, size_t damper, const double *r,
                              size_t degree, bool *is_found, ContactEvent *first);

// Changes the state, which is that of the event's instant, and logs it. STATUS_UNSTABLE after too
// many events at one instant, or the status of the impact log.
Status contact_event_apply(ModalState *state, const ContactEvent *event);

#endif
