// Damping that is not symmetric: two equal, equally held directions coupled by a gyroscope, as a
// rotor has them. With z = x_1 + i x_2: z'' + (c - i g) z' + k z = 0.
#include <complex.h>
#include <math.h>

#include "core/solve/exact.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

static const double STIFFNESS = 300, VISCOUS = 0.4, GYROSCOPIC = 9;

static Plan *rotor(size_t dampers) {
    Plan *plan = frames_new(2, dampers, 5, 200);
    for (size_t i = 0; i < 2; i++) {
        plan->mass[3 * i] = 1;
        plan->stiffness[3 * i] = STIFFNESS;
        plan->damping[3 * i] = VISCOUS;
    }
    plan->damping[1] = GYROSCOPIC;
    plan->damping[2] = -GYROSCOPIC;
    plan->displacement[0] = 0.01;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(modes_make(&plan->modes, 2, plan->mass, plan->stiffness, plan->damping,
                                plan->influence, &problem),
                     STATUS_OK);
    return plan;
}

static Response run(const Plan *plan, double *x_1, double *x_2) {
    static const Base still = {.form = BASE_STILL};
    const RunColumn columns[] = {{CHANNEL_DISPLACEMENT, 0, x_1}, {CHANNEL_DISPLACEMENT, 1, x_2}};
    Run with = {.plan = plan, .base = &still, .columns = columns, .column_count = 2};
    Response response = {0};
    Problem problem;
    problem_clear(&problem);
    if (exact_run_engine(&with, &response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return response;
}

TEST(a_rotor_whirls_as_its_closed_form_does) {
    static double x_1[1001], x_2[1001];
    Plan *plan = rotor(0);
    Response response = run(plan, x_1, x_2);
    const double complex half = (VISCOUS - I * GYROSCOPIC) / 2,
                         root = csqrt(half * half - STIFFNESS), a = -half + root, b = -half - root;
    for (size_t i = 0; i < plan->count; i++) {
        const double t = (double)i / 200;
        const double complex z = 0.01 * (a * cexp(b * t) - b * cexp(a * t)) / (a - b);
        assert_true(fabs(x_1[i] - creal(z)) < 1e-13 * 0.01 * 10);
        assert_true(fabs(x_2[i] - cimag(z)) < 1e-13 * 0.01 * 10);
    }
    assert_true(response.energy.residual < 1e-13);
    response_clear(&response);
    plan_free(plan);
}

TEST(energy_is_kept_where_a_rotor_has_a_damper) {
    static double x_1[1001], x_2[1001];
    Plan *plan = rotor(1);
    frames_damper(plan, 0, 1, 0.1, 0.004, 0.6, 0.01);
    Response response = run(plan, x_1, x_2);
    assert_true(response.impacts.count > 3);
    assert_true(response.energy.residual < 1e-12);
    response_clear(&response);
    plan_free(plan);
}
