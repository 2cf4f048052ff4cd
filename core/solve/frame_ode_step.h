// The parts of a step of contact: what comes before it, on it and after it. Not the step itself
// (frame_ode.h). Used by core/solve/frame_ode*.c.
#ifndef CORE_SOLVE_FRAME_ODE_STEP_H
#define CORE_SOLVE_FRAME_ODE_STEP_H

#include <math.h>

#include "core/solve/power_contact.h"

static inline double frame_ode_penetration(const FrameDamper *damper) {
    return fmax(frame_sign(damper->side) * damper->r, 0);
}

// frame_ode_contact.c

// Brings what is known of a contact up to the present state.
void frame_ode_look(FrameOde *ode, size_t damper);
// Lists those in contact; the leader comes first. Returns its Y.
double frame_ode_contacts(FrameOde *ode);
// What a step of tau is about as long as, and what is large for each component.
double frame_ode_scale(FrameOde *ode, double Y, double length, SeriesScale *scale);

// frame_ode_events.c

// What ends a step before its time: `is_stop`, N is to be felt from here on; `is_kink`, the law's;
// else an event.
typedef struct FrameOdeFound {
    bool is_found, is_kink, is_stop;
    size_t contact;
    FrameEvent event;
} FrameOdeFound;

// A buffer that has let go already: its gap opens from the first instant on.
bool frame_ode_find_open(const FrameOde *ode, FrameOdeStep *step);
// Cuts the step where the leader leaves, for behind it t would fall. Whether it does.
bool frame_ode_cut_end(FrameSeries *series);
// Cuts the step where t is `length`. Whether it comes that far, *is_cut whether it came further.
bool frame_ode_cut_time(FrameSeries *series, double length, bool *is_cut);
// `is_end`: at its end the leader leaves.
void frame_ode_find(const FrameOde *ode, bool is_end, FrameOdeFound *found);

// frame_ode_take.c

// The frame's state becomes that at s.
void frame_ode_state(FrameOde *ode, const Slice *slice, double s, bool is_ended);
// Integrals over the step: of N for each contact, of the rest into *step.
void frame_ode_sums(FrameOde *ode, const Slice *slice, FrameOdeStep *step);
// Largest forces on the way, and what they accelerate; changes the frame's state.
void frame_ode_peaks(FrameOde *ode, const Slice *slice);
// The rows of all contacts, after the state is that of the end.
void frame_ode_rows(FrameOde *ode, double length);

#endif
