// Whole sample intervals by one dense transition for all modes: of flight where damping couples
// them, or of one damper's contact; and the work along it as quadratic forms. Not the step itself
// nor its proof. Used by frame_flight.c and frame_press.c.
#ifndef CORE_SOLVE_FRAME_DENSE_H
#define CORE_SOLVE_FRAME_DENSE_H

#include "core/solve/frame_state.h"

// Over y = (q, r, p, w, value, slope), the last two being the base's at the start; r and w are
// those of the damper in contact, and are missing in flight.
typedef struct FrameDense {
    size_t freedoms;  // modes, and 1 in contact
    size_t size;      // 2 freedoms + 2
    double *gain;     // what (q, r, p, w) gains: for each component of y a column of 2 freedoms
    double *loss;     // size x size, symmetric: y' loss y is lost in the structure
    double *contact;  // likewise: in the contact; NULL in flight
    double *input[2]; // -(value input[0] + slope input[1]) . y is the base's work on the structure,
                      // and on the damper in contact
    double *block;    // NULL where there is none
} FrameDense;

// For the sample interval and `levels` - 1 times its half, where these are not too short for it to
// be made by doubling (block is NULL then). `contact`: the damper, in contact now, or NULL. Freed
// by frame_dense_clear, also after a failure.
Status frame_dense_make(FrameDense *dense, size_t levels, const Frame *frame,
                        const FrameDamper *contact, Problem *problem);
void frame_dense_clear(FrameDense *dense);

// out += matrix y, column after column.
void frame_dense_add(const double *matrix, size_t rows, const double *y, size_t size, double *out);
// y' form y.
double frame_dense_form(const double *form, const double *y, size_t size);

#endif
