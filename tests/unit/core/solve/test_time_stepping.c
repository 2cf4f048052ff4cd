// The solvers that step: order of each where theory has one, the first order across contacts, every
// law and rule against the exact solver, honest estimates, and how they stop.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/solver.h"
#include "core/solve/time_stepping.h"
#include "tests/support/frames.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

enum { EVERY = IMPACTD_SANITIZED ? 8 : 2 }; // of the cases

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
    const AccuracyStep step = {.accuracy = {{&solver->kind}, COUNT_ABSENT}, .step = knob};
    const AccuracyTolerance tolerance = {.accuracy = {{&solver->kind}, COUNT_ABSENT},
                                         .tolerance = knob};
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
    answer.status = solver->run(solver, &run, &answer.response, &problem);
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

// Damping may couple the modes, and whirl them.
static Plan *swinging_frame(bool is_whirling) {
    Plan *plan = frames_new(3, 0, 2, 100);
    frames_uniform(plan, 10, 10 * 20 * 20, 0.02);
    plan->displacement[2] = 0.01;
    if (is_whirling) {
        plan->damping[0] += 20;
        plan->damping[1] += 60;
        plan->damping[3] -= 60;
    }
    return plan;
}

TEST(between_contacts_errors_are_of_the_methods_order) {
    const double orders[] = {2, 4, 2}; // of precise with a base that is a sine
    const Base sine = {.form = BASE_SINE, .amplitude = 1, .omega = 12};
    for (size_t i = 0; i < 2 * COUNT(fixed); i++) {
        Plan *plan = swinging_frame(i % 2 == 1);
        const Solver *solver = fixed[i / 2];
        double last = NAN;
        for (double step = 0.005; step > 0.0005; step /= 2) {
            double estimate;
            const double error = miss(solver, step, plan, &sine, &estimate);
            if (!isnan(last) && fabs(log2(last / error) - orders[i / 2]) > 0.15)
                fail_msg("%s: order %g at %g s", solver->kind.name, log2(last / error), step);
            assert_true(fabs(estimate / error - 1) < 0.2);
            last = error;
        }
        plan_free(plan);
    }
}

TEST(between_contacts_energy_is_right_to_the_methods_order) {
    const double orders[] = {4, 4, 2};
    const Base sine = {.form = BASE_SINE, .amplitude = 1, .omega = 12};
    for (size_t i = 0; i < 2 * COUNT(fixed); i++) {
        Plan *plan = swinging_frame(i % 2 == 1);
        double residual[2];
        for (int k = 0; k < 2; k++) {
            Answer answer = solve(fixed[i / 2], 0.005 / (1 + k), plan, &sine);
            assert_int_equal(answer.status, STATUS_OK);
            residual[k] = answer.response.energy.residual;
            answer_clear(&answer);
        }
        const double order = log2(residual[0] / residual[1]);
        if (!(order > orders[i / 2] - 0.5 && residual[0] < 0.01))
            fail_msg("%s: residual %g, order %g", fixed[i / 2]->kind.name, residual[0], order);
        plan_free(plan);
    }
}

TEST(precise_is_exact_where_the_base_is_linear_in_a_step) {
    Plan *plan = swinging_frame(true);
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

TEST(across_a_contact_errors_are_of_first_order) {
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
    double knob, error, understated, force;
} allowances[] = {
    {&solver_precise, 1e-5, 0.02, 3, 0.08},
    {&solver_rk4, 1e-5, 0.02, 7, 0.02},
    {&solver_newmark, 1e-5, 0.02, 3, 0.08},
    {&solver_adaptive, 1e-9, 3e-7, 1.2, 1e-7},
};

TEST(every_solver_comes_to_the_exact_ones_answer) {
    for (size_t k = 0; k < COUNT(allowances); k++) {
        const Solver *solver = allowances[k].solver;
        for (size_t i = 0; i < COUNT(scenes); i += EVERY) {
            const bool is_power = strcmp(scenes[i].model, "spring_damper") != 0 &&
                                  strcmp(scenes[i].model, "impulse") != 0;
            if (is_power && solver->is_linear_only)
                continue;
            Outcome *exact = run_scene(&scenes[i], &solver_exact, 0);
            Outcome *other = run_scene(&scenes[i], solver, allowances[k].knob);
            const double error = apart(other, exact);
            const Summary *says = &other->summary, *is = &exact->summary;
            if (!(error <= allowances[k].error &&
                  error <= allowances[k].understated * says->error_estimate))
                fail_msg("%s misses scene %zu by %g and says %g", solver->kind.name, i, error,
                         says->error_estimate);
            assert_int_equal(says->impacts, is->impacts);
            assert_true(fabs(says->peak_contact_force - is->peak_contact_force) <=
                        allowances[k].force * is->peak_contact_force);
            assert_true(says->energy_residual < 0.01);
            outcome_unref(exact);
            outcome_unref(other);
        }
    }
}

// Two masses on one storey and one below, stiff enough to need their own steps.
static Plan *frame_with_dampers(bool is_impulse, Separation separation) {
    Plan *plan = frames_new(3, 3, 0.8, 200);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.02);
    frames_damper(plan, 0, 2, 1, 0.01, 0.6, is_impulse ? NAN : 0.02);
    frames_damper(plan, 1, 2, 0.5, 0.006, 0.4, is_impulse ? NAN : 0.01);
    frames_damper(plan, 2, 1, 1, 0.008, 0.7, is_impulse ? NAN : 0.015);
    plan->separation = separation;
    return plan;
}

