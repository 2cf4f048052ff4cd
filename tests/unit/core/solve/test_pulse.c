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

// The base's two parts at t; omega 0: linear.
static void base_at(const Slice *slice, double t, double *a, double *s) {
    *a = slice_at(slice, t);
    const Slice other = {slice->slope, -slice->value, slice->omega};
    *s = slice->omega > 0 ? slice_at(&other, t) : slice->slope;
}

static void start_of(const Pulse *pulse, const State *start, const Slice *slice, Four *d) {
    const double from[PULSE_COLUMNS] = {start->x, start->v,     start->r,
                                        start->w, slice->value, slice->slope};
    *d = (Four){0};
    for (int j = 0; j < PULSE_COLUMNS; j++)
        *d += FOUR(pulse->into[j]) * from[j];
}

static void assert_pulse_is_arcs(double omega, double ratio, const Slice *slice) {
    const Motion motion = contact(omega, ratio);
    Pulse pulse;
    pulse_make(&pulse, &motion, slice->omega, 1e-3);
    assert_true(pulse.is_usable);
    assert_true(fabs(pulse.time * omega * sqrt(1 - ratio * ratio) - 3.14159265358979) < 1e-12);
    const State start = {0.007, -0.2, 0, 0.3};
    const double length = 0.9 * pulse.time;
    Four d, end, seen, force, further;
    start_of(&pulse, &start, slice, &d);
    pulse_go(&pulse, &d, length, &end);
    State at = start;
    double vv = 0, ww = 0, work = 0, a, s;
    for (int k = 0; k < 40; k++) {
        Slice part = {0, 0, slice->omega};
        base_at(slice, length * k / 40, &part.value, &part.slope);
        Arc arc;
        arc_make(&arc, &motion, &at, &part, length / 40);
        const ArcIntegrals integrals = arc_integrals(&arc);
        vv += integrals.vv;
        ww += integrals.ww;
        work += integrals.av + motion.share * integrals.aw;
        at = arc_end(&arc);
    }
    base_at(slice, length, &a, &s);
    pulse_see(&pulse, PULSE_X, &end, a, s, &seen);
    assert_true(fabs(seen[0] - at.x) < 1e-14);
    assert_true(fabs(seen[1] - at.v) < 1e-13);
    assert_true(fabs(seen[2] - at.r) < 1e-13 * start.w / omega);
    assert_true(fabs(seen[3] - at.w) < 1e-13);
    // n = c w + k r, r'' = push - n and their derivatives, by the equations of motion.
    const double n = motion.contact_damping * at.w + motion.contact_omega2 * at.r;
    const double push = motion.damping * at.v + motion.omega2 * at.x, r2 = push - n;
    const double v1 = motion.share * n - push - a;
    const double n1 = motion.contact_damping * r2 + motion.contact_omega2 * at.w;
    const double push1 = motion.damping * v1 + motion.omega2 * at.v, r3 = push1 - n1;
    const double a1 = slice->omega > 0 ? slice->omega * s : s;
    const double n2 = motion.contact_damping * r3 + motion.contact_omega2 * r2;
    const double v2 = motion.share * n1 - push1 - a1;
    const double r4 = motion.damping * v2 + motion.omega2 * v1 - n2;
    const double n3 = motion.contact_damping * r4 + motion.contact_omega2 * r3;
    pulse_see(&pulse, PULSE_N, &end, a, s, &force);
    pulse_see(&pulse, PULSE_N3, &end, a, s, &further);
    assert_true(fabs(force[0] - n) < 1e-12 * omega);
    assert_true(fabs(force[1] - n1) < 1e-12 * omega * omega);
    assert_true(fabs(force[2] - n2) < 1e-12 * pow(omega, 3));
    assert_true(fabs(force[3] - r2) < 1e-12 * omega);
    assert_true(fabs(further[0] - n3) < 1e-12 * pow(omega, 4));
    assert_true(fabs(further[2] - r3) < 1e-12 * omega * omega);
    assert_true(fabs(further[3] - r4) < 1e-12 * pow(omega, 3));
    const double slow = pulse_slow(&pulse, &d, length);
    double got_vv = pulse_form(&pulse.vv, &end) - pulse_form(&pulse.vv, &d) + pulse.vv.slow * slow;
    double got_ww = pulse_form(&pulse.ww, &end) - pulse_form(&pulse.ww, &d) + pulse.ww.slow * slow;
    if (slice->omega > 0) {
        const double total = (a * a + s * s) * length;
        got_vv += pulse_sine(&pulse.sine_vv, &end, a, s) -
                  pulse_sine(&pulse.sine_vv, &d, slice->value, slice->slope) +
                  total * pulse.sine_vv.steady;
        got_ww += pulse_sine(&pulse.sine_ww, &end, a, s) -
                  pulse_sine(&pulse.sine_ww, &d, slice->value, slice->slope) +
                  total * pulse.sine_ww.steady;
        const double got_work = pulse_sine(&pulse.sine_work, &end, a, s) -
                                pulse_sine(&pulse.sine_work, &d, slice->value, slice->slope) +
                                total * pulse.sine_work.steady;
        assert_true(fabs(got_work - work) < 1e-10 * fabs(work));
    } else {
        const double v = pulse.see[PULSE_S][PULSE_V] * s, w = pulse.see[PULSE_S][PULSE_W] * s;
        got_vv += v * (2 * (at.x - start.x) - v * length);
        got_ww += w * (2 * (at.r - start.r) - w * length);
    }
    assert_true(fabs(got_vv - vv) < 1e-10 * vv);
    assert_true(fabs(got_ww - ww) < 1e-10 * ww);
}

