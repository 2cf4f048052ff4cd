// Swings with known answers: how exact the steps are and that no watched zero is passed.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "core/math/ode.h"

typedef struct Swing {
    double level; // watched: y - level, and its mirror
    size_t size;
} Swing;

static void rate(const void *context, double t, const double *y, double *out) {
    (void)context, (void)t;
    out[0] = y[1];
    out[1] = -y[0];
}

static void progress(const void *context, double t, const double *y, double *value, double *slope) {
    (void)t;
    const Swing *swing = context;
    value[0] = y[0] - swing->level;
    slope[0] = y[1];
    value[1] = 2 + y[0];
    slope[1] = NAN;
}

static Problem problem;
static const double scale[2] = {1, 1};

static Ode *swing_new(const Swing *swing) {
    const OdeSystem system = {
        .context = swing, .size = 2, .roots = 2, .rate = rate, .progress = progress};
    Ode *ode = ode_new(&system);
    assert_non_null(ode);
    return ode;
}

static void a_hundred_swings_stay_right(void **state) {
    (void)state;
    const Swing swing = {-2, 2};
    Ode *ode = swing_new(&swing);
    double t = 0, y[2] = {0, 1};
    int root;
    assert_int_equal(ode_start(ode, y, scale, 0.1, &problem), STATUS_OK);
    const double until = 200 * acos(-1);
    while (t < until) {
        assert_int_equal(ode_step(ode, until, &t, y, &root, &problem), STATUS_OK);
        assert_int_equal(root, ODE_NO_ROOT);
    }
    assert_true(t == until);
    assert_true(fabs(y[0]) < 1e-9 && fabs(y[1] - 1) < 1e-9);
    ode_free(ode);
}

static void a_tolerance_trades_errors_for_steps(void **state) {
    (void)state;
    const Swing swing = {-2, 2};
    double last_error = 0;
    size_t last_count = (size_t)-1;
    for (double tolerance = 1e-12; tolerance < 1e-2; tolerance *= 1e3) {
        const OdeSystem system = {.context = &swing,
                                  .size = 2,
                                  .roots = 2,
                                  .rate = rate,
                                  .progress = progress,
                                  .tolerance = tolerance};
        Ode *ode = ode_new(&system);
        assert_non_null(ode);
        double t = 0, y[2] = {0, 1};
        size_t count = 0;
        int root;
        assert_int_equal(ode_start(ode, y, scale, 0.01, &problem), STATUS_OK);
        for (; t < 50; count++)
            assert_int_equal(ode_step(ode, 50, &t, y, &root, &problem), STATUS_OK);
        const double error = fabs(y[0] - sin(50));
        assert_true(error < 1e3 * tolerance && error > 10 * last_error && count < last_count);
        last_error = error;
        last_count = count;
        ode_free(ode);
    }
}

// From 0 upwards: the start is no fall, the first one is at t = pi, or by the level below it later.
static void a_fall_is_located_to_rounding(void **state) {
    (void)state;
    static const double levels[] = {0, 0.5, -0.3, -0.999};
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
        const Swing swing = {levels[i], 2};
        Ode *ode = swing_new(&swing);
        double t = 0, y[2] = {0, 1};
        int root = ODE_NO_ROOT;
        assert_int_equal(ode_start(ode, y, scale, 0.1, &problem), STATUS_OK);
        while (root == ODE_NO_ROOT && t < 10)
            assert_int_equal(ode_step(ode, 100, &t, y, &root, &problem), STATUS_OK);
        assert_int_equal(root, 0);
        assert_true(fabs(t - (acos(-1) - asin(levels[i]))) < 1e-10);
        assert_true(fabs(y[0] - levels[i]) < 1e-13);
        // It goes on from there, and falls again a turn later.
        const double before = t;
        do
            assert_int_equal(ode_step(ode, 100, &t, y, &root, &problem), STATUS_OK);
        while (root == ODE_NO_ROOT && t < 20);
        assert_int_equal(root, 0);
        assert_true(fabs(t - before - 2 * acos(-1)) < 1e-10);
        ode_free(ode);
    }
}

// A dip of 1e-9 below zero, narrower than any step.
static void a_dip_within_a_step_is_seen(void **state) {
    (void)state;
    for (int miss = 0; miss < 2; miss++) {
        const Swing swing = {miss ? -1 - 1e-9 : -1 + 1e-9, 2};
        Ode *ode = swing_new(&swing);
        double t = 0, y[2] = {0, 1};
        int root = ODE_NO_ROOT;
        assert_int_equal(ode_start(ode, y, scale, 0.1, &problem), STATUS_OK);
        while (root == ODE_NO_ROOT && t < 10)
            assert_int_equal(ode_step(ode, 10, &t, y, &root, &problem), STATUS_OK);
        assert_int_equal(root, miss ? ODE_NO_ROOT : 0);
        if (!miss)
            assert_true(fabs(t - (1.5 * acos(-1) - acos(1 - 1e-9))) < 1e-6);
        ode_free(ode);
    }
}

static void numbers_without_end_are_a_problem(void **state) {
    (void)state;
    const Swing swing = {-2, 2};
    Ode *ode = swing_new(&swing);
    double t, y[2] = {NAN, 1};
    int root;
    problem_clear(&problem);
    Status status = ode_start(ode, y, scale, 0.1, &problem);
    for (int i = 0; i < 100 && status == STATUS_OK; i++)
        status = ode_step(ode, 1, &t, y, &root, &problem);
    assert_int_equal(status, STATUS_UNSTABLE);
    ode_free(ode);
    ode_free(NULL);
}

static void the_same_motion_has_the_same_bits_whatever_went_before(void **state) {
    (void)state;
    const Swing swing = {-0.3, 2};
    Ode *ode = swing_new(&swing);
    double t[2], y[2][2];
    for (int run = 0; run < 2; run++) {
        int root = ODE_NO_ROOT;
        t[run] = 0;
        y[run][0] = 0;
        y[run][1] = 1;
        assert_int_equal(ode_start(ode, y[run], scale, 0.1, &problem), STATUS_OK);
        while (root == ODE_NO_ROOT)
            assert_int_equal(ode_step(ode, 100, &t[run], y[run], &root, &problem), STATUS_OK);
    }
    assert_memory_equal(y[0], y[1], sizeof y[0]);
    assert_true(t[0] == t[1]);
    ode_free(ode);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_hundred_swings_stay_right),
        cmocka_unit_test(a_tolerance_trades_errors_for_steps),
        cmocka_unit_test(a_fall_is_located_to_rounding),
        cmocka_unit_test(a_dip_within_a_step_is_seen),
        cmocka_unit_test(numbers_without_end_are_a_problem),
        cmocka_unit_test(the_same_motion_has_the_same_bits_whatever_went_before),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
