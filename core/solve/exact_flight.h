// Whole sample intervals of free flight by one matrix each, made once per run: exact for a still
// base, one linear over the interval, and a sine. Not for contacts and not for parts of an
// interval: those are arcs. Used by the exact solver.
#ifndef CORE_SOLVE_EXACT_FLIGHT_H
#define CORE_SOLVE_EXACT_FLIGHT_H

#include "core/solve/arc.h"

typedef struct ExactFlight {
    double length;     // of the interval [s]
    double x[4], v[4]; // rows of the transition over (x, v, value, slope)
    double r[4], w[4]; // what these add to r + w length, and to w
    double a[2];       // integral of a_g over (value, slope)
    double vv[10],
        av[10];       // quadratic forms of the integrals of v^2 and a_g v, upper triangle by rows
    double curvature; // |r''| is at most curvature * (|v| + omega |x| + length max|a_g|)
    double omega;     // sqrt(K / M) [rad/s]
} ExactFlight;

// `omega` is the base's (0: linear).
void exact_flight_make(ExactFlight *flight, const Motion *motion, double base_omega, double length);

static inline double flight_form(const double *form, const double *y) {
    return y[0] * (form[0] * y[0] + form[1] * y[1] + form[2] * y[2] + form[3] * y[3]) +
           y[1] * (form[4] * y[1] + form[5] * y[2] + form[6] * y[3]) +
           y[2] * (form[7] * y[2] + form[8] * y[3]) + y[3] * form[9] * y[3];
}

// The state at the interval's end. `integrals` gets all but ww; aw is for the free mass: of a_g (v
// + w), minus av.
static inline State exact_flight_step(const ExactFlight *flight, const State *start,
                                      const Slice *slice, ArcIntegrals *integrals) {
    const double y[4] = {start->x, start->v, slice->value, slice->slope};
    const State end = {
        start->x + (flight->x[0] * y[0] + flight->x[1] * y[1] +
                    (flight->x[2] * y[2] + flight->x[3] * y[3])),
        start->v + (flight->v[0] * y[0] + flight->v[1] * y[1] +
                    (flight->v[2] * y[2] + flight->v[3] * y[3])),
        start->r + (flight->length * start->w + (flight->r[0] * y[0] + flight->r[1] * y[1] +
                                                 (flight->r[2] * y[2] + flight->r[3] * y[3]))),
        start->w + (flight->w[0] * y[0] + flight->w[1] * y[1] +
                    (flight->w[2] * y[2] + flight->w[3] * y[3]))};
    integrals->a = flight->a[0] * y[2] + flight->a[1] * y[3];
    integrals->vv = flight_form(flight->vv, y);
    integrals->av = flight_form(flight->av, y);
    // The free mass feels the base alone: its absolute velocity stays, so the work is a matter of
    // its own.
    integrals->aw = integrals->a * (start->v + start->w - integrals->a / 2) - integrals->av;
    return end;
}

// The most |r''| can be over the interval [m/s^2].
static inline double exact_flight_curvature(const ExactFlight *flight, const State *start,
                                            double base_max) {
    const double speed = (start->v < 0 ? -start->v : start->v) +
                         flight->omega * (start->x < 0 ? -start->x : start->x) +
                         flight->length * base_max;
    return flight->curvature * speed;
}

#endif
