// From touch to release, stretch by stretch: as far as surely nothing happens that is not seen.
#include "core/solve/exact_press.h"

#include <math.h>

#include "core/solve/exact_events.h"
#include "core/solve/exact_ride.h"
#include "core/solve/exact_stride.h"
#include "core/solve/press_bounds.h"
#include "core/solve/press_search.h"

// How far the fast oscillation turns in one step of a walk, and steps to an interval: stiffer
// buffers are not for this.
static const double STEP = 0.6;
static const double LONG_STEP = 2;
static const double STEPS_MOST = 1024;
enum { RIDE_AGAIN = 8 };

INLINE void start(Press *press, Exact *exact) {
    const Pulse *pulse = &exact->pulses[exact->side];
    const State *y = &exact->state;
    Slice slice;
    exact_slice(exact, &slice);
    *press = (Press){.exact = exact,
                     .pulse = pulse,
                     .sign = exact_sign(exact->side),
                     .a = slice.value,
                     .slope = slice.slope,
                     .speed = fabs(y->w),
                     .absolute = y->v + y->w};
    const double(*c)[4] = pulse->into;
    press->d = ((FOUR(c[0]) * y->x + FOUR(c[1]) * y->v) + FOUR(c[3]) * y->w) +
               (FOUR(c[PULSE_A]) * slice.value + FOUR(c[PULSE_S]) * slice.slope);
    press_ends(press, -1, 0);
}

INLINE void see(const Press *press, const Four *d, double t, State *state) {
    double a, slope;
    press_base(press, t, &a, &slope);
    Four at;
    pulse_see(press->pulse, PULSE_X, d, a, slope, &at);
    *state = (State){at[0], at[1], at[2], at[3]};
}

WIDE static bool find_peak_wide(Press *press, double guess, double length) {
    return press_take_largest(press, guess, length);
}

bool press_find_peak(Press *press, double guess, double length) {
    return press->exact->lanes.width == LANES_PLAIN ? press_take_largest(press, guess, length)
                                                    : find_peak_wide(press, guess, length);
}

// n's slope, to the stop, at t.
INLINE double rises(const Press *press, const Four *d, double t) {
    double a, slope;
    press_base(press, t, &a, &slope);
    Four force;
    pulse_see(press->pulse, PULSE_N, d, a, slope, &force);
    return press->sign * force[1];
}

// A peak of the force on the way to `end`, after `length`. False: it cannot be told.
INLINE bool take_peak(Press *press, const Four *end, double length, bool is_slow) {
    const Pulse *p = press->pulse;
    const double from = rises(press, &press->d, 0), to = rises(press, end, length);
    if (from > 0 && to < 0)
        return is_slow ? press_find_peak(press, length * from / (from - to), length)
                       : press_take_largest(press, p->peak_time - press->elapsed, length);
    // Over half a turn a force may rise, fall and rise.
    if (to < 0 || (from > 0 && p->fast * length < 2))
        return true;
    // One that falls and rises again may have pulled hardest in between, but hardly more than ever.
    Four force;
    pulse_see(p, PULSE_N, &press->d, press->a, press->slope, &force);
    const double n = fabs(force[0]), slope = -from > to ? -from : to;
    const double most = n + p->fast * length * (n + slope / p->fast);
    return is_slow &&
           exact_effective_mass(press->exact) * most <= press->exact->row.impact.peak_force;
}

// The stretch to `end` is done: its work, and the state there.
INLINE void take_stretch(Press *press, const Four *end, double length, const State *state) {
    Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    const State *before = &exact->state;
    const double slow = pulse_slow(p, &press->d, length);
    press->vv += p->vv.slow * slow;
    press->ww += p->ww.slow * slow;
    if (exact->stretch.base_most > 0) {
        const double a = press->a, s = press->slope;
        double last, slope, gain;
        press_base(press, length, &last, &slope);
        if (p->base_omega == 0) {
            const double v = p->see[PULSE_S][PULSE_V] * s, w = p->see[PULSE_S][PULSE_W] * s;
            const double share = exact->flying.share;
            const double here = state->x + share * state->r, there = before->x + share * before->r;
            const Four change = *end - press->d;
            gain = (a + last) / 2 * length;
            press->vv += v * (2 * (state->x - before->x) - v * length);
            press->ww += w * (2 * (state->r - before->r) - w * length);
            press->work -= (exact->plan->mass[0] + exact->damper->mass) *
                           (last * here - a * there -
                            s * (pulse_dot(p->middle, &change) +
                                 (p->middle_a * gain + p->middle_s * s * length)));
        } else {
            const Slice slice = {a, s, p->base_omega};
            gain = exact_turned(&slice, length);
        }
        press->gained += gain;
        recorder_base(&exact->recorder, gain);
        press->a = last;
        press->slope = slope;
    }
    press->length += length;
    press->elapsed += length;
    press->d = *end;
    exact->state = *state;
    exact->run->steps++;
}

// The base's slope from the present sample on.
INLINE void turn_base(Press *press, double slope) {
    const Pulse *p = press->pulse;
    const double jump = slope - press->slope;
    if (jump == 0)
        return;
    press->vv -= jump * (pulse_dot(p->vv.jump, &press->d) + jump * p->vv.jump2);
    press->ww -= jump * (pulse_dot(p->ww.jump, &press->d) + jump * p->ww.jump2);
    press->d += jump * FOUR(p->jump);
    press->slope = slope;
}

