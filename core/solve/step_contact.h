// Contact in time stepping: the force of a buffer, and the contact state changes at a step's end.
#ifndef CORE_SOLVE_STEP_CONTACT_H
#define CORE_SOLVE_STEP_CONTACT_H

#include "core/solve/modal_state.h"

// One step's integrals of the contact force, damper by damper.
typedef struct StepContact {
    double *impulse;       // integral of N [N s]
    double *work;          // integral of N r' [J]
    double *strain_before; // strain energy of the buffer at the step's start [J]
    // The method derives N from the penetration at each stage and freezes the contact parameters
    // itself. False: the contacts at the step's start last until its end.
    bool is_by_place;
} StepContact;

// N of a damper in contact at the relative displacement r [m] and velocity w [m/s], its derivatives
// and the strain energy.
ContactForce step_contact_force(const ModalState *state, size_t damper, double r, double w);

// Stores the strain energies, before a step.
void step_contact_begin(const ModalState *state, StepContact *contact);
// Adds a step of `length` seconds of contact or rest to the row of a damper.
void step_contact_log(ModalState *state, const StepContact *contact, size_t damper, double length);
// Begins and ends contacts after a step of `length` seconds, and logs them.
void step_contact_end(ModalState *state, const StepContact *contact, double length);

#endif
