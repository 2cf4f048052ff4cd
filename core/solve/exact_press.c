// Over each stretch the contact surely lasts, because
// - where the buffer is slow beside the sample interval, p cannot get back to 0 between two samples
//   against the bound of its curvature;
// - elsewhere, with q = e^(c t / 2) p and s the structure's push, q'' + w^2 q = e^(c t / 2) s, so
// that
//   by Sturm's comparison q stays positive up to pi - 2 S / (w p'(0)), S the most by which the
//   right side pulls; from there on p falls.
#include "core/solve/exact_press.h"

#include <math.h>

#include "core/solve/exact_events.h"
#include "core/solve/exact_ride.h"
#include "core/solve/exact_stride.h"

// How far the fast oscillation turns in one step of a walk, and steps to an interval: stiffer
// buffers are not for this.
static const double STEP = 0.6;
static const double LONG_STEP = 2;
static const double STEPS_MOST = 1024;

static double larger(double a, double b) {
    return a > b ? a : b;
}

static void start(Press *press, Exact *exact) {
    const Pulse *pulse = &exact->pulses[exact->side];
    const State *y = &exact->state;
    Slice slice;
    (void)base_cursor_slice(&exact->base, exact->sample, exact->offset, &slice);
    *press = (Press){.exact = exact,
                     .pulse = pulse,
                     .sign = exact_sign(exact->side),
                     .a = slice.value,
                     .slope = slice.slope,
                     .speed = fabs(y->w),
                     .absolute = y->v + y->w};
    for (int i = 0; i < 4; i++) {
        const double *row = pulse->into[i];
        press->d[i] = ((row[0] * y->x + row[1] * y->v) + row[3] * y->w) +
                      (row[4] * slice.value + row[5] * slice.slope);
    }
    press->vv = -pulse_form(&pulse->vv, press->d);
    press->ww = -pulse_form(&pulse->ww, press->d);
}

// Until when the contact surely lasts by comparison with the isolated one.
static double surely_lasts(const Press *press) {
    const Exact *exact = press->exact;
    const Pulse *pulse = press->pulse;
    const Motion *m = &exact->touching[exact->side];
    const double T = 1.3 * pulse->time, w = press->speed;
    // How fast the push can change: the structure's speed and acceleration, with room to spare.
    const double force = 2 * (pulse->contact_omega + pulse->damping) * w;
    const double omega = exact->lanes.omega;
    const double own =
        (m->damping + omega) * (fabs(exact->state.v) + omega * fabs(exact->state.x) + w);
    const double bend = 2 * (own + exact->stretch.base_most) + m->share * force;
    const double rate = m->omega2 * (fabs(exact->state.v) + bend * T) + m->damping * bend;
    const double push = press->sign * exact_push(exact) - rate * T;
    const double pull = push < 0 ? -push * pulse->growth : 0;
    return pulse->time - 2 * pull / (w * pulse->contact_omega * pulse->contact_omega);
}

static State see(const Press *press, const double d[4], double a) {
    const Pulse *p = press->pulse;
    const double slope = press->slope;
    return (State){pulse_see(&p->x, d, a, slope), pulse_see(&p->v, d, a, slope),
                   pulse_see(&p->r, d, a, slope), pulse_see(&p->w, d, a, slope)};
}

enum { SEARCH_STEPS = 12, RIDE_AGAIN = 8 };
static const double NEAR = 1e-5; // an angle whose cube is below rounding

// The amplitudes at t, from those a step before where that is a short one.
static inline void go_on(const Pulse *pulse, const double from[4], double t, double step,
                         double d[4]) {
    double turn[4];
    if (fabs(step) * pulse->rate <= PULSE_NEAR) {
        pulse_nudge(pulse, step, d);
    } else {
        pulse_turn(pulse, t, turn);
        pulse_multiply(turn, from, d);
    }
}

// p = 0 within `length` of the stretch's beginning, from a guess; false where the search leaves it.
// *time may lie beyond `length`: then p has no zero within it.
static bool find_release(const Press *press, double guess, double most, double *time,
                         double end[4]) {
    const Pulse *p = press->pulse;
    double t = guess, step = INFINITY;
    for (int i = 0; i < SEARCH_STEPS; i++) {
        if (!(t >= 0 && t <= most))
            return false;
        go_on(p, press->d, t, step, end);
        const double a = press->a + press->slope * t;
        const double r = pulse_see(&p->r, end, a, press->slope);
        const double w = pulse_see(&p->w, end, a, press->slope);
        const double bend = pulse_dot(p->r_bend.d, end);
        step = -2 * r * w / (2 * w * w - r * bend);
        t += step;
        if (fabs(step) * p->omega[1] <= NEAR) {
            go_on(p, press->d, t, step, end);
            *time = t;
            return t > 0;
        }
    }
    return false;
}

