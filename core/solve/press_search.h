// The instants of a contact that must be found: its release and its largest force. By series about
// a guess, which are right to rounding where that is near. Used by exact_press.c.
#ifndef CORE_SOLVE_PRESS_SEARCH_H
#define CORE_SOLVE_PRESS_SEARCH_H

#include "core/solve/exact_events.h"
#include "core/solve/press.h"

enum { PRESS_STEPS = 12 };
// Angles of the fast oscillation: the square of the first is below rounding; what the second leaves
// of a largest force's fifth power is.
#define PRESS_HERE 1e-8
#define PRESS_NEAR 4e-3

// The amplitudes at t, from those a step before where that is a short one.
INLINE void press_go_on(const Press *press, double t, double step, Four *d) {
    if (fabs(step) * press->pulse->fast <= PULSE_NEAR)
        pulse_nudge(press->pulse, step, d);
    else
        pulse_go(press->pulse, &press->d, t, d);
}

// p = 0 from a guess on; false where the search leaves [0, most]. Where it is found, the amplitudes
// and the state there.
INLINE bool press_find_release(const Press *press, double guess, double most, double *time,
                               Four *end, State *state) {
    const Pulse *p = press->pulse;
    const Motion *m = &press->exact->flying;
    double t = guess, step = INFINITY;
    *end = press->d;
    for (int i = 0; i < PRESS_STEPS; i++) {
        if (!(t >= 0 && t <= most))
            return false;
        press_go_on(press, t, step, end);
        double a, slope;
        press_base(press, t, &a, &slope);
        Four at, force, bends;
        pulse_see(p, PULSE_X, end, a, slope, &at);
        pulse_see(p, PULSE_N, end, a, slope, &force);
        pulse_see(p, PULSE_N3, end, a, slope, &bends);
        // r + w (t + k2 t^2 + k3 t^3 + k4 t^4) = 0, reversed.
        const double per_w = 1 / at[3], y = -at[2] * per_w, k2 = force[3] * per_w * (1.0 / 2);
        const double k3 = bends[2] * per_w * (1.0 / 6), k4 = bends[3] * per_w * (1.0 / 24);
        const double y2 = y * y;
        step = (y - k2 * y2) + y2 * (y * (2 * k2 * k2 - k3) - y2 * (5 * k2 * (k2 * k2 - k3) + k4));
        t += step;
        if (fabs(step) * p->fast <= PRESS_HERE) {
            const double push = m->damping * at[1] + m->omega2 * at[0];
            *end += step *
                    (FOUR(p->sigma) * *end + FOUR(p->omega) * FOUR(pulse_signs) *
                                                 __builtin_shufflevector(*end, *end, 1, 0, 3, 2));
            *state = (State){at[0] + step * at[1], at[1] + step * (m->share * force[0] - push - a),
                             0, at[3] + step * force[3]};
            *time = t;
            return t > 0;
        }
    }
    return false;
}

// The largest force within a stretch in which its slope turns from rising to falling; false if it
// cannot be told.
INLINE bool press_take_largest(Press *press, double guess, double length) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const Motion *m = &exact->flying;
    double low = 0, high = length, t = guess, step = INFINITY;
    Four d = press->d;
    for (int i = 0; i < PRESS_STEPS; i++) {
        if (!(t > low && t < high)) {
            t = (low + high) / 2;
            step = INFINITY;
        }
        if (i == 0 && t == p->peak_time)
            pulse_multiply(p->peak, &press->d, &d);
        else
            press_go_on(press, t, step, &d);
        double a, slope;
        press_base(press, t, &a, &slope);
        Four at, force, bends;
        pulse_see(p, PULSE_X, &d, a, slope, &at);
        pulse_see(p, PULSE_N, &d, a, slope, &force);
        pulse_see(p, PULSE_N3, &d, a, slope, &bends);
        if (press->sign * force[1] > 0)
            low = t;
        else
            high = t;
        // The zero of n1 + n2 (t + k2 t^2 + k3 t^3).
        const double per_bend = 1 / force[2], y = -force[1] * per_bend;
        const double k2 = bends[0] * per_bend * (1.0 / 2), k3 = bends[1] * per_bend * (1.0 / 6);
        step = y - y * y * (k2 - y * (2 * k2 * k2 - k3));
        if (fabs(step) * p->fast <= PRESS_NEAR && press->sign * force[2] < 0) {
            const double half = step / 2, third = step / 3, quarter = step / 4;
            const double n =
                force[0] +
                step * (force[1] + half * (force[2] + third * (bends[0] + quarter * bends[1])));
            const double push = m->damping * at[1] + m->omega2 * at[0];
            const double v1 = m->share * force[0] - push - a;
            const double push1 = m->damping * v1 + m->omega2 * at[1];
            const double a1 = p->base_omega > 0 ? p->base_omega * slope : slope;
            const double v2 = m->share * force[1] - push1 - a1;
            const double push2 = m->damping * v2 + m->omega2 * v1;
            const double v3 = m->share * force[2] - push2;
            const double push3 = m->damping * v3 + m->omega2 * v2;
            const double moved = push + step * (push1 + half * (push2 + third * push3));
            ledger_force(&exact->ledger, &exact->row, exact_effective_mass(exact) * fabs(n));
            ledger_acceleration(&exact->ledger, m->share * n - moved);
            return true;
        }
        t += step;
    }
    return false;
}

#endif
