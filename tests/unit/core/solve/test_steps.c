// The solvers that step: order of each where theory has one, the first order across contacts, every
// law and rule against the exact solver, honest estimates, and how they stop.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/solve/solvers.h"
#include "core/solve/steps_run.h"
#include "tests/support/frames.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"

static const Solver *const fixed[] = {&solver_precise, &solver_rk4, &solver_newmark};
static const Base still = {.form = BASE_STILL};

typedef struct Answer {
    double *values; // displacement of all storeys, storey after storey
    size_t count;
    Response response;
    double steps;
    Status status;
} Answer;

static Problem problem;

static Answer solve(const Solver *solver, double knob, const Plan *plan, const Base *base) {
    RunColumn columns[8];
    const AccuracyStep step = {.accuracy = {{&solver->kind}}, .step = knob};
    const AccuracyTolerance tolerance = {.accuracy = {{&solver->kind}}, .tolerance = knob};
    Answer answer = {.count = plan->storeys * plan->count};
    answer.values = calloc(answer.count, sizeof *answer.values);
    assert_non_null(answer.values);
    for (size_t i = 0; i < plan->storeys; i++)
        columns[i] = (RunColumn){CHANNEL_DISPLACEMENT, i, answer.values + i * plan->count};
    Run run = {.plan = plan,
               .base = base,
               .accuracy = solver == &solver_adaptive ? &tolerance.accuracy : &step.accuracy,
               .columns = columns,
               .column_count = plan->storeys};
    problem_clear(&problem);
    answer.status = solver->run(&run, &answer.response, &problem);
    answer.steps = run.steps;
    return answer;
}

static void answer_clear(Answer *answer) {
    free(answer->values);
    response_clear(&answer->response);
}

// The largest difference over the largest value.
static double difference(const double *a, const double *b, size_t count) {
    double most = 0, scale = 0;
    for (size_t i = 0; i < count; i++) {
        most = fmax(most, fabs(a[i] - b[i]));
        scale = fmax(scale, fabs(b[i]));
    }
    return most == 0 ? 0 : most / scale;
}

// How far a solver is from the exact one; *estimate is what it says itself.
static double miss(const Solver *solver, double knob, const Plan *plan, const Base *base,
                   double *estimate) {
    Answer exact = solve(&solver_exact, 0, plan, base), other = solve(solver, knob, plan, base);
    if (exact.status != STATUS_OK || other.status != STATUS_OK)
        fail_msg("%s: %s", solver->kind.name, problem.detail);
    const double error = difference(other.values, exact.values, exact.count);
    if (estimate != NULL)
        *estimate = other.response.has_trust ? other.response.error_estimate : NAN;
    answer_clear(&exact);
    answer_clear(&other);
    return error;
}

static Plan *swinging_frame(void) {
    Plan *plan = frames_new(3, 0, 2, 100);
    frames_uniform(plan, 10, 10 * 20 * 20, 0.02);
    plan->displacement[2] = 0.01;
    return plan;
}

static void between_contacts_errors_are_of_the_methods_order(void **state) {
    (void)state;
    const double orders[] = {2, 4, 2}; // of precise with a base that is a sine
    Plan *plan = swinging_frame();
    const Base sine = {.form = BASE_SINE, .amplitude = 1, .omega = 12};
    for (size_t i = 0; i < COUNT(fixed); i++) {
        double last = NAN;
        for (double step = 0.005; step > 0.0005; step /= 2) {
            double estimate;
            const double error = miss(fixed[i], step, plan, &sine, &estimate);
            if (!isnan(last) && fabs(log2(last / error) - orders[i]) > 0.15)
                fail_msg("%s: order %g at %g s", fixed[i]->kind.name, log2(last / error), step);
            assert_true(fabs(estimate / error - 1) < 0.2);
            last = error;
        }
    }
    plan_free(plan);
}

static void precise_is_exact_where_the_base_is_linear_in_a_step(void **state) {
    (void)state;
    Plan *plan = swinging_frame();
    double values[201];
    for (size_t i = 0; i < COUNT(values); i++)
        values[i] = sin(0.3 * (double)i) + 0.2 * sin(2.1 * (double)(i * i));
    const Base sampled = {
        .form = BASE_SAMPLED, .values = values, .count = COUNT(values), .interval = 0.01};
    for (double step = 0.01; step > 0.001; step /= 2) {
        assert_true(miss(&solver_precise, step, plan, &still, NULL) < 1e-13);
        assert_true(miss(&solver_precise, step, plan, &sampled, NULL) < 1e-13);
    }
    plan_free(plan);
}

// One contact; the worst of neighbouring steps, for how deep into a stop a step ends is chance.
static double envelope(const Solver *solver, const Plan *plan, double parts) {
    double worst = 0;
    for (double share = parts; share < 1.3 * parts; share = floor(1.02 * share + 1))
        worst = fmax(worst, miss(solver, 0.005 / share, plan, &still, NULL));
    return worst;
}

