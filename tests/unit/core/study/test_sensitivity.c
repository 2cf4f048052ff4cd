

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/sensitivity.h"
#include "core/study/study.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static SensitivityStudy *study_of(StudyRequest *inquiry) {
    return (SensitivityStudy *)(void *)inquiry->study;
}

static StudyRequest study_request_make(double restitution, double contact_time, double duration) {
    StudyRequest inquiry = {0};
    paper_scene(&inquiry.simulation, restitution, contact_time, duration);
    inquiry.study = variant_new(&study_sensitivity.kind);
    assert_non_null(inquiry.study);
    problem_clear(&problem);
    return inquiry;
}

static void complete(StudyRequest *inquiry) {
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
}

static Sensitivity *make(const StudyRequest *inquiry) {
    const StudyTools tools = {0};
    Variant *made = NULL;
    if (study_run(inquiry->study, &inquiry->simulation, &tools, &made, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return (Sensitivity *)(void *)made;
}

static void clear(StudyRequest *inquiry, Sensitivity *answer) {
    variant_free(&answer->variant);
    study_request_clear(inquiry);
}

static void assert_near(double is, double should, double within) {
    if (!(fabs(is - should) <= within))
        fail_msg("%.17g should be %.17g within %g", is, should, within);
}

static const SensitivitySlope *slope_of(const Sensitivity *answer, int parameter, int metric) {
    for (size_t i = 0; i < answer->response.count; i++)
        for (size_t k = 0; k < answer->response.at[i].slopes.count; k++)
            if (answer->response.at[i].parameter == parameter &&
                answer->response.at[i].slopes.at[k].metric == metric)
                return &answer->response.at[i].slopes.at[k];
    fail_msg("there is no slope of %d by %d", metric, parameter);
    return NULL;
}

// The scene with e, T_c and m in other numbers; what a plan derives of it.
static Derived derive(double restitution, double contact_time, double mass) {
    Simulation simulation;
    PlanReport report;
    paper_scene(&simulation, restitution, contact_time, 1);
    simulation.scene.dampers.at[0].mass = mass;
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_plan(&simulation, &report, &problem), STATUS_OK);
    Derived derived = report.derived.at[0];
    derived.material = NULL;
    fields_clear(plan_report_fields, &report);
    simulation_clear(&simulation);
    return derived;
}

TEST(closed_forms_are_those_of_a_plans_differences) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 1);
    complete(&inquiry);
    Sensitivity *answer = make(&inquiry);
    assert_int_equal(answer->contact.count, 2);
    const SensitivityStop *stop = &answer->contact.at[0];
    const double h = 1e-5, m = inquiry.simulation.scene.dampers.at[0].mass;
    const Derived more = derive(0.61 * exp(h), 0.025, m), less = derive(0.61 * exp(-h), 0.025, m);
    assert_near(log(more.stiffness / less.stiffness) / (2 * h), stop->stiffness_by_restitution,
                1e-8);
    assert_near(log(more.damping / less.damping) / (2 * h), stop->damping_by_restitution, 1e-8);
    const Derived big = derive(0.61, 0.025, m * exp(h)), small = derive(0.61, 0.025, m * exp(-h));
    assert_near(log(big.stiffness / small.stiffness) / (2 * h), stop->by_damper_mass, 1e-8);
    assert_near(log(big.damping / small.damping) / (2 * h), stop->by_damper_mass, 1e-8);
    assert_near(stop->by_damper_mass + stop->by_structure_mass, 1, 1e-15);
    assert_true(stop->why == NULL && isnan(stop->stiffness_deviation));
    clear(&inquiry, answer);
}

TEST(slopes_are_central_differences_of_the_summary) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 1);
    study_of(&inquiry)->step = 0.02;
    complete(&inquiry);
    assert_int_equal(study_of(&inquiry)->parameters.count, 4);
    Sensitivity *answer = make(&inquiry);
    const double h = 0.01; // the middle one
    double forces[2];
    for (int i = 0; i < 2; i++) {
        Simulation simulation;
        Outcome *outcome;
        paper_scene(&simulation, 0.61, 0.025 * (i == 0 ? 1 - h : 1 + h), 1);
        assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
        assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem),
                         STATUS_OK);
        forces[i] = outcome->summary.peak_contact_force;
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
    const SensitivitySlope *slope =
        slope_of(answer, SENSITIVITY_CONTACT_TIME, STATISTICS_PEAK_CONTACT_FORCE);
    assert_near(slope->derivative,
                (forces[1] - forces[0]) / answer->summary.peak_contact_force / (2 * h), 1e-12);
    assert_true(slope->is_settled && slope->spread < 0.01 && slope->derivative < -0.5);
    assert_true(
        slope_of(answer, SENSITIVITY_RESTITUTION, STATISTICS_PEAK_DISPLACEMENT)->is_settled);
    assert_true(!answer->is_chaotic && answer->runs == 0 && answer->table.count == 0);
    clear(&inquiry, answer);
}

