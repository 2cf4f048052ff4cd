// Contact under power laws in the general engine: while any buffer is pressed, all modes and masses
// together go by steps as long as a tolerance allows, with all events located on them; flight stays
// exact. Not the series that a step is made of (frame_series.h). Used by frame_engine.c.
#ifndef CORE_SOLVE_POWER_CONTACT_H
#define CORE_SOLVE_POWER_CONTACT_H

#include "core/solve/contact_events.h"
#include "core/solve/power_series.h"
#include "core/solve/modal_state.h"

// What is known of a damper's contact.
typedef struct FrameOdeContact {
    ContactParameters parameters; // of the contact that the rest is of
    ContactTerms terms;
    SeriesLaw law;
    double speed;         // of the motion in it, about [m/s]
    double depth;         // p that such a speed comes to [m]
    double push;          // p'' without N [m/s^2]
    double negligible;    // N is, below this p [m]
    int passed;           // the kink at the end of the last step: 1 upwards, -1 downwards, 0 none
    double strain;        // at the start of a step [J]
    double impulse, work; // of N over it [N s], [J]
} FrameOdeContact;

typedef struct FrameOde {
    Frame *frame;
    double tolerance; // of a contact
    double error;     // of a step
    size_t order;     // of its series, at most
    FrameSeries series;
    FrameOdeContact *contact; // damper after damper
    double *speed, *modal;    // scales
    double *row, *elastic;    // scratch
    double *nodes; // scratch: of all modes, or of all dampers, at the nodes of a quadrature
    double last;   // length of the last step's series, in its tau
    int last_root; // and its root
    size_t still;  // kinks in a row, without time passing
    double *block;
} FrameOde;

// What a step adds up to.
typedef struct FrameOdeStep {
    double length;
    double input, damping; // the base's work, and that lost in the structure [J]
    double ground;         // integral of a_g [m/s]
    bool is_event;         // at its end
    FrameEvent event;
    double work; // that it took, in multiplications
} FrameOdeStep;

// What a contact may be wrong by where nothing else is asked for: rounding's edge.
#define FRAME_ODE_TOLERANCE 1e-15

// Room for the contacts of one run, none where its law needs none. Freed by frame_ode_clear, also
// after a failure.
Status frame_ode_make(FrameOde *ode, Frame *frame, double tolerance, Problem *problem);
void frame_ode_clear(FrameOde *ode);

// Whether the present state is one for such steps.
bool frame_ode_serves(const FrameOde *ode);

// One step of the frame's state, at most `length` long, up to an event at most; writes the rows of
// dampers in contact, and a_g is `slice` from now on.
void frame_ode_step(FrameOde *ode, const Slice *slice, double length, FrameOdeStep *step);

#endif