// Enters what the contact has come to since the touch.
INLINE void enter(Press *press) {
    Exact *exact = press->exact;
    press_ends(press, 1, press->length);
    const double absolute = exact->state.v + exact->state.w;
    ledger_work(&exact->ledger, press->work, exact->plan->damping[0] * press->vv);
    ledger_stretch(&exact->ledger, &exact->row, press->length,
                   -exact->damper->mass * (absolute - press->absolute + press->gained),
                   exact->damper->stops[exact->side].damping * press->ww);
}

typedef enum Outcome { GOES_ON, ENDS, UNCLEAR } Outcome;

INLINE void go(const Press *press, double length, Four *end, State *state) {
    const Exact *exact = press->exact;
    const Pulse *p = press->pulse;
    if (exact->offset == 0 && length == exact->interval)
        pulse_multiply(p->interval, &press->d, end);
    else
        pulse_go(p, &press->d, length, end);
    see(press, end, length, state);
}

// By comparison with the isolated contact: the rest of the interval, or to the release.
INLINE Outcome compare(Press *press, double *length, Four *end, State *state) {
    const Pulse *p = press->pulse;
    double time = *length;
    Outcome outcome = GOES_ON;
    if (press->elapsed + time > press->lasts) {
        const double guess = p->time - press->elapsed;
        if (!press_find_release(press, guess > 0 ? guess : 0, 2 * p->time, &time, end, state) ||
            !press_falls(press, state, press->elapsed + time - press->lasts, false))
            return UNCLEAR;
        if (time <= *length)
            outcome = ENDS;
    }
    if (outcome == GOES_ON) {
        time = *length;
        go(press, time, end, state);
    }
    *length = time;
    return take_peak(press, end, time, false) ? outcome : UNCLEAR;
}

// By bounds of size and curvature: at most `step`, or where the contact surely lasts further, up to
// the end of the interval, or to the release.
INLINE Outcome walk(Press *press, double step, double *length, Four *end, State *state) {
    const Pulse *p = press->pulse;
    double time = *length;
    const double stride = LONG_STEP / p->fast;
    if (time > step) {
        go(press, time, end, state);
        if (press_is_pressed(press, end, time) && press_is_known(press, end, time))
            return GOES_ON;
        *length = time = time < stride ? time : stride;
        go(press, time, end, state);
        if (press_is_pressed(press, end, time) && take_peak(press, end, time, true))
            return GOES_ON;
        *length = time = time < step ? time : step;
    }
    go(press, time, end, state);
    const double from = press->sign * press->exact->state.r, to = press->sign * state->r;
    Outcome outcome = GOES_ON;
    if (to > 0) {
        if (!press_stays_inside(press, from, press->sign * press->exact->state.w, to,
                                press->sign * state->w, time))
            return UNCLEAR;
    } else {
        if (!(from > 0) ||
            !press_find_release(press, time * from / (from - to), time, length, end, state) ||
            !press_falls(press, state, *length, true))
            return UNCLEAR;
        outcome = ENDS;
    }
    return take_peak(press, end, *length, true) ? outcome : UNCLEAR;
}

// The next sample is reached. False: the base's end is.
INLINE bool pass(Press *press) {
    Exact *exact = press->exact;
    const Base *base = exact->run->base;
    exact_stride_pass(exact);
    ledger_force(&exact->ledger, &exact->row, fabs(exact_force(exact)));
    if (exact->stretch.base_most == 0)
        return true;
    Slice slice;
    if (base->form == BASE_SAMPLED) {
        if (exact->sample + 1 >= base->count)
            return false;
        exact_slice(exact, &slice);
        turn_base(press, slice.slope);
        press->a = slice.value;
    } else if (exact->sample % PRESS_FRESH == 0) {
        exact_slice(exact, &slice);
        press->a = slice.value;
        press->slope = slice.slope;
    }
    return true;
}

INLINE size_t press_all(Exact *exact, size_t most) {
    const Pulse *pulse = &exact->pulses[exact->side];
    double step = STEP / pulse->fast;
    if (!pulse->is_usable || !(fabs(exact->state.w) > 0) || step * STEPS_MOST < exact->interval ||
        (exact->stretch.base_most > 0 && exact->run->base->form == BASE_SAMPLED &&
         exact->sample + 1 >= exact->run->base->count))
        return 0;
    size_t count = 0, ride_from = 0;
    Press press;
    start(&press, exact);
    bool is_walking = step > exact->interval;
    if (!is_walking)
        press.lasts = press_surely_lasts(&press);
    Outcome outcome = GOES_ON;
    while (count < most) {
        if (is_walking && exact->offset == 0 && step > exact->interval && count >= ride_from) {
            count += press_ride(&press, most - count);
            ride_from = count + RIDE_AGAIN; // it has ended, most often because the contact will
        }
        if (count >= most)
            break;
        const double left = exact->interval - exact->offset;
        double length = left;
        Four end;
        State state;
        outcome = is_walking ? walk(&press, step, &length, &end, &state)
                             : compare(&press, &length, &end, &state);
        if (outcome == UNCLEAR) {
            // First by other means, then in ever smaller steps.
            if (is_walking)
                step /= 4;
            is_walking = true;
            if (step * STEPS_MOST < exact->interval)
                break;
            continue;
        }
        take_stretch(&press, &end, length, &state);
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

WIDE static size_t press_all_wide(Exact *exact, size_t most) {
    return press_all(exact, most);
}

size_t exact_press(Exact *exact, size_t most) {
    return exact->lanes.width == LANES_PLAIN ? press_all(exact, most) : press_all_wide(exact, most);
}
