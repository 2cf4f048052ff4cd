// Whole sample intervals of one damper's contact by one step each, where the contact is so stiff
// that arcs would be many; with a proof that it lasts. Not for contacts whose parameters depend on
// the impact, nor for several at once: those go by arcs. Used by frame.c.
#ifndef CORE_SOLVE_FRAME_PRESS_H
#define CORE_SOLVE_FRAME_PRESS_H

#include "core/solve/frame_dense.h"
#include "core/solve/frame_flight.h"
#include "core/solve/frame_state.h"

// Of one stop, made once contacts with it have lasted for long enough.
typedef struct FramePressStop {
    double intervals; // that arcs have taken, in multiplications
    bool is_given_up; // no memory for it
    FrameDense dense;
    double *damped, *bent; // D shape, W^2 shape
} FramePressStop;

typedef struct FramePress {
    FramePressStop *stops; // damper after damper, by Side
    size_t count;
    double *start, *gained, *end, *elastic; // scratch
    double *block;
} FramePress;

// Freed by frame_press_clear, also after a failure.
Status frame_press_make(FramePress *press, const Frame *frame, Problem *problem);
void frame_press_clear(FramePress *press);

// Moves the state over the interval if surely no contact begins or ends meanwhile, and says what it
// adds up to, if `work` is not NULL; the damper's row is written. False: it must go by arcs, and
// nothing has changed.
bool frame_press_step(FramePress *press, Frame *frame, const FrameFlight *flight,
                      const Slice *slice, FrameWork *work);

#endif