TEST(frames_of_many_dampers_come_to_the_exact_answer) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 17};
    for (int i = 0; i < (IMPACTD_SANITIZED ? 1 : 3); i++) {
        Plan *plan = frame_with_dampers(i == 1, i == 2 ? SEPARATION_ZERO_FORCE
                                                       : SEPARATION_ZERO_PENETRATION);
        for (size_t k = 0; k < COUNT(fixed); k++) {
            double estimate;
            const double error = miss(fixed[k], 1e-5, plan, &sine, &estimate);
            if (!(error < 0.03 && error < 7 * estimate))
                fail_msg("%s misses by %g and says %g", fixed[k]->kind.name, error, estimate);
        }
        double estimate;
        const double error = miss(&solver_adaptive, 1e-11, plan, &sine, &estimate);
        assert_true(error < 2e-6 && error < 1.2 * estimate);
        plan_free(plan);
    }
}

// A base that pulls evenly presses the mass to a stop, on which it bounces and comes to rest.
TEST(a_pushed_mass_bounces_and_rests) {
    const double values[] = {3, 3, 3};
    const Base pull = {
        .form = BASE_SAMPLED, .values = (double *)(uintptr_t)values, .count = 3, .interval = 2};
    const Solver *const all[] = {&solver_precise, &solver_rk4, &solver_newmark, &solver_adaptive};
    Plan *plan = frames_new(1, 1, 2, 500);
    frames_shear(plan, (double[]){2}, (double[]){2000}, (double[]){8});
    frames_damper(plan, 0, 0, 0.5, 0.02, 0.5, NAN);
    for (size_t i = 0; i < COUNT(all); i++) {
        const bool is_adaptive = all[i] == &solver_adaptive;
        Answer exact = solve(&solver_exact, 0, plan, &pull);
        Answer other = solve(all[i], is_adaptive ? 1e-10 : 2e-6, plan, &pull);
        if (other.status != STATUS_OK)
            fail_msg("%s: %s", all[i]->kind.name, problem.detail);
        assert_true(difference(other.values, exact.values, exact.count) <
                    (is_adaptive ? 1e-6 : 2e-3));
        const Impacts *impacts = &other.response.impacts;
        const Impact *last = &impacts->at[impacts->count - 1],
                     *true_last = &exact.response.impacts.at[exact.response.impacts.count - 1];
        assert_int_equal(last->kind, IMPACT_RESTING);
        assert_int_equal(last->side, true_last->side);
        assert_true(isnan(last->end));
        assert_true(fabs(last->start - true_last->start) < 1e-3);
        assert_true(fabs(last->impulse - true_last->impulse) < 2e-3 * true_last->impulse);
        const double force = exact.response.peaks.contact_force;
        assert_true(fabs(other.response.peaks.contact_force - force) < 2e-3 * force);
        assert_true(fabs(last->peak_force - true_last->peak_force) < 2e-3 * true_last->peak_force);
        assert_true(other.response.energy.residual < 1e-5);
        answer_clear(&exact);
        answer_clear(&other);
    }
    plan_free(plan);
}

TEST(stops_without_clearance_hold_the_mass) {
    Plan *plan = frames_new(1, 1, 2, 500);
    frames_shear(plan, (double[]){2}, (double[]){2000}, (double[]){2});
    frames_damper(plan, 0, 0, 0.5, 0, 0.5, NAN);
    plan->displacement[0] = 0.01;
    for (size_t i = 0; i < COUNT(fixed); i++) {
        const double coarse = miss(fixed[i], 1e-4, plan, &still, NULL);
        const double fine = miss(fixed[i], 1e-5, plan, &still, NULL);
        assert_true(fine < 2e-3 && fine < coarse / 8);
    }
    assert_true(miss(&solver_adaptive, 1e-10, plan, &still, NULL) < 1e-8);
    plan_free(plan);
}

