// Long steps of contact: the same motion as arcs, and never over an end of contact.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/solve/exact_hold.h"

static Motion stiff_motion(double contact_time, double restitution) {
    const double ln = log(restitution), pi = 3.14159265358979323846;
    Motion motion = {.omega2 = 640,
                     .damping = 0.81,
                     .share = 0.0758,
                     .contact_omega2 = (pi * pi + ln * ln) / (contact_time * contact_time),
                     .contact_damping = -2 * ln / contact_time};
    motion.rate = sqrt(motion.omega2) + motion.damping +
                  fmax(sqrt(motion.contact_omega2), motion.contact_damping);
    return motion;
}

static State by_arcs(const Motion *motion, State state, const Slice *slice, double length,
                     double *least) {
    const double step = 1 / motion->rate;
    double done = 0;
    *least = state.r;
    while (done < length) {
        Arc arc;
        const Slice here = {slice_at(slice, done), slice->omega > 0 ? 0 : slice->slope, 0};
        arc_make(&arc, motion, &state, &here, fmin(step, length - done));
        state = arc_end(&arc);
        *least = fmin(*least, state.r);
        done += arc.length;
    }
    return state;
}

static void a_long_step_is_the_sum_of_its_arcs(void **context) {
    (void)context;
    const Motion motion = stiff_motion(1e-6, 0.46);
    Hold hold = {0};
    hold_make(&hold, &motion, 0, 1e-3);
    assert_true(hold.is_usable && hold.count > 5);
    const Slice slice = {0.7, 40, 0};
    const State start = {0.004, 0.05, 0.004 * 640 / motion.contact_omega2, 0};
    State end;
    double impulse, least;
    const HoldLevel *level = hold_step(&hold, &start, &slice, 1e-3, 1, 1e9, &end);
    assert_non_null(level);
    assert_true(level->length == 1e-3);
    const State wanted = by_arcs(&motion, start, &slice, level->length, &least);
    assert_true(least > 0);
    assert_true(fabs(end.x - wanted.x) < 1e-14 && fabs(end.v - wanted.v) < 1e-13);
    assert_true(fabs(end.r - wanted.r) < 1e-10 * wanted.r);
    const ArcIntegrals integrals = hold_integrals(level, &start, &slice, &impulse);
    assert_true(fabs(integrals.a - (0.7e-3 + 40e-6 / 2)) < 1e-18);
    assert_true(fabs(integrals.vv - 1e-3 * 0.05 * 0.05) < 2e-7);
    assert_true(fabs(impulse - 1e-3 * 0.004 * 640) < 1e-4);
}

// Whatever the start, a step that is allowed does not contain an end of contact.
static void no_step_passes_over_an_end(void **context) {
    (void)context;
    srand(5);
    int taken = 0, refused = 0;
    for (int trial = 0; trial < 1000; trial++) {
        const double e = 0.05 + 0.9 * rand() / RAND_MAX,
                     T = 1e-5 * pow(10, -1.0 * rand() / RAND_MAX);
        const Motion motion = stiff_motion(T, e);
        Hold hold = {0};
        hold_make(&hold, &motion, 0, 3e-4);
        const double x = 0.01 * (2.0 * rand() / RAND_MAX - 1),
                     v = 0.3 * (2.0 * rand() / RAND_MAX - 1);
        const double push = motion.omega2 * x + motion.damping * v;
        const double r = fabs(push) / motion.contact_omega2 * 3 * rand() / RAND_MAX;
        const double w =
            r * sqrt(motion.contact_omega2) * (2.0 * rand() / RAND_MAX - 1) * (trial % 3);
        const State start = {x, v, r, w};
        const Slice slice = {3.0 * rand() / RAND_MAX, 100.0 * rand() / RAND_MAX, 0};
        State end;
        double least;
        const HoldLevel *level = hold_step(&hold, &start, &slice, 3e-4, 1, 1e12, &end);
        if (level == NULL) {
            refused++;
            continue;
        }
        taken++;
        (void)by_arcs(&motion, start, &slice, level->length, &least);
        assert_true(least > 0);
    }
    assert_true(taken > 100 && refused > 100);
}

static void a_soft_contact_is_left_to_arcs(void **context) {
    (void)context;
    const Motion motion = stiff_motion(0.025, 0.61);
    Hold hold = {0};
    hold_make(&hold, &motion, 0, 1e-3);
    assert_false(hold.is_usable);
    State end;
    const State start = {0.001, 0, 0.001, 0};
    const Slice slice = {0, 0, 0};
    assert_null(hold_step(&hold, &start, &slice, 1e-3, 1, 0, &end));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_long_step_is_the_sum_of_its_arcs),
        cmocka_unit_test(no_step_passes_over_an_end),
        cmocka_unit_test(a_soft_contact_is_left_to_arcs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
