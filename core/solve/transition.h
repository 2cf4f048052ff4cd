// The transition matrix of all modes, and of dampers whose contacts last, over one step; and the
// work along the step as quadratic forms.
#ifndef CORE_SOLVE_TRANSITION_H
#define CORE_SOLVE_TRANSITION_H

#include "core/solve/modal_state.h"

// Over y = (q, r, p, w, value, slope). r and w are those of the damper in contact, and are missing
// in flight. value and slope are the base's at the start, as in a Slice.
typedef struct Transition {
    size_t size;      // of y
    size_t rows;      // of the matrices, filled up with zeros: each component of y has a column
    double *gain;     // increment of (q, r, p, w)
    double *loss;     // symmetric: y' loss y is lost in the structure
    double *contact;  // likewise: in the contact
    double *input[2]; // -(value input[0] + slope input[1]) . y is the base's work on the structure,
                      // and on the damper in contact
    double *block;    // NULL where there is none
} Transition;

// Of the sample interval and `levels` - 1 times its half, except those too short for the series
// (block is NULL then). `contact`: the damper, in contact now, or NULL. Freed by transition_clear,
// also after a failure.
Status transition_make(Transition *transitions, size_t levels, const ModalState *state,
                       const DamperState *contact, Problem *problem);
// Likewise of the sample interval and one mode in flight, which damping does not couple to others.
Status transition_make_mode(Transition *transition, const ModalState *state, size_t mode,
                            Problem *problem);
void transition_clear(Transition *transition);

// The increment of y over `length` [s] with r and w of all dampers and a base that is linear in
// time: `increment` has (2 (modes + dampers) + 2)^2 values, row after row.
Status transition_increment(const ModalState *state, double length, double *increment,
                            Problem *problem);

// y' form y; `scratch` has `rows` values.
double transition_form(const Transition *transition, const SimdKernels *lanes, const double *form,
                       const double *y, double *scratch);

#endif