// A mass that leaves one buffer is in the other one at once.
TEST(buffers_without_room_between_them_serve_too) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 9};
    for (int i = 0; i < 2; i++) {
        Plan *plan = frames_new(1, 1, 1, 500);
        frames_shear(plan, (double[]){2}, (double[]){2000}, (double[]){2});
        frames_damper(plan, 0, 0, 0.5, 0, 0.8, 0.01);
        plan->displacement[0] = 0.01;
        plan->dampers[0].velocity = 0.1;
        plan->separation = i == 0 ? SEPARATION_ZERO_PENETRATION : SEPARATION_ZERO_FORCE;
        for (double tolerance = 1e-3; tolerance > 1e-13; tolerance /= 1e3) {
            double estimate;
            const double error = miss(&solver_adaptive, tolerance, plan, &sine, &estimate);
            if (!(error < fmax(1e-3 * tolerance, 1e-6) && error < fmax(4 * estimate, 1e-12)))
                fail_msg("%d: adaptive at %g misses by %g and says %g", i, tolerance, error,
                         estimate);
        }
        for (size_t k = 0; k < COUNT(fixed); k++)
            assert_true(miss(fixed[k], 1e-5, plan, &sine, NULL) < 1e-3);
        plan_free(plan);
    }
}

static void check_adaptive_estimates(const Plan *plan, const Base *base) {
    for (double tolerance = 1e-3; tolerance > 1e-9; tolerance /= 10) {
        double estimate;
        const double error = miss(&solver_adaptive, tolerance, plan, base, &estimate);
        if (!(error < 2 * estimate))
            fail_msg("adaptive at %g misses by %g and says %g", tolerance, error, estimate);
    }
}

// Nothing has moved before, so that the first difference of the two runs is larger than the motion.
TEST(a_first_touch_at_a_sample_leaves_the_estimate_honest) {
    Plan *plan = frames_new(1, 1, 1, 1000);
    frames_shear(plan, (double[]){1.35}, (double[]){865}, (double[]){1.092});
    frames_damper(plan, 0, 0, 0.1107, 0.01, 0.9, 0.003);
    plan->dampers[0].velocity = 0.5; // at the stop after 10 samples
    check_adaptive_estimates(plan, &still);
    plan_free(plan);
}

// Kinks limit the steps of both runs more than tolerance and sample interval do.
TEST(kinks_of_the_base_leave_the_estimate_honest) {
    double values[4000];
    for (size_t i = 0; i < COUNT(values); i++)
        values[i] = 0.3 * sin(2e-6 * (double)(i * i));
    const Base sampled = {
        .form = BASE_SAMPLED, .values = values, .count = COUNT(values), .interval = 0.0003};
    Plan *plan = frames_new(1, 1, 1, 1000);
    frames_shear(plan, (double[]){1.35}, (double[]){810}, (double[]){0});
    frames_damper(plan, 0, 0, 0.1107, 0.015, 1, 0.006);
    plan->dampers[0].velocity = 0.5;
    check_adaptive_estimates(plan, &sampled);
    plan_free(plan);
}

TEST(simultaneous_contacts_of_equal_dampers_end_together) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 17};
    Plan *plan = frames_new(3, 4, 1, 100);
    frames_uniform(plan, 10, 10 * 40 * 40, 0.02);
    for (size_t d = 0; d < 4; d++)
        frames_damper(plan, d, 2, 0.5, 0.006, 1, 0.006);
    check_adaptive_estimates(plan, &sine);
    plan_free(plan);
}

TEST(rests_on_one_storey_end_together) {
    const Base sine = {.form = BASE_SINE, .amplitude = 5, .omega = 14.5};
    Plan *plan = frames_new(1, 2, 0.6, 500);
    frames_uniform(plan, 2, 800, 0.0125);
    plan->form = CONTACT_IMPULSIVE;
    for (size_t d = 0; d < 2; d++) {
        frames_damper(plan, d, 0, d == 0 ? 0.05 : 0.033, 0.05, 0.3, NAN);
        plan->dampers[d].position = -0.025;
    }
    check_adaptive_estimates(plan, &sine);
    plan_free(plan);
}

