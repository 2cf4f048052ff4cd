// Long contact on a stiff stop: steps far longer than the contact's own period, with a proof that
// it does not end. Arcs would need several steps for every contact time; a mass that rides on a
// stop for 1e8 of them needs these. Used by the exact solver.
#ifndef CORE_SOLVE_EXACT_HOLD_H
#define CORE_SOLVE_EXACT_HOLD_H

#include "core/solve/arc.h"

enum { HOLD_LEVELS = 64, HOLD_FORM = 21 };

// The transition over `length`, columns (x, v, r, w, value, slope); quadratic forms as upper
// triangles by rows.
typedef struct HoldLevel {
    double length;
    double state[4][6];
    double base[6], force[6]; // integrals of a_g and n
    double vv[HOLD_FORM], ww[HOLD_FORM], av[HOLD_FORM], aw[HOLD_FORM];
} HoldLevel;

// With Y = x + share r the contact (r, w) is fast and (Y, Y') slow; F = (r, w), S = (Y, Y') are
// decoupled by
//   G = F - L S,  Z = S - H G.
typedef struct Hold {
    bool is_usable;
    Motion motion;
    double L[2][2], H[2][2];
    double slow[2][2]; // Z' = slow Z + ...
    double quasi[2];   // G follows -quasi a_g(t) - quasi_rate a_g'(t)
    double quasi_rate[2];
    double fast_omega;  // of the norm sqrt(g1^2 + (g2 / fast_omega)^2) [rad/s]
    double fast_growth; // that norm grows by no more than this [1/s]
    double slow_growth; // Omega |Z1| + |Z2| grows by no more than this [1/s]
    size_t count;       // levels: the sample interval, its half, its quarter ...
    HoldLevel levels[HOLD_LEVELS];
} Hold;

void hold_make(Hold *hold, const Motion *motion, double base_omega, double interval);

// The longest level that fits into `length` and in which contact on the side of `sign` surely lasts
// and |n| surely has no inner maximum above `peak` [m/s^2]; NULL if arcs must go on. *end is the
// state after it.
const HoldLevel *hold_step(const Hold *hold, const State *start, const Slice *slice, double length,
                           double sign, double peak, State *end);

// What that step adds up to; `impulse` is the integral of n.
ArcIntegrals hold_integrals(const HoldLevel *level, const State *start, const Slice *slice,
                            double *impulse);

// n at a state [m/s^2].
static inline double hold_force(const Motion *motion, const State *state) {
    return motion->contact_damping * state->w + motion->contact_omega2 * state->r;
}

#endif
