// An arc: the motion over a stretch in which the contact state does not change and the base is
// linear or a sine, as Taylor polynomials that are exact to rounding. Not a time step: it has no
// error to trade.
#ifndef CORE_SOLVE_ARC_H
#define CORE_SOLVE_ARC_H

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
// and while resting on a stop x'' = -a_g - (1 - share) s, r'' = 0.
typedef struct Motion {
    double omega2;          // K / M [1/s^2]
    double damping;         // C / M [1/s]
    double share;           // m / (M + m) = m_e / M [-]
    double contact_omega2;  // k / m_e [1/s^2], 0 in flight
    double contact_damping; // c / m_e [1/s]
    bool is_resting;
    double rate; // no eigenvalue of the system, without the base, is larger [1/s]
} Motion;

// The base over a stretch: a_g(t) = value + slope t, or, with omega > 0, value cos(omega t) + slope
// sin(omega t).
typedef struct Slice {
    double value; // [m/s^2]
    double slope; // [m/s^3], or [m/s^2]
    double omega; // [rad/s]
} Slice;

// Coefficients in s = t / length, 0 <= s <= 1.
typedef struct Arc {
    double length; // [s]
    double rho;    // length * rate, the base's included, at most 1
    size_t degree; // of x and r; push and force have one less
    double x[POLYNOMIAL_DEGREE_MAX + 1], r[POLYNOMIAL_DEGREE_MAX + 1];
    double push[POLYNOMIAL_DEGREE_MAX + 1];  // s length^2
    double force[POLYNOMIAL_DEGREE_MAX + 1]; // n length^2; while resting, the constraint's
    double base[POLYNOMIAL_DEGREE_MAX + 1];  // a_g
} Arc;

// Integrals over an arc.
typedef struct ArcIntegrals {
    double vv, ww; // of v^2, w^2 [m^2/s]
    double av, aw; // of a_g v, a_g w [m^2/s^2]
    double a;      // of a_g [m/s]
} ArcIntegrals;

// length * motion->rate and length * slice->omega must be at most 1.
void arc_make(Arc *arc, const Motion *motion, const State *start, const Slice *slice,
              double length);

// Keeps only the part up to s.
void arc_cut(Arc *arc, double s);

State arc_end(const Arc *arc);
ArcIntegrals arc_integrals(const Arc *arc);

// The integral of n over the arc [m/s].
double arc_impulse(const Arc *arc);

// Largest |n| over the arc [m/s^2] if it is above `least`, else `least`; *s is where, or untouched.
double arc_peak_force(const Arc *arc, double least, double *s);

// The state somewhere on it.
State arc_at(const Arc *arc, double s);

double slice_at(const Slice *slice, double time);

// What other polynomials in s = t / length need as well: the degree that leaves only rounding where
// coefficients fall like rho^k / k! (rho at most 1), a_g's coefficients, the integral over [0, 1],
// and the largest |value| if it is above `least`, else `least`; *s is where, or untouched.
size_t arc_degree(double rho);
void arc_base_series(double *base, size_t degree, const Slice *slice, double length);
double arc_integral(const double *c, size_t degree);
double arc_largest(const double *c, size_t degree, double least, double *s);

// Gauss-Legendre quadrature on [0, 1] that is exact but for rounding for products of two solutions.
typedef struct Quadrature {
    size_t count;
    double node[8], weight[8];
} Quadrature;
enum { ARC_RULES = 3 };
extern const Quadrature arc_rules[ARC_RULES]; // with more and more points
const Quadrature *arc_quadrature(double rho); // one of them

#endif