// Runs with steps of twice the length may be late by the same time: that must not be taken for
// none.
TEST(few_impacts_are_not_taken_for_exact) {
    for (int i = 0; i < 40; i += EVERY) {
        Plan *plan = frames_new(1, 1, 0.2, 1000);
        frames_shear(plan, (double[]){2}, (double[]){2000}, (double[]){2});
        frames_damper(plan, 0, 0, 0.1, 0.004 + 1e-5 * i, 0.5, NAN);
        plan->displacement[0] = 0.01;
        for (double share = 1; share <= 16; share *= 2) {
            double estimate;
            const double error = miss(&solver_rk4, 1e-3 / share, plan, &still, &estimate);
            if (!(error < 5 * estimate))
                fail_msg("clearance %d, %g steps: %g, says %g", i, share, error, estimate);
        }
        plan_free(plan);
    }
}

TEST(a_step_that_cannot_be_stable_is_told) {
    Plan *plan = frames_new(1, 1, 2, 1000);
    frames_shear(plan, (double[]){1.35}, (double[]){865}, (double[]){1.092});
    frames_damper(plan, 0, 0, 0.1107, 0.015, 0.46, 0.0003);
    plan->displacement[0] = 0.015;
    Answer answer = solve(&solver_rk4, 1e-3, plan, &still);
    assert_int_equal(answer.status, STATUS_UNSTABLE);
    assert_non_null(strstr(problem.detail, "a contact has a rate of up to"));
    assert_non_null(strstr(problem.detail, "at most 0.000258 s"));
    answer_clear(&answer);
    answer = solve(&solver_newmark, 1e-3, plan, &still);
    assert_int_equal(answer.status, STATUS_UNSTABLE);
    assert_non_null(strstr(problem.detail, "step of 0.001 s"));
    answer_clear(&answer);
    plan->stiffness[0] = 1e8;
    answer = solve(&solver_rk4, 1e-3, plan, &still);
    assert_int_equal(answer.status, STATUS_UNSTABLE);
    assert_non_null(strstr(problem.detail, "the structure's motion has a rate of up to"));
    answer_clear(&answer);
    plan_free(plan);
}

// The paper's own 1 ms: 169 impacts too many in 10 s, and every number of the run says that it is
// wrong.
TEST(precise_at_a_millisecond_is_wrong_and_says_so) {
    const Case aluminium = {"spring_damper", false, 0.46, 0.0003, 0, 10};
    Outcome *exact = run_scene(&aluminium, &solver_exact, 0);
    Outcome *other = run_scene(&aluminium, &solver_precise, 1e-3);
    assert_true(other->summary.impacts > exact->summary.impacts + 100);
    assert_true(other->summary.error_estimate == 1);
    assert_true(other->summary.energy_residual > 1);
    bool is_warned = false;
    for (size_t i = 0; i < other->warnings.count; i++)
        is_warned = is_warned || strcmp(other->warnings.at[i].pointer, "/accuracy") == 0;
    assert_true(is_warned);
    outcome_unref(exact);
    outcome_unref(other);
}

static const Decision *decision(const Outcome *outcome, const char *about) {
    for (size_t i = 0; i < outcome->plan.decisions.count; i++)
        if (strcmp(outcome->plan.decisions.at[i].about, about) == 0)
            return &outcome->plan.decisions.at[i];
    fail_msg("no decision about %s", about);
    return NULL;
}

TEST(the_plan_says_which_step_and_why) {
    const Case aluminium = {"spring_damper", false, 0.46, 0.0003, 0, 0.1};
    const struct {
        double asked, step;
        const char *chose;
    } cases[] = {
        {NAN, 0.001 / 100, "contact"}, // a 30th of 0.3 ms is a hundredth of 1 ms
        {1e-4, 1e-4, "asked"},
        {0.9e-4, 0.001 / 12, "asked"},
        {0.5, 1e-3, "asked"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Outcome *outcome = run_scene(&aluminium, &solver_precise, cases[i].asked);
        const Decision *step = decision(outcome, "step");
        assert_string_equal(step->chose, cases[i].chose);
        assert_true(fabs(step->value - cases[i].step) < 1e-3 * cases[i].step);
        assert_non_null(strstr(decision(outcome, "contact_switching")->why, "first order"));
        outcome_unref(outcome);
    }
    Outcome *outcome = run_scene(&aluminium, &solver_adaptive, 1e-5);
    assert_true(decision(outcome, "tolerance")->value == 1e-5);
    outcome_unref(outcome);
}

TEST(what_a_run_costs_is_predicted) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 17};
    for (const Solver *const *at = solvers; *at != NULL; at++) {
        const Solver *solver = *at;
        if (solver->cost == NULL)
            continue;
        for (int i = 0; i < 2; i++) {
            Plan *plan = frame_with_dampers(i == 1, SEPARATION_ZERO_PENETRATION);
            const double knob = solver == &solver_adaptive ? 1e-8 : 1e-4;
            const AccuracyStep step = {.step = knob};
            const AccuracyTolerance tolerance = {.tolerance = knob};
            Answer answer = solve(solver, knob, plan, &sine);
            const double impacts = (double)answer.response.impact_count;
            // Between zero force and zero penetration a contact turns by half a circle.
            const SolverDemand demand = {
                .base_rate = sine.omega, .impacts = impacts, .radians = 3.14 * impacts};
            const double predicted = solver->cost(
                solver, solver == &solver_adaptive ? &tolerance.accuracy : &step.accuracy, &demand,
                plan);
            // Where masses chatter an event takes fewer steps of the adaptive solver.
            const double factor = i == 1 && solver == &solver_adaptive ? 3 : 2;
            if (!(answer.steps > predicted / factor && answer.steps < factor * predicted))
                fail_msg("%s: %g steps, predicted %g", solver->kind.name, answer.steps, predicted);
            answer_clear(&answer);
            plan_free(plan);
        }
    }
}

