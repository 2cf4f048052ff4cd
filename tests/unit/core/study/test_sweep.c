

#include <stdlib.h>
#include <string.h>

#include "core/study/study.h"
#include "core/study/sweep.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

// The paper's scene for 1 s with a sweep that has no axes yet.
static StudyRequest study_request_make(void) {
    StudyRequest inquiry = {0};
    scene_with_damper(&inquiry.simulation, 0.61, 0.025);
    inquiry.simulation.scene.duration = 1;
    inquiry.study = variant_new(&study_sweep.kind);
    assert_non_null(inquiry.study);
    problem_clear(&problem);
    return inquiry;
}

static SweepStudy *study_of(const StudyRequest *inquiry) {
    return (SweepStudy *)(void *)inquiry->study;
}

static StudyAxis *axis_add(StudyRequest *inquiry, const char *pointer) {
    StudyAxes *axes = &study_of(inquiry)->axes;
    axes->at = realloc(axes->at, (axes->count + 1) * sizeof *axes->at);
    assert_non_null(axes->at);
    StudyAxis *axis = &axes->at[axes->count++];
    *axis = (StudyAxis){.pointer = strdup(pointer),
                        .from = (double)NAN,
                        .to = (double)NAN,
                        .count = COUNT_ABSENT,
                        .spacing = CHOICE_ABSENT};
    return axis;
}

static void range_add(StudyRequest *inquiry, const char *pointer, double from, double to,
                      uint64_t count) {
    StudyAxis *axis = axis_add(inquiry, pointer);
    axis->from = from;
    axis->to = to;
    axis->count = count;
}

static void values_add(StudyRequest *inquiry, const char *pointer, size_t count,
                       const char *const *values) {
    axis_add(inquiry, pointer)->values = texts_of(count, values);
}

