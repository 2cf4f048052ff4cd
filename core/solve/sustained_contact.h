// Long steps of one damper's contact with a linear buffer, a sample interval or some halves of it,
// where the contact is so stiff that it takes many Taylor steps; with a proof that it lasts.
#ifndef CORE_SOLVE_SUSTAINED_CONTACT_H
#define CORE_SOLVE_SUSTAINED_CONTACT_H

#include "core/solve/flight.h"
#include "core/solve/modal_state.h"
#include "core/solve/transition.h"

enum { PRESS_LEVELS = 8 };

// The tables of one stop, made once contacts with it have lasted long enough.
typedef struct SustainedStop {
    double spent;     // cost of Taylor steps so far
    bool is_given_up; // no memory
    Transition levels[PRESS_LEVELS];
    double *damped, *bent;               // D shape, W^2 shape
    double wide, most_damped, most_bent; // |shape|, |D shape|, |W^2 shape|
    double coupling, bending;            // shape . D shape, shape . W^2 shape
} SustainedStop;

typedef struct SustainedContact {
    SustainedStop *stops; // damper after damper, by Side
    size_t count;
    double length[PRESS_LEVELS];                           // the interval, its half, ...
    double ground[PRESS_LEVELS][2], fall[PRESS_LEVELS][2]; // as those of Flight
    double *start, *gained, *pulled, *elastic;             // scratch
    double *block;
} SustainedContact;

// Freed by sustained_contact_clear, also after a failure.
Status sustained_contact_make(SustainedContact *press, const ModalState *state, Problem *problem);
void sustained_contact_clear(SustainedContact *press);

// Moves the state by at most `length` if surely no contact begins or ends meanwhile, and returns
// the length of the step [s]. Its integrals are in *work if that is not NULL, and in the damper's
// row. 0: nothing has changed.
double sustained_contact_step(SustainedContact *press, ModalState *state, const Slice *slice,
                              double length, StepWork *work);

#endif
