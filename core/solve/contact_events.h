// Touching, bouncing, resting and leaving in the general engine: what happens at an instant, and
// finding that instant on an arc. Used by frame.c.
#ifndef CORE_SOLVE_CONTACT_EVENTS_H
#define CORE_SOLVE_CONTACT_EVENTS_H

#include "core/solve/taylor_step.h"
#include "core/solve/modal_state.h"

typedef struct FrameEvent {
    size_t damper;
    double s;
    Side side;       // of the stop
    bool is_inwards; // out of FRAME_INSIDE: back into contact
    bool is_jump;    // out of FRAME_RESTING: the force is already below 0
} FrameEvent;

// Finds the first event on the arc; of several at once the one of the first damper.
bool frame_find_event(const Frame *frame, const FrameArc *arc, FrameEvent *event);

// Makes it happen; the state is that of its instant.
void frame_happen(Frame *frame, const FrameEvent *event);

#endif