static SweepGrid *plan_of(StudyRequest *inquiry) {
    SweepGrid *plan = NULL;
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK ||
        sweep_grid_new(study_of(inquiry), &inquiry->simulation, NULL, &plan, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
    return plan;
}

static Simulation scene_of(const SweepGrid *plan, size_t point) {
    Simulation scene;
    if (sweep_grid_scene(plan, point, false, NULL, &scene, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
    return scene;
}

static bool count_look(void *context, double fraction) {
    (void)fraction;
    ++*(size_t *)context;
    return true;
}

// Points judged where the scene has so many storeys.
static size_t judged(size_t storeys, size_t count, size_t scenes, int mode) {
    StudyRequest inquiry = study_request_make();
    Scene *scene = &inquiry.simulation.scene;
    scene_start(&inquiry.simulation, 0, 0);
    variant_free(scene->structure);
    scene->structure = variant_new(&structure_shear_frame.kind);
    assert_non_null(scene->structure);
    ShearFrame *frame = (ShearFrame *)(void *)scene->structure;
    assert_true(reals_allocate(&frame->masses, storeys) &&
                reals_allocate(&frame->stiffnesses, storeys));
    for (size_t i = 0; i < storeys; i++) {
        frame->masses.at[i] = 100;
        frame->stiffnesses.at[i] = 2e5;
    }
    range_add(&inquiry, "/duration", 1, 2, count);
    study_of(&inquiry)->mode = mode;
    SweepGrid *plan = plan_of(&inquiry);
    size_t looks = 0;
    const Progress progress = {&looks, count_look};
    assert_int_equal(sweep_grid_validate(plan, scenes, NULL, &progress, &problem), STATUS_OK);
    sweep_grid_free(plan);
    study_request_clear(&inquiry);
    return looks;
}

// Whoever submits it waits meanwhile.
TEST(how_many_points_are_judged_at_once_goes_by_what_one_costs) {
    assert_int_equal(judged(1, 3000, 5000, SWEEP_GRID), 3000);
    const size_t eight = judged(8, 3000, 5000, SWEEP_GRID);
    assert_in_range(eight, 100, 600);
    assert_in_range(judged(100, 3000, 5000, SWEEP_GRID), 16, 40);
    assert_in_range(judged(100, 3000, 5000, SWEEP_LIST), 16, 40);
    assert_int_equal(judged(40, 100, SIZE_MAX, SWEEP_GRID), 100); // before anything runs: all
}

// No look at the progress may be far from the next one, whatever a point costs.
TEST(judging_all_points_looks_at_the_watch_before_each) {
    assert_int_equal(judged(20, 200, SIZE_MAX, SWEEP_LIST), 200);
}

TEST(a_points_scene_follows_from_its_number) {
    StudyRequest inquiry = study_request_make();
    static const char *const masses[] = {"0.1", "0.2", "0.3"};
    values_add(&inquiry, "/dampers/0/mass", 3, masses);
    range_add(&inquiry, "/dampers/0/clearance", 0.01, 0.02, 5);
    SweepGrid *plan = plan_of(&inquiry);
    assert_int_equal(plan->points, 15);
    for (size_t point = 0; point < 15; point++) {
        Simulation scene = scene_of(plan, point);
        const Damper *damper = &scene.scene.dampers.at[0];
        assert_true(damper->mass == strtod(masses[point / 5], NULL));
        assert_true(damper->clearance ==
                    (point % 5 == 4 ? 0.02 : 0.01 + 0.0025 * (double)(point % 5)));
        simulation_clear(&scene);
    }
    sweep_grid_free(plan);
    study_of(&inquiry)->mode = SWEEP_LIST;
    assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/axes/1"), "has 5 values"));
    study_request_clear(&inquiry);
}

TEST(whole_numbers_of_a_range_stay_whole) {
    StudyRequest inquiry = study_request_make();
    range_add(&inquiry, "/output/psd/segment", 1, 3000, 3000);
    Variant *answer = variant_new(study_sweep.answer);
    Sweep *sweep = (Sweep *)(void *)answer;
    assert_int_equal(sweep_describe(study_of(&inquiry), &inquiry.simulation, sweep, &problem),
                     STATUS_OK);
    for (size_t i = 0; i < 3000; i++)
        assert_int_equal(strtoul(sweep->axes.at[0].values.at[i], NULL, 10), i + 1);
    variant_free(answer);
    study_request_clear(&inquiry);
}

TEST(a_row_is_its_scenes_own_run) {
    StudyRequest inquiry = study_request_make();
    range_add(&inquiry, "/dampers/0/clearance", 0.005, 0.02, 4);
    SweepGrid *plan = plan_of(&inquiry);
    const StudyTools tools = {0};
    Variant *answer;
    assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &answer, &problem),
                     STATUS_OK);
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    assert_int_equal(sweep->points, 4);
    assert_int_equal(sweep->table.points.count, 4);
    for (size_t point = 0; point < 4; point++) {
        Simulation scene;
        Outcome *outcome;
        assert_int_equal(sweep_grid_scene(plan, point, true, NULL, &scene, &problem), STATUS_OK);
        assert_int_equal(simulation_run(&scene, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
        const double *row = &sweep->table.values.at[point * sweep->metrics.count];
        assert_true(row[0] == outcome->summary.peak_displacement);
        assert_true(row[1] == outcome->summary.rms_displacement);
        assert_true(row[4] == (double)outcome->summary.impacts);
        outcome_unref(outcome);
        simulation_clear(&scene);
    }
    variant_free(answer);
    sweep_grid_free(plan);
    study_request_clear(&inquiry);
}

TEST(faults_stand_at_their_values_and_name_the_point) {
    StudyRequest inquiry = study_request_make();
    static const char *const clearances[] = {"0.01", "-1", "\"wide\"", "-2"};
    static const char *const masses[] = {"0.1", "0"};
    const SimulationLimits limits = {0};
    values_add(&inquiry, "/dampers/0/clearance", 4, clearances);
    values_add(&inquiry, "/dampers/0/mass", 2, masses);
    values_add(&inquiry, "/dampers/0/mas", 2, masses);
    assert_int_equal(study_request_complete(&inquiry, &limits, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/axes/0/values/1"), "is -1"));
    assert_non_null(strstr(detail_at(&problem, "/study/axes/0/values/1"), "/dampers/0/clearance"));
    assert_non_null(strstr(detail_at(&problem, "/study/axes/0/values/2"), "is a text"));
    assert_non_null(strstr(detail_at(&problem, "/study/axes/0/values/3"), "is -2"));
    assert_non_null(strstr(detail_at(&problem, "/study/axes/1/values/1"), "point "));
    assert_non_null(strstr(detail_at(&problem, "/study/axes/2/pointer"), "mass"));
    assert_int_equal(problem.count, 5);
    study_request_clear(&inquiry);
}

TEST(a_fault_of_two_values_together_is_found) {
    StudyRequest inquiry = study_request_make();
    const SimulationLimits limits = {0};
    range_add(&inquiry, "/dampers/0/clearance", 0.03, 0.01, 3);
    range_add(&inquiry, "/dampers/0/position", 0, 0.008, 5);
    assert_int_equal(study_request_complete(&inquiry, &limits, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/axes/1"), "point 13"));
    study_request_clear(&inquiry);
}

// Of a million points the validation takes 8 s, which the tasks of a cluster would each spend
// again.
TEST(a_sweep_of_many_points_or_that_was_begun_before_begins_at_once) {
    const SimulationLimits limits = {.points = 3 * SWEEP_POINTS};
    for (int before = 0; before < 2; before++) {
        StudyRequest inquiry = study_request_make();
        size_t looks = 0;
        const Progress progress = {&looks, count_look};
        const StudyTools tools = {.limits = &limits, .progress = &progress, .is_validated = before};
        const size_t each = before ? 100 : 1001;
        Variant *answer;
        StudyWork *work;
        StudyPart *part;
        range_add(&inquiry, "/dampers/0/position", 0, 0.008, each);
        range_add(&inquiry, "/dampers/0/clearance", 0.01, 0.03, each);
        assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_OK);
        assert_int_equal(
            study_begin(inquiry.study, &inquiry.simulation, &tools, &answer, &work, &problem),
            STATUS_OK);
        assert_int_equal(looks, 0);
        assert_int_equal(work->members, each * each);
        // Both values are right, but not together.
        assert_int_equal(study_part_make(work, (each - 1) * each, &tools, &part, &problem),
                         STATUS_OK);
        assert_int_equal(part->run.status, STATUS_INVALID);
        assert_non_null(part->run.why);
        study_part_free(work, part);
        study_free(work);
        variant_free(answer);
        study_request_clear(&inquiry);
    }
}

TEST(too_many_points_or_values_are_refused) {
    const SimulationLimits limits = {.points = 100};
    StudyRequest inquiry = study_request_make();
    range_add(&inquiry, "/dampers/0/clearance", 0.01, 0.02, 11);
    range_add(&inquiry, "/dampers/0/mass", 0.1, 0.2, 10);
    assert_int_equal(study_request_complete(&inquiry, &limits, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/axes"), "110 points, at most 100"));
    study_of(&inquiry)->axes.at[0].count = study_of(&inquiry)->axes.at[1].count = STUDY_AXIS_VALUES;
    range_add(&inquiry, "/dampers/0/offset", 0.1, 0.2, STUDY_AXIS_VALUES);
    range_add(&inquiry, "/structure/mass", 0.1, 0.2, STUDY_AXIS_VALUES);
    problem_clear(&problem);
    assert_int_equal(study_request_complete(&inquiry, &limits, NULL, &problem), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/axes"), "points, at most 100"));
    study_request_clear(&inquiry);
}

TEST(sides_and_materials_are_filled_from_what_is_pinned) {
    StudyRequest inquiry = study_request_make();
    static const char *const names[] = {"\"sponge@1\"", "\"steel@2\""};
    SweepStudy *study = study_of(&inquiry);
    study->names.materials.at = calloc(2, sizeof *study->names.materials.at);
    assert_non_null(study->names.materials.at);
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(fields_default(buffer_fields, &study->names.materials.at[i]), STATUS_OK);
        study->names.materials.count++;
        study->names.materials.at[i].material = strdup(i == 0 ? "sponge@1" : "steel@2");
        study->names.materials.at[i].restitution = 0.5 + 0.1 * (double)i;
        study->names.materials.at[i].contact_time = 0.01;
    }
    values_add(&inquiry, "/dampers/0/left_buffer", 2, names);
    SweepGrid *plan = plan_of(&inquiry);
    Simulation scene = scene_of(plan, 1);
    const Damper *damper = &scene.scene.dampers.at[0];
    assert_true(damper->left_buffer.restitution == 0.6);
    assert_true(damper->left_buffer.contact_time == 0.01);
    assert_true(damper->right_buffer.restitution == 0.61);
    simulation_clear(&scene);
    sweep_grid_free(plan);
    study_request_clear(&inquiry);
}

static bool stops(void *context, double fraction) {
    (void)context;
    return fraction < 0.5;
}

TEST(a_sweep_stops_when_it_is_told_to) {
    StudyRequest inquiry = study_request_make();
    range_add(&inquiry, "/dampers/0/clearance", 0.005, 0.02, 50);
    sweep_grid_free(plan_of(&inquiry));
    const Progress progress = {NULL, stops};
    const StudyTools tools = {.progress = &progress};
    Variant *answer;
    assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &answer, &problem),
                     STATUS_CANCELLED);
    assert_null(answer);
    study_request_clear(&inquiry);
}