// The largest force within a stretch in which its slope turns from rising to falling.
bool press_find_peak(Press *press, double guess, double length) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    double low = 0, high = length, t = guess, step = INFINITY, d[4];
    for (int i = 0; i < SEARCH_STEPS; i++) {
        if (!(t > low && t < high)) {
            t = (low + high) / 2;
            step = INFINITY;
        }
        go_on(p, press->d, t, step, d);
        const double rate = press->sign * pulse_see(&p->n_rate, d, 0, press->slope);
        const double bend = press->sign * pulse_dot(p->n_bend.d, d);
        if (rate > 0)
            low = t;
        else
            high = t;
        step = -rate / bend;
        if (fabs(step) * p->omega[1] <= NEAR && bend < 0) {
            const double a = press->a + press->slope * t;
            const State at = see(press, d, a);
            const double n = pulse_see(&p->n, d, a, press->slope) + press->sign * rate * step / 2;
            const Motion *m = &exact->flying;
            const double push = m->damping * at.v + m->omega2 * at.x;
            const double moved =
                push + step * (m->omega2 * at.v + m->damping * (m->share * n - push - a));
            ledger_force(&exact->ledger, &exact->row, exact_effective_mass(exact) * fabs(n));
            ledger_acceleration(&exact->ledger, m->share * n - moved);
            return true;
        }
        t += step;
    }
    return false;
}

// A peak of the force on the way to `end`, after `length`. False: it cannot be told.
static bool take_peak(Press *press, const double end[4], double length, bool is_slow) {
    const Pulse *p = press->pulse;
    const double from = press->sign * pulse_see(&p->n_rate, press->d, 0, press->slope);
    const double to = press->sign * pulse_see(&p->n_rate, end, 0, press->slope);
    if (from > 0 && to < 0)
        return press_find_peak(
            press, is_slow ? length * from / (from - to) : p->peak_time - press->elapsed, length);
    // Over half a turn a force may rise, fall and rise.
    if (to < 0 || (from > 0 && p->omega[1] * length < 2))
        return true;
    // One that falls and rises again may have pulled hardest in between, but hardly more than ever.
    const double n = fabs(pulse_see(&p->n, press->d, press->a, press->slope));
    const double most = n + p->omega[1] * length * (n + larger(-from, to) / p->omega[1]);
    return is_slow &&
           exact_effective_mass(press->exact) * most <= press->exact->row.impact.peak_force;
}

// The stretch to `end` is done: its work, and the state there.
static void take_stretch(Press *press, const double end[4], double length, const State *state) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const State *before = &exact->state;
    const double last = press->a + press->slope * length, gain = (press->a + last) / 2 * length;
    const double total = exact->plan->mass[0] + exact->damper->mass, mass = exact->damper->mass;
    const double s = press->slope;
    const double v = p->v.s * s, w = p->w.s * s;
    const double slow = pulse_slow(p, press->d, length);
    press->vv += p->vv.slow * slow;
    press->ww += p->ww.slow * slow;
    press->vv += v * (2 * (state->x - before->x) - v * length);
    press->ww += w * (2 * (state->r - before->r) - w * length);
    if (exact->stretch.base_most > 0) {
        double change[4];
        for (int i = 0; i < 4; i++)
            change[i] = end[i] - press->d[i];
        const double x = pulse_dot(p->x_sum.d, change) + (p->x.a * gain + p->x.s * s * length);
        const double r = pulse_dot(p->r_sum.d, change) + (p->r.a * gain + p->r.s * s * length);
        press->work -= total * (last * state->x - press->a * before->x - s * x) +
                       mass * (last * state->r - press->a * before->r - s * r);
        press->gained += gain;
        recorder_base(&exact->recorder, gain);
    }
    press->length += length;
    press->elapsed += length;
    press->a = last;
    for (int i = 0; i < 4; i++)
        press->d[i] = end[i];
    exact->state = *state;
    exact->run->steps++;
}

// The base's slope from the present sample on.
static void turn_base(Press *press, double slope) {
    const Pulse *p = press->pulse;
    const double jump = slope - press->slope;
    if (jump == 0)
        return;
    press->vv -= jump * (pulse_dot(p->vv.jump, press->d) + jump * p->vv.jump2);
    press->ww -= jump * (pulse_dot(p->ww.jump, press->d) + jump * p->ww.jump2);
    for (int i = 0; i < 4; i++)
        press->d[i] += jump * p->jump[i];
    press->slope = slope;
}

