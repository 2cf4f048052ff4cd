// Contact under power laws in the general engine: while any buffer is pressed, all modes and masses
// together go by steps as long as a tolerance allows, with all events located on them; flight stays
// exact. Not the series that a step is made of (frame_series.h). Used by frame_engine.c.
#ifndef CORE_SOLVE_POWER_CONTACT_H
#define CORE_SOLVE_POWER_CONTACT_H

#include "core/solve/contact_events.h"
#include "core/solve/modal_state.h"
#include "core/solve/power_series.h"

// What is known of a damper's contact.
typedef struct PowerContactContact {
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
} PowerContactContact;

typedef struct PowerContact {
    ModalState *state;
    double tolerance; // of a contact
    double error;     // of a step
    size_t order;     // of its series, at most
    PowerSeries series;
    PowerContactContact *contact; // damper after damper
    double *speed, *modal;        // scales
    double *row, *elastic;        // scratch
    double *nodes; // scratch: of all modes, or of all dampers, at the nodes of a quadrature
    double last;   // length of the last step's series, in its tau
    int last_root; // and its root
    size_t still;  // kinks in a row, without time passing
    double *block;
} PowerContact;

// What a step adds up to.
typedef struct PowerContactStep {
    double length;
    double input, damping; // the base's work, and that lost in the structure [J]
    double ground;         // integral of a_g [m/s]
    bool is_event;         // at its end
    ContactEvent event;
    double work; // that it took, in multiplications
} PowerContactStep;

// What a contact may be wrong by where nothing else is asked for: rounding's edge.
#define POWER_CONTACT_TOLERANCE 1e-15

// Room for the contacts of one run, none where its law needs none. Freed by power_contact_clear,
// also after a failure.
Status power_contact_make(PowerContact *ode, ModalState *state, double tolerance, Problem *problem);
void power_contact_clear(PowerContact *ode);

// Whether the present state is one for such steps.
bool power_contact_serves(const PowerContact *ode);

// One step of the state's state, at most `length` long, up to an event at most; writes the rows of
// dampers in contact, and a_g is `slice` from now on.
void power_contact_step(PowerContact *ode, const Slice *slice, double length,
                        PowerContactStep *step);

#endif
