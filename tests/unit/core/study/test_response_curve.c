#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/study/response_curve.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

// The paper's sponge under 1 m/s^2.
static StudyRequest request_make(double frequency) {
    StudyRequest request = {0};
    paper_scene(&request.simulation, 0.61, 0.025, 1);
    paper_sine(&request.simulation, 1, frequency);
    request.study = variant_new(&study_response.kind);
    assert_non_null(request.study);
    problem_clear(&problem);
    return request;
}

static ResponseStudy *study_of(const StudyRequest *request) {
    return (ResponseStudy *)(void *)request->study;
}

static void axis_set(const StudyRequest *request, const char *pointer, double from, double to,
                     uint64_t count) {
    StudyAxis *axis = &study_of(request)->axis;
    axis->pointer = strdup(pointer);
    axis->from = from;
    axis->to = to;
    axis->count = count;
}

// The pointer of the axis becomes the first of tied ones.
static void axis_tie(const StudyRequest *request) {
    StudyAxis *axis = &study_of(request)->axis;
    assert_int_equal(texts_append(&axis->pointers, axis->pointer), STATUS_OK);
    free(axis->pointer);
    axis->pointer = NULL;
}

// Clears the request. The answer is freed by variant_free.
static ResponseCurve *curve_of(StudyRequest *request) {
    Variant *answer = NULL;
    const StudyTools tools = {0};
    if (study_request_complete(request, NULL, NULL, &problem) != STATUS_OK ||
        study_run(request->study, &request->simulation, &tools, &answer, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].pointer : "");
    study_request_clear(request);
    return (ResponseCurve *)(void *)answer;
}

