// What is sure about a contact without looking everywhere:
// - where the buffer is slow beside the sample interval, p cannot get back to 0 between two samples
//   against the bound of its curvature;
// - elsewhere, with q = e^(c t / 2) p and s the structure's push, q'' + w^2 q = e^(c t / 2) s, so
//   that by Sturm's comparison q stays positive up to pi - 2 S / (w p'(0)), S the most by which the
//   right side pulls; from there on p falls.
// Not the motion itself. Used by exact_press.c.
#ifndef CORE_SOLVE_PRESS_BOUNDS_H
#define CORE_SOLVE_PRESS_BOUNDS_H

#include "core/solve/press.h"

// Until when the contact surely lasts by comparison with the isolated one.
INLINE double press_surely_lasts(const Press *press) {
    const Exact *exact = press->exact;
    const Pulse *pulse = press->pulse;
    const Motion *m = &exact->touching[exact->side];
    const double T = 1.3 * pulse->time, w = press->speed;
    // How fast the push can change: the structure's speed and acceleration, with room to spare.
    const double force = 2 * (pulse->contact_omega + pulse->damping) * w;
    const double omega = exact->lanes.omega;
    const double own =
        (m->damping + omega) * (fabs(exact->state.v) + omega * fabs(exact->state.x) + w);
    const double bend = 2 * (own + exact->stretch.base_max) + m->share * force;
    const double rate = m->omega2 * (fabs(exact->state.v) + bend * T) + m->damping * bend;
    const double push = press->sign * exact_push(exact) - rate * T;
    const double pull = push < 0 ? -push * pulse->growth : 0;
    return pulse->time - 2 * pull / (w * pulse->contact_omega * pulse->contact_omega);
}

// Surely no p = 0 between two samples, where both are inside.
INLINE bool press_stays_inside(const Press *press, double from, double w, double to, double w_to,
                               double length) {
    const double bend = press_bend(press);
    if (from == 0)
        return w > bend * length / 2;
    const double least = from < to ? from : to;
    return least > bend * length * length / 8 || fabs(w) > bend * length ||
           fabs(w_to) > bend * length;
}

// Whether p falls all the way to its zero: from `before` it, where w is `speed`.
INLINE bool press_falls(const Press *press, const State *end, double before, bool is_slow) {
    const Pulse *p = press->pulse;
    const double w = -press->sign * end->w;
    if (!(w > 0))
        return false;
    if (is_slow)
        return w > press_bend(press) * before / 2; // backwards from there p rises
    if (before <= 0)
        return true;
    const Motion *m = &press->exact->flying;
    const double angle = p->fast * before;
    const double push = fabs(m->damping * end->v + m->omega2 * end->x);
    // angle (3 / 2 (c w + push) / (omega w) + 2 angle) < 0.66
    return angle * (1.5 * (p->damping * w + push) + 2 * angle * p->fast * w) < 0.66 * p->fast * w;
}

// Surely inside over a long stretch, because the slow part outweighs the fast.
INLINE bool press_is_pressed(const Press *press, const Four *end, double length) {
    const Pulse *p = press->pulse;
    const Four d = press->d;
    double last, slope;
    press_base(press, length, &last, &slope);
    const double *a = p->see[PULSE_A], *s = p->see[PULSE_S];
    const double fast = fabs(d[2]) + fabs(d[3]), slow = fabs(d[0]) + fabs(d[1]);
    const double from = press->sign * (d[0] + a[PULSE_R] * press->a + s[PULSE_R] * press->slope);
    const double to = press->sign * ((*end)[0] + a[PULSE_R] * last + s[PULSE_R] * slope);
    const double bend = p->size2[0] * slow + p->sway * press->exact->stretch.base_max;
    return (from < to ? from : to) > fast + bend * length * length / 8;
}

// Whether the force has no peak within a long stretch that has not been seen: it stays below the
// last one, or the fast part has died and what is left only rises or only falls.
INLINE bool press_is_known(const Press *press, const Four *end, double length) {
    const Pulse *p = press->pulse;
    const Four d = press->d;
    double last, slope;
    press_base(press, length, &last, &slope);
    double rows[4];
    for (int i = 0; i < 4; i++)
        rows[i] = fabs(p->see[i][PULSE_N]);
    const double slow = (rows[0] + rows[1]) * (fabs(d[0]) + fabs(d[1]));
    const double fast = (rows[2] + rows[3]) * (fabs(d[2]) + fabs(d[3]));
    Four from, to;
    pulse_see(p, PULSE_N, &d, press->a, press->slope, &from);
    pulse_see(p, PULSE_N, end, last, slope, &to);
    const double one = fabs(from[0]), other = fabs(to[0]);
    const double bend = p->size2[0] * slow + p->n_sway * press->exact->stretch.base_max;
    const double most = (one > other ? one : other) + 2 * fast + bend * length * length / 8;
    if (exact_effective_mass(press->exact) * most <=
        impact_log_least_force(&press->exact->ledger, &press->exact->row))
        return true;
    return fast <= 1e-13 * one && from[1] * to[1] > 0;
}

#endif
