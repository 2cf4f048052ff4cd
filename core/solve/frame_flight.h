// Whole sample intervals of flight of all masses by one step each, made once per run: exact for a
// still base, one linear over the interval, and a sine; with a bound on how far each gap can bend
// meanwhile. Not for contacts and not for parts of an interval: those are arcs. Used by frame.c.
#ifndef CORE_SOLVE_FRAME_FLIGHT_H
#define CORE_SOLVE_FRAME_FLIGHT_H

#include "core/solve/frame_arc.h"
#include "core/solve/frame_dense.h"
#include "core/solve/frame_state.h"

typedef struct FrameFlight {
    double length;    // of the interval [s]; 0: there are no such steps
    FrameDense dense; // in place of q, p, loss and input where damping couples the modes
    // What each mode gains: rows over (q, p, value, slope), mode after mode within each entry.
    double *q[4], *p[4];
    // Work: loss[0..2] over (q q, q p, p p), loss[3..6] over (q value, q slope, p value, p slope),
    // input[0..3] over (value q, value p, slope q, slope p).
    double *loss[7], *input[4];
    double loss_base[3], input_base[3]; // over (value^2, value slope, slope^2), all modes
    double ground[2], fall[2];          // integral of a_g over (value, slope), and its integral
    double *gain_q, *gain_p;            // of the present step
    double *start;                      // (q, p, value, slope) of the present step
    double *block;
} FrameFlight;

// Freed by frame_flight_clear, also after a failure.
Status frame_flight_make(FrameFlight *flight, const Frame *frame, Problem *problem);
void frame_flight_clear(FrameFlight *flight);

// Moves the state over the interval, if surely no stop is reached meanwhile, and says what it adds
// up to, if `work` is not NULL. False: it must go by arcs, and nothing has changed.
bool frame_flight_step(FrameFlight *flight, Frame *frame, const Slice *slice, FrameWork *work);

// Whether r stays between the stops on its way to r + gained, bent by no more than `bend` [m/s^2].
bool frame_flight_is_clear(const FrameDamper *damper, double gained, double bend, double length);
// Over (value, slope): the integral of a_g over `length`, and its integral; `omega` is the base's
// (0: linear).
void frame_flight_ground(double omega, double length, double ground[2], double fall[2]);
// |a_g| is not larger [m/s^2].
double frame_flight_shaken(const Slice *slice, double length);

#endif
