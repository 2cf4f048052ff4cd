// The samples of one stretch of the general engine's motion, one after the other, before they are
// written down. Not how they come about: frame_flight.h fills whole stretches, frame_engine.c the
// single samples behind contacts. Used by core/solve/frame*.c.
#ifndef CORE_SOLVE_FRAME_TRAIL_H
#define CORE_SOLVE_FRAME_TRAIL_H

#include "core/solve/modal_state.h"

enum { TRAIL_MAX = 16, TRAIL_ROWS = TRAIL_MAX + 1 };

// Row 0 is where the stretch begins, row k what is k samples on; all modes in each row.
typedef struct FrameTrail {
    size_t padded; // values of a row
    double *q, *p;
    double *moved, *sped;   // what q and p have gained since row 0
    double *elastic;        // D p + W^2 q
    double *r;              // of the dampers, TRAIL_ROWS each, from the present origins
    double *z;              // likewise, their velocities relative to the base
    double *a, *b, *ground; // of each interval: a_g, as a Slice, and its integral
    double *block;
} FrameTrail;

// Freed by frame_trail_clear, also after a failure.
Status frame_trail_make(FrameTrail *trail, const Frame *frame, Problem *problem);
void frame_trail_clear(FrameTrail *trail);

// The elastic forces of rows 1 to `count`, the last of them being the present sample.
void frame_trail_feel(FrameTrail *trail, const Frame *frame, size_t count);

// Row 1 becomes the present state, after frame_feel.
void frame_trail_take(FrameTrail *trail, const Frame *frame, double ground);

#endif
