// The parts of a step of contact: what comes before it, on it and after it. Not the step itself
// (power_contact.h). Used by core/solve/frame_ode*.c.
#ifndef CORE_SOLVE_POWER_CONTACT_STEP_H
#define CORE_SOLVE_POWER_CONTACT_STEP_H

#include <math.h>

#include "core/solve/power_contact.h"

static inline double power_contact_penetration(const DamperState *damper) {
    return fmax(modal_state_sign(damper->side) * damper->r, 0);
}

// power_contact_contact.c

// Brings what is known of a contact up to the present state.
void power_contact_look(PowerContact *ode, size_t damper);
// Lists those in contact; the leader comes first. Returns its Y.
double power_contact_contacts(PowerContact *ode);
// What a step of tau is about as long as, and what is large for each component.
double power_contact_scale(PowerContact *ode, double Y, double length, SeriesScale *scale);

// power_contact_events.c

// What ends a step before its time: `is_stop`, N is to be felt from here on; `is_kink`, the law's;
// else an event.
typedef struct PowerContactFound {
    bool is_found, is_kink, is_stop;
    size_t contact;
    ContactEvent event;
} PowerContactFound;

// A buffer that has let go already: its gap opens from the first instant on.
bool power_contact_find_open(const PowerContact *ode, PowerContactStep *step);
// Cuts the step where the leader leaves, for behind it t would fall. Whether it does.
bool power_contact_cut_end(PowerSeries *series);
// Cuts the step where t is `length`. Whether it comes that far, *is_cut whether it came further.
bool power_contact_cut_time(PowerSeries *series, double length, bool *is_cut);
// `is_end`: at its end the leader leaves.
void power_contact_find(const PowerContact *ode, bool is_end, PowerContactFound *found);

// power_contact_take.c

// The state's state becomes that at s.
void power_contact_state(PowerContact *ode, const Slice *slice, double s, bool is_ended);
// Integrals over the step: of N for each contact, of the rest into *step.
void power_contact_sums(PowerContact *ode, const Slice *slice, PowerContactStep *step);
// Largest forces on the way, and what they accelerate; changes the state's state.
void power_contact_peaks(PowerContact *ode, const Slice *slice);
// The rows of all contacts, after the state is that of the end.
void power_contact_rows(PowerContact *ode, double length);

#endif