TEST(chaos_is_told_and_its_slopes_do_not_settle) {
    StudyRequest inquiry = study_request_make(0.46, 0.0003, 40);
    paper_random(&inquiry.simulation, 1, 5);
    complete(&inquiry);
    Sensitivity *answer = make(&inquiry);
    assert_true(answer->is_chaotic && strstr(answer->why, "rounding alone") != NULL);
    const SensitivitySlope *slope =
        slope_of(answer, SENSITIVITY_RESTITUTION, STATISTICS_RMS_ACCELERATION);
    assert_true(!slope->is_settled && slope->spread > 0.1);
    clear(&inquiry, answer);
}

static void draw(const SensitivityStudy *study, const StudyRequest *inquiry, uint64_t run,
                 Simulation *member, double factors[2]) {
    Reals drawn[2] = {{NULL, 0}, {NULL, 0}};
    assert_int_equal(perturbation_draw(&study->uncertainty, study->seed, &inquiry->simulation, run,
                                       member, &drawn[0], &drawn[1]),
                     STATUS_OK);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(drawn[i].count, 1);
        factors[i] = drawn[i].at[0];
        free(drawn[i].at);
    }
}

TEST(draws_have_the_stated_spread_and_stay_below_one) {
    StudyRequest inquiry = study_request_make(0.9, 0.025, 1);
    SensitivityStudy *study = study_of(&inquiry);
    study->uncertainty.restitution_deviation = 0.02;
    study->uncertainty.contact_time_deviation = 0.1;
    complete(&inquiry);
    assert_int_equal(study->runs, 200);
    Simulation member;
    assert_int_equal(fields_copy(simulation_fields, &inquiry.simulation, &member), STATUS_OK);
    double sums[2] = {0}, squares[2] = {0};
    enum { DRAWN = 20000 };
    for (uint64_t run = 1; run <= DRAWN; run++) {
        double factors[2];
        draw(study, &inquiry, run, &member, factors);
        const Buffer *buffer = &member.scene.dampers.at[0].buffer;
        assert_true(buffer->restitution == 0.9 * factors[0] && buffer->restitution <= 1);
        assert_true(buffer->contact_time == 0.025 * factors[1]);
        for (int i = 0; i < 2; i++) {
            sums[i] += factors[i];
            squares[i] += (factors[i] - 1) * (factors[i] - 1);
        }
    }
    assert_near(sums[0] / DRAWN, 1, 1e-3);
    assert_near(sums[1] / DRAWN, 1, 3e-3);
    assert_near(sqrt(squares[0] / DRAWN), 0.02, 5e-4);
    assert_near(sqrt(squares[1] / DRAWN), 0.1, 2e-3);
    study->uncertainty.restitution_deviation = 0.5; // most of the upper half is beyond 1
    for (uint64_t run = 1; run <= 200; run++) {
        double factors[2];
        draw(study, &inquiry, run, &member, factors);
        assert_true(member.scene.dampers.at[0].buffer.restitution <= 1);
    }
    simulation_clear(&member);
    study_request_clear(&inquiry);
}

// Two stops, each with a material of its own.
static StudyRequest study_request_of_materials(void) {
    StudyRequest inquiry = study_request_make(0.6, 0.025, 1);
    Damper *damper = &inquiry.simulation.scene.dampers.at[0];
    assert_int_equal(fields_copy(buffer_fields, &damper->buffer, &damper->left_buffer), STATUS_OK);
    buffer_move(&damper->right_buffer, &damper->buffer);
    damper->left_buffer.material = strdup("felt@2");
    damper->right_buffer.material = strdup("cork@1");
    damper->left_buffer.test.restitution_deviation = 0.05;
    damper->right_buffer.test.contact_time_deviation = 0.2;
    return inquiry;
}

