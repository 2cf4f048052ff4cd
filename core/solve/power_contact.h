// Contact under power laws: while any buffer is compressed, all modes and masses advance together
// by Taylor series of variable step and order in a transformed time (power_series.h), with the
// events located on the series. Flight has steps of its own.
#ifndef CORE_SOLVE_POWER_CONTACT_H
#define CORE_SOLVE_POWER_CONTACT_H

#include "core/solve/contact_events.h"
#include "core/solve/modal_state.h"
#include "core/solve/power_series.h"
#include "core/solve/taylor_step.h"

typedef struct PowerContact {
    ModalState *state;
    double tolerance;                  // relative error of one contact
    double error;                      // relative truncation error of one integration step
    size_t order_max;                  // of its series
    PowerSeries series;                // of the last integration step
    struct PowerContactDamper *damper; // one per damper; NULL if no contact is under a power law
    double *inverse_speed, *inverse_modal; // scales of w and p, for SeriesScale
    double *row, *elastic;                 // scratch
    double *nodes;      // scratch: speeds of all modes, or of all dampers, at quadrature nodes
    double last_length; // of the last series in its tau, before events cut it
    int last_root;      // its root
    size_t kinks;       // passed in a row in no time
    double *block;
} PowerContact;

// One integration step.
typedef struct PowerContactStep {
    double length;
    StepWork work;
    bool is_event; // at its end
    ContactEvent event;
    double cost; // in multiplications
} PowerContactStep;

// The smallest tolerance of a contact, at the level of rounding.
#define POWER_CONTACT_TOLERANCE 1e-15

// Allocates for one run, nothing if its contact law is no power law. Freed by power_contact_clear,
// also after a failure.
Status power_contact_make(PowerContact *contact, ModalState *state, double tolerance,
                          Problem *problem);
void power_contact_clear(PowerContact *contact);

// Whether a buffer under a power law is compressed, so that power_contact_step must be used.
bool power_contact_is_active(const PowerContact *contact);

// Advances the state by one integration step, at most `length` long and at most to the first event,
// which is returned but not applied. Updates the impact rows of the dampers in contact. a_g is
// `slice` from the present instant on.
void power_contact_step(PowerContact *contact, const Slice *slice, double length,
                        PowerContactStep *step);

#endif
