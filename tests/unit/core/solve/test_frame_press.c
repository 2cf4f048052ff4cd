// Stiff stops at 1 kHz, where long contacts go by whole intervals, against 20 kHz, where they are
// arcs alone.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/solve/frame.h"
#include "tests/support/frames.h"

enum { STOREYS = 3, DAMPERS = 2, FINE = 20, COARSE_RATE = 1000, SAMPLES = 2001 };

typedef struct Choice {
    Separation separation;
    double odd; // how much more the first storey is damped
    bool is_sine;
    double steps_most; // arcs alone would be more
} Choice;

static const Choice choices[] = {
    {SEPARATION_ZERO_PENETRATION, 1, true, 80000},
    {SEPARATION_ZERO_PENETRATION, 5, false, 50000},
    {SEPARATION_ZERO_FORCE, 1, false, 40000},
    {SEPARATION_ZERO_FORCE, 5, true, 80000},
};

typedef struct Solved {
    Response response;
    double *x, *force; // top storey, first damper
    double steps;
} Solved;

static Solved solve(const Choice *choice, size_t fine) {
    const size_t count = (SAMPLES - 1) * fine + 1;
    Plan *plan = frames_new(STOREYS, DAMPERS, 2, COARSE_RATE * (double)fine);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.02);
    plan->damping[0] *= choice->odd;
    frames_damper(plan, 0, 2, 1, 0.01, 0.46, 0.0003);
    frames_damper(plan, 1, 0, 0.5, 0.02, 0.5, 0.0005);
    plan->separation = choice->separation;
    for (size_t i = 0; i < STOREYS; i++)
        plan->displacement[i] = choice->is_sine ? 0 : 0.02 * (double)(i + 1);
    const Base base = {.form = choice->is_sine ? BASE_SINE : BASE_STILL,
                       .amplitude = choice->is_sine ? 4 : 0,
                       .omega = choice->is_sine ? 9 : 0};
    Solved solved = {.x = calloc(2 * count, sizeof *solved.x)};
    assert_non_null(solved.x);
    solved.force = solved.x + count;
    const RunColumn columns[] = {{CHANNEL_DISPLACEMENT, STOREYS - 1, solved.x},
                                 {CHANNEL_CONTACT_FORCE, 0, solved.force}};
    Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = 2};
    Problem problem;
    problem_clear(&problem);
    if (frame_run(&run, &solved.response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    solved.steps = run.steps;
    plan_free(plan);
    return solved;
}

static void drop(Solved *solved) {
    response_clear(&solved->response);
    free(solved->x);
}

static void near(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance))
        fail_msg("%.17g is not %.17g to %.2g", a, b, tolerance);
}

static void whole_intervals_of_contact_agree_with_arcs(void **state) {
    (void)state;
    for (size_t c = 0; c < COUNT(choices); c++) {
        Solved coarse = solve(&choices[c], 1), fine = solve(&choices[c], FINE);
        const Peaks *peaks = &fine.response.peaks;
        for (size_t i = 0; i < SAMPLES; i++) {
            near(coarse.x[i], fine.x[i * FINE], 1e-10 * peaks->displacement);
            near(coarse.force[i], fine.force[i * FINE], 1e-8 * peaks->contact_force);
        }
        near(coarse.response.peaks.contact_force, peaks->contact_force,
             1e-9 * peaks->contact_force);
        assert_int_equal(coarse.response.impacts.count, fine.response.impacts.count);
        for (size_t i = 0; i < fine.response.impacts.count; i++) {
            const Impact *a = &coarse.response.impacts.at[i], *b = &fine.response.impacts.at[i];
            near(a->start, b->start, 1e-9);
            near(a->peak_force, b->peak_force, 1e-8 * peaks->contact_force);
            near(a->impulse, b->impulse, 1e-8 * fabs(b->impulse) + 1e-11);
            near(a->energy_lost, b->energy_lost, 1e-8 * fabs(b->energy_lost) + 1e-12);
        }
        assert_true(coarse.response.energy.residual < 1e-12);
        near(coarse.response.energy.contact, fine.response.energy.contact,
             1e-9 * fine.response.energy.contact);
        near(coarse.response.energy.structural_damping, fine.response.energy.structural_damping,
             1e-9 * fine.response.energy.structural_damping);
        near(coarse.response.energy.input, fine.response.energy.input,
             1e-9 * fabs(fine.response.energy.input));
        assert_true(coarse.steps < choices[c].steps_most);
        drop(&coarse);
        drop(&fine);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whole_intervals_of_contact_agree_with_arcs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
