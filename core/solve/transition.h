// Whole sample intervals by one dense transition for all modes: of flight where damping couples
// them, or of one damper's contact; and the work along it as quadratic forms. Not the step
// itself nor its proof.
#ifndef CORE_SOLVE_TRANSITION_H
#define CORE_SOLVE_TRANSITION_H

#include "core/solve/modal_state.h"
#include "core/solve/simd_kernels.h"

// Over y = (q, r, p, w, value, slope), the last two being the base's at the start; r and w are
// those of the damper in contact, and are missing in flight.
typedef struct Transition {
    size_t freedoms;  // modes, and 1 in contact
    size_t size;      // 2 freedoms + 2
    size_t rows;      // of the matrices, filled up with zeros: each component of y has a column
    double *gain;     // what (q, r, p, w) gains
    double *loss;     // symmetric: y' loss y is lost in the structure
    double *contact;  // likewise: in the contact; NULL in flight
    double *input[2]; // -(value input[0] + slope input[1]) . y is the base's work on the structure,
                      // and on the damper in contact
    double *block;    // NULL where there is none
} Transition;

// For the sample interval and `levels` - 1 times its half, where these are not too short for it to
// be made by doubling (block is NULL then). `contact`: the damper, in contact now, or NULL. Freed
// by transition_clear, also after a failure.
Status transition_make(Transition *dense, size_t levels, const ModalState *state,
                       const DamperState *contact, Problem *problem);
void transition_clear(Transition *dense);

// y' form y; `scratch` holds `rows` values.
double transition_form(const Transition *dense, const SimdKernels *lanes, const double *form,
                       const double *y, double *scratch);

#endif