TEST(each_buffer_is_drawn_by_what_its_material_tells) {
    StudyRequest inquiry = study_request_of_materials();
    SensitivityStudy *study = study_of(&inquiry);
    study->runs = 40;
    complete(&inquiry);
    assert_true(isnan(study->uncertainty.restitution_deviation) &&
                isnan(study->uncertainty.contact_time_deviation));
    assert_int_equal(study->uncertainty.spread.count, 2);
    Sensitivity *answer = make(&inquiry);
    double most[2] = {0};
    for (size_t i = 0; i < answer->table.count; i++) {
        const RunRecord *draw = &answer->table.at[i];
        assert_int_equal(draw->restitution.count, 2);
        assert_true(draw->contact_time.at[0] == 1 && draw->restitution.at[1] == 1); // they are sure
        most[0] = fmax(most[0], fabs(draw->restitution.at[0] - 1));
        most[1] = fmax(most[1], fabs(draw->contact_time.at[1] - 1));
    }
    assert_true(most[0] > 0.05 && most[0] < 0.25 && most[1] > 0.2 && most[1] < 1);
    assert_int_equal(answer->uncertainty.spread.count, 2);
    assert_string_equal(answer->uncertainty.spread.at[0].source, "felt@2");
    assert_int_equal(answer->uncertainty.spread.at[1].buffer, SENSITIVITY_RIGHT);
    // And so are what follows for k_b and c_b.
    const SensitivityStop *left = &answer->contact.at[0], *right = &answer->contact.at[1];
    assert_near(left->stiffness_deviation, fabs(left->stiffness_by_restitution) * 0.05, 1e-15);
    assert_near(right->stiffness_deviation, fabs(right->stiffness_by_contact_time) * 0.2, 1e-15);
    clear(&inquiry, answer);
}

TEST(a_number_for_all_buffers_wins_over_their_materials) {
    StudyRequest inquiry = study_request_of_materials();
    SensitivityStudy *study = study_of(&inquiry);
    study->uncertainty.restitution_deviation = 0;
    study->uncertainty.contact_time_deviation = 0.01;
    complete(&inquiry);
    assert_int_equal(study->uncertainty.spread.count, 0);
    for (int place = SENSITIVITY_LEFT; place <= SENSITIVITY_RIGHT; place++) {
        const SensitivityBuffer buffer = (SensitivityBuffer)place;
        assert_true(uncertainty_find(&study->uncertainty, 0, buffer, SENSITIVITY_RESTITUTION) == 0);
        assert_true(uncertainty_find(&study->uncertainty, 0, buffer, SENSITIVITY_CONTACT_TIME) ==
                    0.01);
    }
    study_request_clear(&inquiry);
}

TEST(a_drawn_run_is_the_scene_with_its_numbers) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 2);
    SensitivityStudy *study = study_of(&inquiry);
    study->uncertainty.contact_time_deviation = 0.1;
    study->runs = 20;
    study->seed = 7;
    complete(&inquiry);
    Sensitivity *answer = make(&inquiry);
    assert_true(answer->made == 20 && answer->failed == 0 && answer->table.count == 20);
    const RunRecord *draw = &answer->table.at[11];
    assert_true(draw->number == 12 && draw->restitution.count == 1 && draw->restitution.at[0] == 1);
    Simulation simulation;
    Outcome *outcome;
    paper_scene(&simulation, 0.61, 0.025 * draw->contact_time.at[0], 2);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    assert_memory_equal(&draw->summary, &outcome->summary, sizeof draw->summary);
    outcome_unref(outcome);
    simulation_clear(&simulation);
    const RunStatistic *band = &answer->statistics.at[STATISTICS_RMS_DISPLACEMENT];
    assert_true(band->count == 20 && band->q05 <= band->median && band->median <= band->q95);
    assert_true(band->minimum <= band->q05 && band->q95 <= band->maximum);
    const RunSpectrum *spectrum = &answer->spectra.at[0];
    for (size_t k = 1; k < answer->frequency.count; k += 97)
        assert_true(spectrum->q05.at[k] <= spectrum->median.at[k] &&
                    spectrum->median.at[k] <= spectrum->q95.at[k]);
    // The same seed gives the same numbers, another one others.
    Sensitivity *again = make(&inquiry);
    assert_memory_equal(&again->table.at[11].summary, &draw->summary, sizeof draw->summary);
    variant_free(&again->variant);
    study->seed = 8;
    again = make(&inquiry);
    assert_true(again->table.at[11].contact_time.at[0] != draw->contact_time.at[0]);
    variant_free(&again->variant);
    clear(&inquiry, answer);
}

TEST(the_papers_errors_move_the_response_as_it_is_stated) {
    // 10 % in T_c with 15 % in e: the peak force moves by 9 to 14 %.
    StudyRequest inquiry = study_request_make(0.61, 0.025, 10);
    complete(&inquiry);
    Sensitivity *answer = make(&inquiry);
    const double moved =
        0.1 *
            slope_of(answer, SENSITIVITY_CONTACT_TIME, STATISTICS_PEAK_CONTACT_FORCE)->derivative -
        0.15 * slope_of(answer, SENSITIVITY_RESTITUTION, STATISTICS_PEAK_CONTACT_FORCE)->derivative;
    assert_true(moved < -0.09 && moved > -0.14);
    clear(&inquiry, answer);
}