static void a_pulse_agrees_with_arcs(void **state) {
    (void)state;
    static const double omegas[] = {125, 800, 1e4, 1e6}, ratios[] = {0.01, 0.15, 0.6, 0.95};
    static const Slice slices[] = {{1.5, -200, 0}, {1.5, -0.7, 6.3}, {0.4, 2.1, 38}};
    for (size_t i = 0; i < 48; i++)
        assert_pulse_is_arcs(omegas[i % 16 / 4], ratios[i % 4], &slices[i / 16]);
}

static void assert_near(const double a[4], const double b[4]) {
    for (int k = 0; k < 4; k++)
        assert_true(fabs(a[k] - b[k]) < 4e-15);
}

static void tables_and_nudges_are_turns(void **state) {
    (void)state;
    const Motion motion = contact(400, 0.3);
    Pulse pulse;
    pulse_make(&pulse, &motion, 30, 1e-3);
    const Four one = {1, 0, 1, 0}, d = {0.3, -0.2, 0.5, 0.7};
    Four turn, here, later;
    double table[4];
    for (int i = 0; i < PULSE_RIDE; i++) {
        pulse_go(&pulse, &one, 1e-3 * (i + 1), &turn);
        for (int k = 0; k < 4; k++)
            table[k] = pulse.ride[k][i];
        assert_near((const double *)&turn, table);
        pulse_multiply(pulse.jump, &turn, &later);
        for (int k = 0; k < 4 && i + 1 < PULSE_RIDE; k++)
            assert_true(fabs(pulse.jumps[k][PULSE_RIDE + i + 1] - later[k]) < 1e-17);
        for (int k = 0; k < 4; k++)
            assert_true(pulse.jumps[k][i] == 0);
        assert_true(fabs(pulse.cosine[i] - cos(0.03 * (i + 1))) < 1e-15);
        assert_true(fabs(pulse.sine[i] - sin(0.03 * (i + 1))) < 1e-15);
    }
    for (int i = -3; i <= 3; i++) {
        const double step = i * pulse.near / 3, from = 0.4 * pulse.time;
        pulse_go(&pulse, &d, from, &here);
        pulse_nudge(&pulse, step, &here);
        pulse_go(&pulse, &d, from + step, &later);
        assert_near((const double *)&here, (const double *)&later);
    }
    pulse_multiply(pulse.peak, &d, &here);
    pulse_go(&pulse, &d, pulse.peak_time, &later);
    assert_near((const double *)&here, (const double *)&later);
    pulse_go(&pulse, &d, 6.1 * pulse.time, &later); // beyond the table
    for (int i = 0; i < 61; i++)
        pulse_go(&pulse, i == 0 ? &d : &here, 0.1 * pulse.time, &here);
    assert_near((const double *)&here, (const double *)&later);
}

static void what_does_not_oscillate_twice_is_refused(void **state) {
    (void)state;
    Pulse pulse;
    Motion motion = contact(1000, 1.2);
    pulse_make(&pulse, &motion, 0, 1e-3);
    assert_false(pulse.is_usable);
    motion = contact(1000, 0.2);
    motion.omega2 = motion.damping = 0;
    pulse_make(&pulse, &motion, 0, 1e-3);
    assert_false(pulse.is_usable);
    motion = contact(20, 0.2);
    pulse_make(&pulse, &motion, 0, 1e-3);
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