static void across_a_contact_errors_are_of_first_order(void **state) {
    (void)state;
    Plan *plan = frames_new(1, 1, 0.15, 200);
    frames_shear(plan, (double[]){1.35}, (double[]){865}, (double[]){1.092});
    frames_damper(plan, 0, 0, 0.1107, 0.015, 0.61, 0.025);
    plan->displacement[0] = 0.015;
    for (size_t i = 0; i < COUNT(fixed); i++) {
        const double coarse = envelope(fixed[i], plan, 40), fine = envelope(fixed[i], plan, 320);
        const double order = log2(coarse / fine) / 3;
        if (!(order > 0.8 && order < 1.2))
            fail_msg("%s: order %g across a contact (%g, %g)", fixed[i]->kind.name, order, coarse,
                     fine);
    }
    plan_free(plan);
}

typedef struct Case {
    const char *model;
    bool is_zero_force;
    double restitution, contact_time;
    int base; // free, random, sine
    double duration;
} Case;

// Short enough that errors have not grown to the motion's own size.
static const Case scenes[] = {
    {"spring_damper", false, 0.61, 0.025, 0, 1},  {"spring_damper", false, 0.44, 0.019, 0, 1},
    {"spring_damper", false, 0.53, 0.004, 0, 1},  {"spring_damper", false, 0.49, 0.003, 0, 1},
    {"spring_damper", false, 0.46, 0.0003, 0, 1}, {"spring_damper", false, 0.61, 0.025, 1, 1},
    {"spring_damper", false, 0.46, 0.0003, 1, 1}, {"spring_damper", false, 0.61, 0.025, 2, 1},
    {"spring_damper", false, 0.46, 0.0003, 2, 1}, {"impulse", false, 0.61, 0.025, 0, 1},
    {"impulse", false, 0.46, 0.0003, 0, 1},       {"impulse", false, 0.61, 0.025, 1, 1},
    {"impulse", false, 0.46, 0.0003, 1, 1},       {"spring_damper", true, 0.61, 0.025, 0, 1},
    {"spring_damper", true, 0.2, 0.003, 1, 1},    {"hertz", false, 1, 0.01, 0, 1},
    {"hunt_crossley", false, 0.5, 0.01, 1, 1},    {"lankarani_nikravesh", false, 0.6, 0.01, 0, 1},
    {"flores", false, 0.5, 0.004, 2, 1},          {"jankowski", false, 0.5, 0.01, 0, 1},
};

static void make_scene(const Case *scene, Simulation *simulation) {
    paper_scene(simulation, scene->restitution, scene->contact_time, scene->duration);
    paper_model(simulation, scene->model);
    if (scene->is_zero_force)
        ((Contact *)(void *)simulation->scene.contact)->separation = SEPARATION_ZERO_FORCE;
    if (scene->base == 1)
        paper_random(simulation, 1, 2);
    if (scene->base == 2)
        paper_sine(simulation, 1, 1);
    paper_no_psd(simulation);
}

static Outcome *run_scene(const Case *scene, const Solver *solver, double knob) {
    Simulation simulation;
    Outcome *outcome = NULL;
    make_scene(scene, &simulation);
    scene_choose(&simulation.accuracy, &solver_kinds, solver->kind.name);
    if (solver == &solver_adaptive)
        ((AccuracyTolerance *)(void *)simulation.accuracy)->tolerance = knob;
    else if (solver != &solver_exact)
        ((AccuracyStep *)(void *)simulation.accuracy)->step = knob;
    problem_clear(&problem);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s by %s: %s", scene->model, solver->kind.name, problem.detail);
    simulation_clear(&simulation);
    return outcome;
}

static double apart(const Outcome *a, const Outcome *b) {
    return difference(columns_find(&a->response.series, "displacement")->values,
                      columns_find(&b->response.series, "displacement")->values, b->response.count);
}

// Of each solver, at 10 us or 1e-9: what it may miss, and how much more than it says.
static const struct {
    const Solver *solver;
    double knob, error, understated, impulse;
} allowances[] = {
    {&solver_precise, 1e-5, 0.02, 3, 0.02},
    {&solver_rk4, 1e-5, 0.02, 3, 0.02},
    {&solver_newmark, 1e-5, 0.02, 3, 0.02},
    {&solver_adaptive, 1e-9, 1e-6, 2, 1e-6},
};

static void every_solver_comes_to_the_exact_ones_answer(void **state) {
    (void)state;
    for (size_t k = 0; k < COUNT(allowances); k++) {
        const Solver *solver = allowances[k].solver;
        for (size_t i = 0; i < COUNT(scenes); i++) {
            const bool is_power = strcmp(scenes[i].model, "spring_damper") != 0 &&
                                  strcmp(scenes[i].model, "impulse") != 0;
            if (is_power && solver->is_linear_only)
                continue;
            Outcome *exact = run_scene(&scenes[i], &solver_exact, 0);
            Outcome *other = run_scene(&scenes[i], solver, allowances[k].knob);
            const double error = apart(other, exact);
            print_message("%-9s %2zu %-14s error %.2g says %.2g impacts %zu of %zu residual %.2g\n",
                          solver->kind.name, i, scenes[i].model, error,
                          other->summary.error_estimate, (size_t)other->summary.impacts,
                          (size_t)exact->summary.impacts, other->summary.energy_residual);
            outcome_drop(exact);
            outcome_drop(other);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(between_contacts_errors_are_of_the_methods_order),
        cmocka_unit_test(precise_is_exact_where_the_base_is_linear_in_a_step),
        cmocka_unit_test(across_a_contact_errors_are_of_first_order),
        cmocka_unit_test(every_solver_comes_to_the_exact_ones_answer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