TEST(what_has_no_closed_form_says_why) {
    StudyRequest inquiry = study_request_make(0.61, (double)NAN, 1);
    complete(&inquiry);
    Sensitivity *answer = make(&inquiry);
    assert_non_null(strstr(answer->contact.at[1].why, "impulses have no stiffness"));
    // Impulses have no force either.
    assert_true(answer->response.at[0].slopes.count + 1 == STATISTICS_USUAL);
    clear(&inquiry, answer);
    inquiry = study_request_make(0.61, 0.025, 1);
    paper_model(&inquiry.simulation, "flores");
    complete(&inquiry);
    answer = make(&inquiry);
    assert_non_null(strstr(answer->contact.at[0].why, "power law"));
    clear(&inquiry, answer);
}

TEST(a_restitution_at_its_end_is_stepped_to_one_side) {
    StudyRequest inquiry = study_request_make(1, 0.025, 1);
    complete(&inquiry);
    assert_true(perturbation_max_step(&inquiry.simulation, SENSITIVITY_RESTITUTION, 0.01) == 0);
    assert_true(perturbation_max_step(&inquiry.simulation, SENSITIVITY_CONTACT_TIME, 0.01) == 0.01);
    Sensitivity *answer = make(&inquiry);
    assert_true(
        !isnan(slope_of(answer, SENSITIVITY_RESTITUTION, STATISTICS_RMS_DISPLACEMENT)->derivative));
    assert_true(isnan(answer->contact.at[0].damping_by_restitution));
    clear(&inquiry, answer);
}

TEST(changes_begin_at_the_scenes_own_numbers) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 1);
    complete(&inquiry);
    Simulation member;
    assert_int_equal(fields_copy(simulation_fields, &inquiry.simulation, &member), STATUS_OK);
    for (int parameter = 0; parameter < SENSITIVITY_PARAMETERS; parameter++) {
        if (perturbation_refuse(&inquiry.simulation, parameter) != NULL)
            continue;
        perturbation_apply(&inquiry.simulation, parameter, 1.5, &member);
        perturbation_apply(&inquiry.simulation, parameter, 1, &member);
    }
    const Damper *a = &inquiry.simulation.scene.dampers.at[0], *b = &member.scene.dampers.at[0];
    assert_true(a->mass == b->mass && a->clearance == b->clearance);
    assert_true(buffer_equals(&a->buffer, &b->buffer));
    assert_non_null(perturbation_refuse(&inquiry.simulation, SENSITIVITY_STIFFNESS));
    simulation_clear(&member);
    study_request_clear(&inquiry);
}

static bool stop(void *context, double fraction) {
    double *last = context;
    assert_true(fraction >= *last); // never goes back
    *last = fraction;
    return fraction < 0.5;
}

TEST(it_stops_when_told_and_its_cost_is_that_of_its_runs) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 2);
    study_of(&inquiry)->uncertainty.contact_time_deviation = 0.1;
    complete(&inquiry);
    double last = 0;
    const Progress progress = {&last, stop};
    const StudyTools tools = {.progress = &progress};
    Variant *made;
    assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &made, &problem),
                     STATUS_CANCELLED);
    assert_true(made == NULL && last >= 0.5 && last < 0.6);
    Cost cost;
    assert_int_equal(study_request_cost(&inquiry, NULL, &cost, NULL), STATUS_OK);
    const double runs = cost.steps / simulation_cost(&inquiry.simulation).steps;
    assert_true(runs > 100 && runs < 1 + 225); // members have no channels
    const SimulationLimits limits = {.steps = simulation_cost(&inquiry.simulation).steps * 2};
    problem_clear(&problem);
    assert_int_equal(study_request_complete(&inquiry, &limits, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(problem.faults[0].detail, "fewer runs"));
    study_request_clear(&inquiry);
}

TEST(faults_are_told_at_their_places) {
    StudyRequest inquiry = study_request_make(0.61, (double)NAN, 1);
    study_of(&inquiry)->uncertainty.contact_time_deviation = 0.1; // impulses have no contact time
    assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/contact_time_deviation");
    study_request_clear(&inquiry);
    inquiry = study_request_make(0.61, 0.025, 1);
    study_of(&inquiry)->runs = 10; // of what spread?
    assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/runs");
    study_request_clear(&inquiry);
    inquiry = study_request_make(0.61, 0.025, 100);
    study_of(&inquiry)->uncertainty.restitution_deviation = 0.1;
    study_of(&inquiry)->runs = 2000;
    inquiry.simulation.output.psd.segment = 65536;
    assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/runs");
    study_request_clear(&inquiry);
}