static void assert_refused(StudyRequest *request, const char *pointer) {
    assert_int_equal(study_request_complete(request, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, pointer);
    study_request_clear(request);
}

TEST(a_curve_has_orbits_with_their_stability_and_sections_between) {
    StudyRequest request = request_make(4);
    axis_set(&request, "/excitation/frequency", 3.6, 4.6, 21);
    ResponseCurve *curve = curve_of(&request);
    size_t periodic = 0, aperiodic = 0;
    assert_int_equal(curve->points.count, 21);
    assert_int_equal(curve->made.runs, 21);
    assert_int_equal(curve->made.failed, 0);
    for (size_t i = 0; i < curve->points.count; i++) {
        const ResponsePoint *point = &curve->points.at[i];
        assert_int_equal(point->index, i);
        assert_int_equal(point->direction, CURVE_UP);
        assert_true(point->peak_displacement > point->rms_displacement);
        assert_true(point->undamped_peak_displacement > 0);
        if (point->period != COUNT_ABSENT) {
            periodic++;
            assert_int_equal(point->multipliers.count, 4);
            assert_true(point->stable == 1 && isnan(point->lyapunov) && point->section.count == 0);
        } else {
            aperiodic++;
            assert_int_equal(point->section.count, 64);
            assert_true(point->multipliers.count == 0 && isfinite(point->lyapunov));
            assert_int_equal(point->stable, CHOICE_ABSENT);
        }
    }
    assert_true(periodic >= 10 && aperiodic >= 3);
    variant_free(&curve->variant);
}

TEST(up_and_down_part_where_two_motions_are_stable) {
    StudyRequest request = request_make(3.8);
    study_of(&request)->direction = CURVE_BOTH;
    axis_set(&request, "/excitation/amplitude", 0.36, 0.43, 15);
    ResponseCurve *curve = curve_of(&request);
    size_t parted = 0;
    assert_int_equal(curve->points.count, 30);
    for (size_t i = 0; i < 15; i++) {
        const ResponsePoint *up = &curve->points.at[i], *down = &curve->points.at[29 - i];
        assert_true(up->value == down->value && down->direction == CURVE_DOWN);
        parted += up->stable == 1 && down->stable == 1 &&
                  fabs(up->peak_displacement / down->peak_displacement - 1) > 1e-3;
    }
    assert_true(parted > 0);
    variant_free(&curve->variant);
}

// From 4.6 Hz on the orbit is unstable, but it takes hundreds of cycles to leave it.
TEST(a_motion_beside_an_unstable_orbit_is_given_the_time_to_leave_it) {
    StudyRequest request = request_make(4);
    axis_set(&request, "/excitation/frequency", 4.3, 4.625, 14);
    ResponseCurve *curve = curve_of(&request);
    assert_int_equal(curve->points.at[10].period, 1);
    assert_int_equal(curve->points.at[13].period, COUNT_ABSENT);
    assert_true(curve->points.at[13].lyapunov > 0.3);
    assert_true(curve->points.at[13].peak_displacement > 0.005);
    assert_int_equal(curve->made.warnings.count, 0);
    variant_free(&curve->variant);
}

// From rest the motion is chaotic beside the same orbit where that is stable.
TEST(points_that_may_still_be_transients_are_named) {
    StudyRequest request = request_make(4);
    axis_set(&request, "/excitation/frequency", 4.5, 4.65, 4);
    ResponseCurve *curve = curve_of(&request);
    assert_int_equal(curve->points.at[0].period, COUNT_ABSENT);
    assert_int_equal(curve->made.warnings.count, 1);
    assert_string_equal(curve->made.warnings.at[0].pointer, "/study/settle_cycles");
    assert_non_null(strstr(curve->made.warnings.at[0].detail, "with index 0"));
    variant_free(&curve->variant);
}

TEST(a_resonance_without_damping_is_named) {
    StudyRequest request = request_make(3);
    simulation_clear(&request.simulation);
    scene_without_damper(&request.simulation);
    paper_sine(&request.simulation, 1, 3);
    SdofStructure *structure = (SdofStructure *)(void *)request.simulation.scene.structure;
    structure->mass = 1;
    structure->stiffness = 355.30575843921691; // of 3 Hz
    structure->damping = 0;
    axis_set(&request, "/excitation/frequency", 3, 3.5, 2);
    ResponseCurve *curve = curve_of(&request);
    assert_int_equal(curve->points.at[0].period, COUNT_ABSENT);
    assert_int_equal(curve->made.warnings.count, 1);
    assert_non_null(strstr(curve->made.warnings.at[0].detail, "with index 0"));
    variant_free(&curve->variant);
}

TEST(a_continuation_follows_a_branch_through_a_fold) {
    StudyRequest request = request_make(4);
    study_of(&request)->continuation = true;
    axis_set(&request, "/excitation/frequency", 4, 5.2, 20);
    ResponseCurve *curve = curve_of(&request);
    size_t unstable = 0, folds = 0;
    for (size_t i = 20; i < curve->points.count; i++) {
        const ResponsePoint *point = &curve->points.at[i];
        assert_true(point->direction == CHOICE_ABSENT && point->period != COUNT_ABSENT);
        const double *first = point->multipliers.at[0].at;
        unstable += point->stable == 0 && hypot(first[0], first[1]) > 1;
        folds += i >= 22 && point[-1].branch == point->branch &&
                 point[-2].branch == point->branch &&
                 (point->value - point[-1].value) * (point[-1].value - point[-2].value) < 0;
    }
    assert_true(curve->points.count > 30 && curve->points.count <= 20 + 4 * 20 + 200);
    assert_true(unstable > 0 && folds > 0);
    assert_true(curve->made.runs > 40 && curve->made.failed == 0 && curve->made.steps > 0);
    variant_free(&curve->variant);
}

TEST(a_point_that_fails_is_counted_with_its_reason) {
    StudyRequest request = request_make(4);
    axis_set(&request, "/dampers/0/clearance", -0.01, 0.01, 5);
    ResponseCurve *curve = curve_of(&request);
    assert_int_equal(curve->points.count, 5);
    assert_int_equal(curve->made.failed, 2);
    assert_int_equal(curve->made.failures.count, 1);
    assert_string_equal(curve->made.failures.at[0].reason, "invalid-scene");
    assert_int_equal(curve->made.failures.at[0].count, 2);
    assert_true(isnan(curve->points.at[0].peak_displacement));
    assert_int_equal(curve->points.at[0].stable, CHOICE_ABSENT);
    assert_true(curve->points.at[4].peak_displacement > 0);
    variant_free(&curve->variant);
}

TEST(a_study_that_has_no_cycles_or_no_number_to_vary_is_refused) {
    StudyRequest request = request_make(4);
    paper_free(&request.simulation, 0.01);
    axis_set(&request, "/dampers/0/clearance", 0.01, 0.02, 5);
    assert_refused(&request, "/study/kind");
    request = request_make(4);
    axis_set(&request, "/excitation/quantity", 0.01, 0.02, 5);
    assert_refused(&request, "/study/axis/pointer");
    request = request_make(4);
    axis_set(&request, "/excitation/frequency", 5, 4, 5);
    assert_refused(&request, "/study/axis");
    request = request_make(4);
    axis_set(&request, "/excitation/frequency", 4, 5, 20000);
    assert_refused(&request, "/study/axis/count");
    request = request_make(4);
    axis_set(&request, "/excitation/frequency", 4, 5, 10000);
    study_of(&request)->section_points = 4096;
    assert_refused(&request, "/study/section_points");
}

TEST(the_cost_does_not_depend_on_the_solver) {
    double steps[2];
    for (int i = 0; i < 2; i++) {
        StudyRequest request = request_make(4);
        Cost cost;
        axis_set(&request, "/excitation/frequency", 4, 5, 20);
        if (i == 1)
            scene_choose(&request.simulation.accuracy, &solver_kinds, "adaptive");
        assert_int_equal(study_request_complete(&request, NULL, NULL, &problem), STATUS_OK);
        assert_int_equal(study_request_cost(&request, NULL, &cost, NULL), STATUS_OK);
        steps[i] = cost.steps;
        study_request_clear(&request);
    }
    assert_true(fabs(steps[1] / steps[0] - 1) < 0.1);
}

TEST(all_tied_members_are_named) {
    StudyRequest request = request_make(4);
    axis_set(&request, "/dampers/0/clearance", 0.01, 0.011, 2);
    axis_tie(&request);
    assert_int_equal(texts_append(&study_of(&request)->axis.pointers, "/structure/damping"),
                     STATUS_OK);
    ResponseCurve *curve = curve_of(&request);
    assert_string_equal(curve->member.pointer, "/dampers/0/clearance");
    assert_int_equal(curve->member.pointers.count, 2);
    assert_string_equal(curve->member.pointers.at[1], "/structure/damping");
    variant_free(&curve->variant);
}

TEST(the_cost_of_tied_members_is_that_of_their_frequency) {
    double steps[2];
    for (int i = 0; i < 2; i++) {
        StudyRequest request = request_make(4);
        Cost cost;
        axis_set(&request, "/excitation/frequency", 0.01, 0.02, 5);
        if (i == 1)
            axis_tie(&request);
        assert_int_equal(study_request_complete(&request, NULL, NULL, &problem), STATUS_OK);
        assert_int_equal(study_request_cost(&request, NULL, &cost, NULL), STATUS_OK);
        steps[i] = cost.steps;
        study_request_clear(&request);
    }
    assert_true(steps[1] == steps[0]);
}

static bool stop_later(void *context, double fraction) {
    (void)fraction;
    return ++*(size_t *)context < 50;
}

TEST(a_cancel_stops_the_study) {
    StudyRequest request = request_make(4);
    Variant *answer = NULL;
    size_t looks = 0;
    const Progress progress = {&looks, stop_later};
    const StudyTools tools = {.progress = &progress};
    axis_set(&request, "/excitation/frequency", 3.6, 4.6, 400);
    assert_int_equal(study_request_complete(&request, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(study_run(request.study, &request.simulation, &tools, &answer, &problem),
                     STATUS_CANCELLED);
    assert_null(answer);
    study_request_clear(&request);
}
