// The closed form of a contact against arcs.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/solve/pulse.h"

static Motion contact(double omega, double ratio) {
    Motion motion = {.omega2 = 640,
                     .damping = 0.81,
                     .share = 0.0758,
                     .contact_omega2 = omega * omega,
                     .contact_damping = 2 * ratio * omega};
    motion.rate = sqrt(motion.omega2) + motion.damping + fmax(omega, motion.contact_damping);
    return motion;
}

static void see(const Pulse *p, const double d[4], double a, double s, State *at) {
    *at = (State){pulse_see(&p->x, d, a, s), pulse_see(&p->v, d, a, s), pulse_see(&p->r, d, a, s),
                  pulse_see(&p->w, d, a, s)};
}

static void a_pulse_agrees_with_arcs(void **state) {
    (void)state;
    static const double omegas[] = {125, 800, 1e4, 1e6}, ratios[] = {0.01, 0.15, 0.6, 0.9};
    for (size_t i = 0; i < 16; i++) {
        const double omega = omegas[i / 4], ratio = ratios[i % 4];
        const Motion motion = contact(omega, ratio);
        Pulse pulse;
        pulse_make(&pulse, &motion, 1e-3);
        assert_true(pulse.is_usable);
        assert_true(fabs(pulse.time * omega * sqrt(1 - ratio * ratio) - 3.14159265358979) < 1e-12);
        const State start = {0.007, -0.2, 0, 0.3};
        const Slice slice = {1.5, -200, 0};
        const double from[6] = {start.x, start.v, start.r, start.w, slice.value, slice.slope};
        double d[4], end[4], turn[4];
        for (int k = 0; k < 4; k++) {
            d[k] = 0;
            for (int j = 0; j < 6; j++)
                d[k] += pulse.into[k][j] * from[j];
        }
        const double length = 0.9 * pulse.time;
        pulse_turn(&pulse, length, turn);
        pulse_multiply(turn, d, end);
        State at = start, got;
        double vv = 0, ww = 0;
        for (int k = 0; k < 40; k++) {
            const Slice part = {slice.value + slice.slope * length * k / 40, slice.slope, 0};
            Arc arc;
            arc_make(&arc, &motion, &at, &part, length / 40);
            const ArcIntegrals integrals = arc_integrals(&arc);
            vv += integrals.vv;
            ww += integrals.ww;
            at = arc_end(&arc);
        }
        see(&pulse, end, slice.value + slice.slope * length, slice.slope, &got);
        assert_true(fabs(got.x - at.x) < 1e-14);
        assert_true(fabs(got.v - at.v) < 1e-13);
        assert_true(fabs(got.r - at.r) < 1e-13 * start.w / omega);
        assert_true(fabs(got.w - at.w) < 1e-13);
        const double n = motion.contact_damping * at.w + motion.contact_omega2 * at.r;
        assert_true(fabs(pulse_see(&pulse.n, end, slice.value + slice.slope * length, slice.slope) -
                         n) < 1e-12 * omega);
        const double slow = pulse_slow(&pulse, d, length);
        const double v = pulse.v.s * slice.slope, w = pulse.w.s * slice.slope;
        const double got_vv = pulse_form(&pulse.vv, end) - pulse_form(&pulse.vv, d) +
                              pulse.vv.slow * slow + v * (2 * (at.x - start.x) - v * length);
        const double got_ww = pulse_form(&pulse.ww, end) - pulse_form(&pulse.ww, d) +
                              pulse.ww.slow * slow + w * (2 * (at.r - start.r) - w * length);
        assert_true(fabs(got_vv - vv) < 1e-10 * vv);
        assert_true(fabs(got_ww - ww) < 1e-10 * ww);
    }
}

static void assert_near(const double a[4], const double b[4]) {
    for (int k = 0; k < 4; k++)
        assert_true(fabs(a[k] - b[k]) < 4e-15);
}

static void tables_and_nudges_are_turns(void **state) {
    (void)state;
    const Motion motion = contact(400, 0.3);
    Pulse pulse;
    pulse_make(&pulse, &motion, 1e-3);
    double turn[4], here[4], d[4] = {0.3, -0.2, 0.5, 0.7}, later[4];
    for (int i = 0; i < PULSE_RIDE; i++) {
        pulse_turn(&pulse, 1e-3 * (i + 1), turn);
        for (int k = 0; k < 4; k++)
            here[k] = pulse.ride[k][i];
        assert_near(turn, here);
        pulse_multiply(turn, pulse.jump, later);
        for (int k = 0; k < 4 && i + 1 < PULSE_RIDE; k++)
            assert_true(fabs(pulse.jumps[k][PULSE_RIDE + i + 1] - later[k]) < 1e-19);
        for (int k = 0; k < 4; k++)
            assert_true(pulse.jumps[k][i] == 0);
    }
    for (int i = -3; i <= 3; i++) {
        const double step = i * PULSE_NEAR / 3 / pulse.rate, from = 0.4 * pulse.time;
        pulse_turn(&pulse, from, turn);
        pulse_multiply(turn, d, here);
        pulse_nudge(&pulse, step, here);
        pulse_turn(&pulse, from + step, turn);
        pulse_multiply(turn, d, later);
        assert_near(here, later);
    }
    pulse_turn(&pulse, pulse.peak_time, turn);
    pulse_turn(&pulse, pulse.peak_time * (1 + 1e-15), later);
    assert_near(turn, later);
}

static void what_does_not_oscillate_twice_is_refused(void **state) {
    (void)state;
    Pulse pulse;
    Motion motion = contact(1000, 1.2);
    pulse_make(&pulse, &motion, 1e-3);
    assert_false(pulse.is_usable);
    motion = contact(1000, 0.2);
    motion.omega2 = motion.damping = 0;
    pulse_make(&pulse, &motion, 1e-3);
    assert_false(pulse.is_usable);
    motion = contact(20, 0.2);
    pulse_make(&pulse, &motion, 1e-3);
    assert_false(pulse.is_usable);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pulse_agrees_with_arcs),
        cmocka_unit_test(tables_and_nudges_are_turns),
        cmocka_unit_test(what_does_not_oscillate_twice_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
