// Touching, bouncing, resting and zero_gap_terms in the general engine: what happens at an instant,
// and finding that instant on an arc. Used by state.c.
#ifndef CORE_SOLVE_CONTACT_EVENTS_H
#define CORE_SOLVE_CONTACT_EVENTS_H

#include "core/solve/modal_state.h"
#include "core/solve/taylor_step.h"

typedef struct ContactEvent {
    size_t damper;
    double s;
    Side side;       // of the stop
    bool is_inwards; // out of PHASE_INSIDE: back into contact
    bool is_jump;    // out of PHASE_RESTING: the force is already below 0
} ContactEvent;

// Finds the first event on the arc; of several at once the one of the first damper.
bool contact_event_find(const ModalState *state, const TaylorStep *arc, ContactEvent *event);

// Makes it happen; the state is that of its instant.
void contact_event_apply(ModalState *state, const ContactEvent *event);

#endif