typedef struct Watcher {
    int looks, stops_at;
    double last;
} Watcher;

static bool look(void *context, double fraction) {
    Watcher *watcher = context;
    assert_true(fraction >= 0 && fraction <= 1 + 1e-9);
    watcher->last = fraction;
    return ++watcher->looks < watcher->stops_at;
}

TEST(runs_stop_when_told_or_at_a_limit) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 17};
    Plan *plan = frame_with_dampers(false, SEPARATION_ZERO_PENETRATION);
    for (const Solver *const *at = solvers; *at != NULL; at++) {
        if ((*at)->cost == NULL)
            continue;
        const bool is_adaptive = *at == &solver_adaptive;
        const AccuracyStep step = {.step = 1e-6};
        const AccuracyTolerance tolerance = {.tolerance = 1e-12};
        Watcher watcher = {.stops_at = 3};
        const Progress progress = {&watcher, look};
        Run run = {.plan = plan,
                   .base = &sine,
                   .progress = &progress,
                   .accuracy = is_adaptive ? &tolerance.accuracy : &step.accuracy};
        Response response = {0};
        problem_clear(&problem);
        assert_int_equal((*at)->run(*at, &run, &response, &problem), STATUS_CANCELLED);
        assert_true(watcher.looks <= 4 && watcher.last < 0.9);
        response_clear(&response);
        response = (Response){0};
        run.progress = NULL;
        run.steps = 0;
        run.steps_max = 30000;
        problem_clear(&problem);
        assert_int_equal((*at)->run(*at, &run, &response, &problem), STATUS_LIMIT);
        assert_true(run.steps < 200000);
        response_clear(&response);
        response = (Response){0};
        run.steps_max = 0;
        run.impacts_max = 1;
        problem_clear(&problem);
        assert_int_equal((*at)->run(*at, &run, &response, &problem), STATUS_LIMIT);
        assert_non_null(strstr(problem.detail, "impacts"));
        response_clear(&response);
    }
    plan_free(plan);
}

TEST(the_same_run_gives_the_same_bytes) {
    const Base sine = {.form = BASE_SINE, .amplitude = 2, .omega = 17};
    Plan *plan = frame_with_dampers(false, SEPARATION_ZERO_FORCE);
    for (const Solver *const *at = solvers; *at != NULL; at++) {
        if ((*at)->cost == NULL)
            continue;
        const double knob = *at == &solver_adaptive ? 1e-6 : 1e-4;
        Answer a = solve(*at, knob, plan, &sine), b = solve(*at, knob, plan, &sine);
        assert_memory_equal(a.values, b.values, a.count * sizeof *a.values);
        assert_int_equal(a.response.impacts.count, b.response.impacts.count);
        for (size_t i = 0; i < a.response.impacts.count; i++)
            assert_true(a.response.impacts.at[i].impulse == b.response.impacts.at[i].impulse);
        assert_true(a.response.error_estimate == b.response.error_estimate);
        assert_true(a.steps == b.steps);
        answer_clear(&a);
        answer_clear(&b);
    }
    plan_free(plan);
}

TEST(precise_refuses_power_laws) {
    const Case hertz = {"hertz", false, 1, 0.01, 0, 1};
    Simulation simulation;
    make_scene(&hertz, &simulation);
    scene_choose(&simulation.accuracy, &solver_kinds, "precise");
    problem_clear(&problem);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/accuracy/solver");
    assert_non_null(strstr(problem.faults[0].detail, "hertz"));
    simulation_clear(&simulation);
}
