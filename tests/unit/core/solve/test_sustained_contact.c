// Contacts that go by whole intervals against the same ones by arcs alone: that is how stops go
// whose parameters depend on the approach speed, here in name only.
#include <math.h>
#include <stdlib.h>

#include "core/contact/contact.h"
#include "core/solve/exact.h"
#include "tests/support/frames.h"
#include "tests/support/test.h"

enum { STOREYS = 3, DAMPERS = 2, SAMPLES = 2001 };

typedef struct Choice {
    Separation separation;
    double odd; // how much more the first storey is damped
    bool is_sine;
    double restitution, contact_time, clearance; // of the first damper
    double share;                                // of the steps that arcs alone would be
} Choice;

static const Choice choices[] = {
    {SEPARATION_ZERO_PENETRATION, 1, true, 0.46, 0.0003, 0.01, 0.5},
    {SEPARATION_ZERO_PENETRATION, 5, false, 0.46, 0.0003, 0.01, 0.5},
    {SEPARATION_ZERO_FORCE, 1, false, 0.46, 0.0003, 0.01, 0.5},
    {SEPARATION_ZERO_FORCE, 5, true, 0.46, 0.0003, 0.01, 0.5},
    {SEPARATION_ZERO_PENETRATION, 1, true, 0.5, 1e-5, 0.01, 0.5},
    {SEPARATION_ZERO_FORCE, 5, true, 0.5, 1e-5, 0.01, 0.5},
    {SEPARATION_ZERO_PENETRATION, 5, true, 0.61, 0.025, 0.01, 0.9},
    {SEPARATION_ZERO_FORCE, 1, false, 0.3, 0.01, 0.01, 0.8},
    // Pressed to one stop and then to the other, all the time.
    {SEPARATION_ZERO_PENETRATION, 1, true, 0.87, 2e-5, 0, 0.2},
    {SEPARATION_ZERO_FORCE, 5, true, 0.25, 5e-5, 0, 0.2},
};

typedef struct Solved {
    Response response;
    double *x, *force; // top storey, first damper
    double steps;
} Solved;

static void vary_in_name(PlanDamper *damper, const ContactRow *row) {
    for (int side = 0; side < 2; side++) {
        ContactNumbers numbers = {.restitution = NAN,
                                  .contact_time = NAN,
                                  .stiffness = NAN,
                                  .damping = NAN,
                                  .exponent = NAN,
                                  .rows = {malloc(sizeof *row), 1}}; // the plan's from now on
        assert_non_null(numbers.rows.at);
        *numbers.rows.at = *row;
        damper->stops[side] =
            contact_stop_prepare(&contact_spring_damper, SEPARATION_ZERO_PENETRATION,
                                 damper->effective_mass, damper->effective_mass, &numbers);
        damper->stops[side].parameters.stiffness = NAN;
    }
}

static Solved solve(const Choice *choice, bool is_by_arcs) {
    ContactRow rows[DAMPERS] = {{1, choice->restitution, choice->contact_time}, {1, 0.5, 0.0005}};
    Plan *plan = frames_new(STOREYS, DAMPERS, 2, 1000);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.02);
    plan->damping[0] *= choice->odd;
    frames_damper(plan, 0, 2, 1, choice->clearance, rows[0].restitution, rows[0].contact_time);
    frames_damper(plan, 1, 0, 0.5, 0.02, rows[1].restitution, rows[1].contact_time);
    for (size_t d = 0; d < DAMPERS && is_by_arcs; d++)
        vary_in_name(&plan->dampers[d], &rows[d]);
    plan->separation = choice->separation;
    for (size_t i = 0; i < STOREYS; i++)
        plan->displacement[i] = choice->is_sine ? 0 : 0.02 * (double)(i + 1);
    const Base base = {.form = choice->is_sine ? BASE_SINE : BASE_STILL,
                       .amplitude = choice->is_sine ? 4 : 0,
                       .omega = choice->is_sine ? 9 : 0};
    Solved solved = {.x = calloc(2 * SAMPLES, sizeof *solved.x)};
    assert_non_null(solved.x);
    solved.force = solved.x + SAMPLES;
    const RunColumn columns[] = {{CHANNEL_DISPLACEMENT, STOREYS - 1, solved.x},
                                 {CHANNEL_CONTACT_FORCE, 0, solved.force}};
    Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = 2};
    Problem problem;
    problem_clear(&problem);
    if (exact_run_engine(&run, &solved.response, &problem) != STATUS_OK)
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

TEST(whole_intervals_of_contact_agree_with_arcs) {
    for (size_t c = 0; c < COUNT(choices); c += IMPACTD_SANITIZED ? 2 : 1) {
        Solved whole = solve(&choices[c], false), arcs = solve(&choices[c], true);
        const Peaks *peaks = &arcs.response.peaks;
        for (size_t i = 0; i < SAMPLES; i++) {
            near(whole.x[i], arcs.x[i], 1e-10 * peaks->displacement);
            near(whole.force[i], arcs.force[i], 1e-8 * peaks->contact_force);
        }
        near(whole.response.peaks.contact_force, peaks->contact_force,
             1e-11 * peaks->contact_force);
        assert_int_equal(whole.response.impacts.count, arcs.response.impacts.count);
        for (size_t i = 0; i < arcs.response.impacts.count; i++) {
            const Impact *a = &whole.response.impacts.at[i], *b = &arcs.response.impacts.at[i];
            near(a->start, b->start, 1e-9);
            near(a->peak_force, b->peak_force, 1e-8 * peaks->contact_force);
            near(a->impulse, b->impulse, 1e-8 * fabs(b->impulse) + 1e-11);
            near(a->energy_lost, b->energy_lost, 1e-8 * fabs(b->energy_lost) + 1e-12);
        }
        assert_true(whole.response.energy.residual < 1e-12);
        near(whole.response.energy.contact, arcs.response.energy.contact,
             1e-9 * arcs.response.energy.contact);
        near(whole.response.energy.structural_damping, arcs.response.energy.structural_damping,
             1e-9 * arcs.response.energy.structural_damping);
        near(whole.response.energy.input, arcs.response.energy.input,
             1e-9 * fabs(arcs.response.energy.input));
        assert_true(whole.steps < choices[c].share * arcs.steps);
        drop(&whole);
        drop(&arcs);
    }
}
