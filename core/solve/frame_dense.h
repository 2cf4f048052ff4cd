// Whole sample intervals of flight where damping couples the modes: one dense transition for all of
// them, and the work along it as quadratic forms. Not the step itself nor its proof
// (frame_flight.c, which alone uses this).
#ifndef CORE_SOLVE_FRAME_DENSE_H
#define CORE_SOLVE_FRAME_DENSE_H

#include "core/solve/frame_state.h"

// Over y = (q, p, value, slope), the last two being the base's at the start.
typedef struct FrameDense {
    size_t size;      // 2 storeys + 2
    double *gain;     // what (q, p) gains: for each component of y a column of 2 storeys
    double *loss;     // size x size, symmetric: y' loss y is lost in the structure
    double *input[2]; // -(value input[0] + slope input[1]) . y is the base's work on the structure
    double *block;    // NULL where there is none
} FrameDense;

// None where making it would cost more than it saves. Freed by frame_dense_clear, also after a
// failure.
Status frame_dense_make(FrameDense *dense, const Frame *frame, Problem *problem);
void frame_dense_clear(FrameDense *dense);

#endif