// Enters what the contact has come to since the touch.
static void enter(Press *press) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const double vv = press->vv + pulse_form(&p->vv, press->d);
    const double ww = press->ww + pulse_form(&p->ww, press->d);
    const double absolute = exact->state.v + exact->state.w;
    ledger_work(&exact->ledger, press->work, exact->plan->damping[0] * vv);
    ledger_stretch(&exact->ledger, &exact->row, press->length,
                   -exact->damper->mass * (absolute - press->absolute + press->gained),
                   exact->damper->stops[exact->side].damping * ww);
}

// Surely no p = 0 between two samples, where both are inside.
static bool stays_inside(const Press *press, double from, double w, double to, double w_to,
                         double length) {
    const Pulse *p = press->pulse;
    const double bend = p->size2[0] * (fabs(press->d[0]) + fabs(press->d[1])) +
                        p->size2[1] * (fabs(press->d[2]) + fabs(press->d[3]));
    if (from == 0)
        return w > bend * length / 2;
    const double least = from < to ? from : to;
    return least > bend * length * length / 8 || fabs(w) > bend * length ||
           fabs(w_to) > bend * length;
}

// Whether p falls all the way to its zero: from `before` it, where w is `speed`.
static bool falls(const Press *press, const State *end, double before, bool is_slow) {
    const Pulse *p = press->pulse;
    const double w = -press->sign * end->w;
    if (!(w > 0))
        return false;
    if (is_slow) {
        const double bend = p->size2[0] * (fabs(press->d[0]) + fabs(press->d[1])) +
                            p->size2[1] * (fabs(press->d[2]) + fabs(press->d[3]));
        return w > bend * before / 2; // backwards from there p rises
    }
    if (before <= 0)
        return true;
    const Motion *m = &press->exact->flying;
    const double angle = p->omega[1] * before;
    const double push = fabs(m->damping * end->v + m->omega2 * end->x);
    const double bend = (p->damping * w + push) / (p->omega[1] * w);
    return angle * (1.5 * bend + 2 * angle) < 0.66;
}

// Surely inside over a long stretch, because the slow part outweighs the fast.
static bool is_pressed(const Press *press, const double end[4], double length) {
    const Pulse *p = press->pulse;
    const double *d = press->d, last = press->a + press->slope * length;
    const double fast = fabs(d[2]) + fabs(d[3]), slow = fabs(d[0]) + fabs(d[1]);
    const double from = press->sign * (d[0] + p->r.a * press->a + p->r.s * press->slope);
    const double to = press->sign * (end[0] + p->r.a * last + p->r.s * press->slope);
    return (from < to ? from : to) > fast + p->size2[0] * slow * length * length / 8;
}

// Whether the force has no peak within a long stretch that has not been seen: it stays below the
// last one, or the fast part has died and what is left only rises or only falls.
static bool is_known(const Press *press, const double end[4], double length) {
    const Pulse *p = press->pulse;
    const double *d = press->d, last = press->a + press->slope * length;
    const double slow = (fabs(p->n.d[0]) + fabs(p->n.d[1])) * (fabs(d[0]) + fabs(d[1]));
    const double fast = (fabs(p->n.d[2]) + fabs(p->n.d[3])) * (fabs(d[2]) + fabs(d[3]));
    const double from = pulse_see(&p->n, d, press->a, press->slope);
    const double to = pulse_see(&p->n, end, last, press->slope);
    const double most =
        larger(fabs(from), fabs(to)) + 2 * fast + p->size2[0] * slow * length * length / 8;
    if (exact_effective_mass(press->exact) * most <= press->exact->row.impact.peak_force)
        return true;
    const double rises = pulse_see(&p->n_rate, d, 0, press->slope);
    return fast <= 1e-13 * fabs(from) && rises * pulse_see(&p->n_rate, end, 0, press->slope) > 0;
}

typedef enum Outcome { GOES_ON, ENDS, UNCLEAR } Outcome;

