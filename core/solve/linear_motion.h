// The linear motion of a structure and its free mass between events, and what Taylor polynomials of
// such motions need.
#ifndef CORE_SOLVE_LINEAR_MOTION_H
#define CORE_SOLVE_LINEAR_MOTION_H

#include <stdbool.h>
#include <stddef.h>

#include "core/math/polynomial_root.h"

// Structure and free mass. r is the free mass's displacement relative to the structure, counted
// from whatever the solver chose as its origin (a stop after contact with it, so that small
// penetrations and bounces keep all digits).
typedef struct State {
    double x, v; // displacement and velocity of the structure relative to the base [m], [m/s]
    double r, w; // relative displacement and velocity of the free mass [m], [m/s]
} State;

// The linear system of one contact state, divided by the masses.
//   x'' = -a_g - s + share n,  r'' = s - n,  s = damping x' + omega2 x,  n = contact_damping r' +
//   contact_omega2 r
typedef struct Motion {
    double omega2;          // K / M [1/s^2]
    double damping;         // C / M [1/s]
    double share;           // m / (M + m) = m_e / M [-]
    double contact_omega2;  // k / m_e [1/s^2], 0 in flight
    double contact_damping; // c / m_e [1/s]
    double rate;            // no eigenvalue of the system, without the base, is larger [1/s]
} Motion;

static inline bool motion_is_same(const Motion *a, const Motion *b) {
    return a->omega2 == b->omega2 && a->damping == b->damping && a->share == b->share &&
           a->contact_omega2 == b->contact_omega2 && a->contact_damping == b->contact_damping;
}

// The base over a stretch: a_g(t) = value + slope t, or, with omega > 0, value cos(omega t) + slope
// sin(omega t).
typedef struct Slice {
    double value; // [m/s^2]
    double slope; // [m/s^3], or [m/s^2]
    double omega; // [rad/s]
} Slice;

double slice_at(const Slice *slice, double time);

// What other polynomials in s = t / length need as well: the degree that leaves only rounding where
// coefficients fall like rho^k / k! (rho at most 1), a_g's coefficients, the integral over [0, 1],
// and the largest |value| if it is above `least`, else `least`; *s is where, or untouched.
size_t linear_motion_degree(double rho);
void linear_motion_base_series(double *base, size_t degree, const Slice *slice, double length);
double linear_motion_integral(const double *c, size_t degree);
double linear_motion_largest(const double *c, size_t degree, double least, double *s);

// Gauss-Legendre quadrature on [0, 1] that is exact but for rounding for products of two solutions.
typedef struct Quadrature {
    size_t count;
    double node[8], weight[8];
} Quadrature;
enum { LINEAR_MOTION_RULES = 3 };
extern const Quadrature linear_motion_rules[LINEAR_MOTION_RULES]; // with more and more points
const Quadrature *linear_motion_quadrature(double rho);           // one of them

#endif
