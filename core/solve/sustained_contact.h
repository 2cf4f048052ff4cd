// Long steps of one damper's contact, a sample interval or some halves of it, where the contact
// is so stiff that arcs would be many; with a proof that it lasts. Not for contacts whose
// parameters depend on the impact, nor for several at once: those go by arcs.
#ifndef CORE_SOLVE_SUSTAINED_CONTACT_H
#define CORE_SOLVE_SUSTAINED_CONTACT_H

#include "core/solve/flight.h"
#include "core/solve/modal_state.h"
#include "core/solve/transition.h"

enum { PRESS_LEVELS = 8 };

// Of one stop, made once contacts with it have lasted for long enough.
typedef struct SustainedStop {
    double spent;     // on arcs
    bool is_given_up; // no memory for it
    Transition levels[PRESS_LEVELS];
    double *damped, *bent;               // D shape, W^2 shape
    double wide, most_damped, most_bent; // |shape|, |D shape|, |W^2 shape|
    double coupling, bending;            // shape . D shape, shape . W^2 shape
} SustainedStop;

typedef struct SustainedContact {
    SustainedStop *stops; // damper after damper, by Side
    size_t count;
    double length[PRESS_LEVELS];                           // the interval, its half, ...
    double ground[PRESS_LEVELS][2], fall[PRESS_LEVELS][2]; // as Flight's
    double *start, *gained, *pulled, *elastic;             // scratch
    double *block;
} SustainedContact;

// Freed by sustained_contact_clear, also after a failure.
Status sustained_contact_make(SustainedContact *press, const ModalState *state, Problem *problem);
void sustained_contact_clear(SustainedContact *press);

// Moves the state by at most `length` if surely no contact begins or ends meanwhile, and says what
// that adds up to, if `work` is not NULL; the damper's row is written. Returns the time it takes;
// 0: it must go by arcs, and nothing has changed.
double sustained_contact_step(SustainedContact *press, ModalState *state, const Slice *slice,
                              double length, StepWork *work);

#endif