// By comparison with the isolated contact: the rest of the interval, or to the release.
static Outcome compare(Press *press, double *length, double end[4], State *state) {
    const Pulse *p = press->pulse;
    double time = *length, turn[4];
    Outcome outcome = GOES_ON;
    if (press->elapsed + time > press->lasts) {
        const double guess = p->time - press->elapsed;
        if (!find_release(press, guess > 0 ? guess : 0, 2 * p->time, &time, end))
            return UNCLEAR;
        *state = see(press, end, press->a + press->slope * time);
        if (!falls(press, state, press->elapsed + time - press->lasts, false))
            return UNCLEAR;
        if (time <= *length)
            outcome = ENDS;
    }
    if (outcome == GOES_ON) {
        time = *length;
        pulse_turn(p, time, turn);
        pulse_multiply(turn, press->d, end);
        *state = see(press, end, press->a + press->slope * time);
    }
    *length = time;
    return take_peak(press, end, time, false) ? outcome : UNCLEAR;
}

static void go(const Press *press, double length, double end[4], State *state) {
    const Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    double turn[4];
    const bool is_whole = exact->offset == 0 && length == exact->interval;
    if (!is_whole)
        pulse_turn(p, length, turn);
    pulse_multiply(is_whole ? p->interval : turn, press->d, end);
    *state = see(press, end, press->a + press->slope * length);
}

// By bounds of size and curvature: at most `step`, or where the contact surely lasts further, up to
// the end of the interval, or to the release.
static Outcome walk(Press *press, double step, double *length, double end[4], State *state) {
    const Pulse *p = press->pulse;
    double time = *length;
    const double stride = LONG_STEP / p->omega[1];
    if (time > step) {
        go(press, time, end, state);
        if (is_pressed(press, end, time) && is_known(press, end, time))
            return GOES_ON;
        *length = time = time < stride ? time : stride;
        go(press, time, end, state);
        if (is_pressed(press, end, time) && take_peak(press, end, time, true))
            return GOES_ON;
        *length = time = time < step ? time : step;
    }
    go(press, time, end, state);
    const double from = press->sign * press->exact->state.r, to = press->sign * state->r;
    Outcome outcome = GOES_ON;
    if (to > 0) {
        if (!stays_inside(press, from, press->sign * press->exact->state.w, to,
                          press->sign * state->w, time))
            return UNCLEAR;
    } else {
        if (!(from > 0) || !find_release(press, time * from / (from - to), time, length, end))
            return UNCLEAR;
        *state = see(press, end, press->a + press->slope * *length);
        if (!falls(press, state, *length, true))
            return UNCLEAR;
        outcome = ENDS;
    }
    return take_peak(press, end, *length, true) ? outcome : UNCLEAR;
}

// The next sample is reached. False: the base's end is.
static bool pass(Press *press) {
    Exact *exact = press->exact;
    const Base *base = exact->run->base;
    exact_stride_pass(exact);
    ledger_force(&exact->ledger, &exact->row, fabs(exact_force(exact)));
    if (exact->stretch.base_most == 0)
        return true;
    if (exact->sample + 1 >= base->count)
        return false;
    const double *a = base->values + exact->sample;
    turn_base(press, (a[1] - a[0]) / base->interval);
    press->a = a[0];
    return true;
}

size_t exact_press(Exact *exact, size_t most) {
    const Pulse *pulse = &exact->pulses[exact->side];
    double step = STEP / pulse->omega[1];
    if (!pulse->is_usable || !(fabs(exact->state.w) > 0) || step * STEPS_MOST < exact->interval ||
        (exact->stretch.base_most > 0 && exact->sample + 1 >= exact->run->base->count))
        return 0;
    size_t count = 0, ride_from = 0;
    Press press;
    start(&press, exact);
    bool is_walking = step > exact->interval;
    if (!is_walking)
        press.lasts = surely_lasts(&press);
    Outcome outcome = GOES_ON;
    while (count < most) {
        if (is_walking && exact->offset == 0 && step > exact->interval && count >= ride_from) {
            count += press_ride(&press, most - count);
            ride_from = count + RIDE_AGAIN; // it has ended, most often because the contact will
        }
        if (count >= most)
            break;
        const double left = exact->interval - exact->offset;
        double length = left, end[4];
        State state;
        outcome = is_walking ? walk(&press, step, &length, end, &state)
                             : compare(&press, &length, end, &state);
        if (outcome == UNCLEAR) {
            // First by other means, then in ever smaller steps.
            if (is_walking)
                step /= 4;
            is_walking = true;
            if (step * STEPS_MOST < exact->interval)
                break;
            continue;
        }
        if (outcome == ENDS)
            state.r = 0;
        take_stretch(&press, end, length, &state);
        exact->offset += length;
        if (outcome == ENDS)
            break;
        if (length < left)
            continue;
        count++;
        if (!pass(&press))
            break;
    }
    enter(&press);
    if (outcome == ENDS) {
        exact->events++;
        exact_release(exact);
    }
    return count;
}
