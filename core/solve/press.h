// One linear contact on its way in closed form: where it is and what it has come to, and how the
// base goes on under it. Not its proofs (press_bounds.h) nor its steps (exact_press.c). Used by
// exact_press.c and exact_ride.c.
#ifndef CORE_SOLVE_PRESS_H
#define CORE_SOLVE_PRESS_H

#include "core/solve/exact_state.h"
#include "core/solve/wide.h"

enum { PRESS_FRESH = 64 }; // samples after which a sine is looked up again

typedef struct Press {
    Exact *exact;
    const Pulse *pulse;
    double sign;
    Four d; // at the beginning of the present stretch
    double a, slope;
    double elapsed;                      // since the touch [s]
    double lasts;                        // surely until then [s]
    double speed, absolute;              // at the touch: |w|, and the free mass's velocity
    double vv, ww, work, gained, length; // since then
} Press;

// The base at t of the present stretch.
INLINE void press_base(const Press *press, double t, double *a, double *slope) {
    const double omega = press->pulse->base_omega;
    if (omega == 0) {
        *a = press->a + press->slope * t;
        *slope = press->slope;
        return;
    }
    const Slice now = {press->a, press->slope, omega};
    Slice then;
    exact_turn(&now, t, &then);
    *a = then.value;
    *slope = then.slope;
}

// |r''| of oscillations is not larger, with what a sine makes of it.
INLINE double press_bend(const Press *press) {
    const Pulse *p = press->pulse;
    const Four d = press->d;
    return p->size2[0] * (fabs(d[0]) + fabs(d[1])) + p->size2[1] * (fabs(d[2]) + fabs(d[3])) +
           p->sway * press->exact->stretch.base_max;
}

// The integrals' parts that hang on the present instant alone, `sign` times; under a sine with what
// that adds, also steadily over `length`.
INLINE void press_ends(Press *press, double sign, double length) {
    const Pulse *p = press->pulse;
    double vv = pulse_form(&p->vv, &press->d), ww = pulse_form(&p->ww, &press->d);
    if (p->base_omega > 0) {
        const double a = press->a, s = press->slope, total = (a * a + s * s) * length;
        vv += pulse_sine(&p->sine_vv, &press->d, a, s) + total * p->sine_vv.steady;
        ww += pulse_sine(&p->sine_ww, &press->d, a, s) + total * p->sine_ww.steady;
        press->work -= sign * (press->exact->plan->mass[0] + press->exact->damper->mass) *
                       (pulse_sine(&p->sine_work, &press->d, a, s) + total * p->sine_work.steady);
    }
    press->vv += sign * vv;
    press->ww += sign * ww;
}

#endif
