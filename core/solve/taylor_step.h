// An arc of the general engine: all modes and dampers over a stretch in which no contact state
// changes and the base is linear or a sine, as Taylor polynomials that are exact to rounding. Not
// for whole intervals of flight: frame_flight.h. Used by frame.c and frame_events.c.
#ifndef CORE_SOLVE_TAYLOR_STEP_H
#define CORE_SOLVE_TAYLOR_STEP_H

#include "core/solve/modal_state.h"

// Coefficients in s = t / length, 0 <= s <= 1.
typedef struct FrameArc {
    double length;                // [s]
    double rho;                   // length * rate, the base's included, at most 1
    size_t degree;                // of q and r; forces have one less
    double base[ROOT_DEGREE + 1]; // a_g
    size_t base_degree;           // no coefficient of a_g beyond it
    double *q;                    // order after order, `padded` values each
    double *r, *force;            // damper after damper, ROOT_DEGREE + 1 each; force is N
    double *work;                 // modes x nodes of a quadrature
    double *slopes;               // of s^k at the nodes of all rules
    double *block;
} FrameArc;

// Room for the arcs of one run; freed by frame_arc_clear, also after a failure.
Status frame_arc_room(FrameArc *arc, const Frame *frame, Problem *problem);
void frame_arc_clear(FrameArc *arc);

// From the present state; length * frame_rate() and length * slice->omega must be at most 1.
void frame_arc_make(FrameArc *arc, const Frame *frame, const Slice *slice, double length);

// Keeps only the part up to s.
void frame_arc_cut(FrameArc *arc, const Frame *frame, double s);

// The state at s (0 to 1), into q and p and the dampers' r and w; not of those that rest.
void frame_arc_state(const FrameArc *arc, Frame *frame, double s);

// What an arc adds up to.
typedef struct FrameWork {
    double input;   // the base's work [J]
    double damping; // lost in the structure [J]
    double ground;  // integral of a_g [m/s]
} FrameWork;
FrameWork frame_arc_work(const FrameArc *arc, const Frame *frame);

// A damper's part: integral of N [N s] and work lost in its contact [J].
void frame_arc_contact(const FrameArc *arc, const Frame *frame, size_t damper, double *impulse,
                       double *lost);

static inline const double *frame_arc_r(const FrameArc *arc, size_t damper) {
    return arc->r + damper * (ROOT_DEGREE + 1);
}
static inline const double *frame_arc_force(const FrameArc *arc, size_t damper) {
    return arc->force + damper * (ROOT_DEGREE + 1);
}

#endif
