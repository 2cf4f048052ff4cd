// Fragility of linear scenes, of which everything is known: the response grows with the level.
#include "core/study/fragility.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/study/statistics.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

enum { RECORDS = 12, SAMPLES = 200 };

static Problem problem;

static FragilityStudy *study_of(const StudyRequest *request) {
    return (FragilityStudy *)(void *)request->study;
}

static void add_record(FragilityStudy *study, size_t index, bool is_still) {
    char name[16];
    double *values = malloc(SAMPLES * sizeof *values);
    assert_non_null(values);
    philox_normal_pairs(9, index, 0, SAMPLES / 2, values);
    for (size_t i = 0; i < SAMPLES; i++)
        values[i] *= is_still ? 0 : sin(3.14159 * (double)i / SAMPLES);
    // The peaks differ, the response hardly does.
    values[SAMPLES - 1] = is_still ? 0 : 4 + (double)(index % 5);
    Reals samples = {values, SAMPLES};
    snprintf(name, sizeof name, "r%zu", index);
    NamedRecord *named = named_record_new(name, "0123", 0.02, &samples);
    assert_non_null(named);
    study->records.at = realloc(study->records.at, (index + 1) * sizeof *study->records.at);
    assert_non_null(study->records.at);
    study->records.at[index] =
        (PinnedRecord){strdup(named->name), strdup(named->digest), &named->shared};
    study->records.count = index + 1;
}

static void set_levels(FragilityStudy *study, const double *values, size_t count) {
    assert_int_equal(study_copy_reals(values, count, &study->levels.values), STATUS_OK);
}

static void add_limit(FragilityStudy *study, const char *metric, double value) {
    FragilityLimit *limit = list_append(&study->limits, sizeof *limit);
    assert_non_null(limit);
    limit->value = value;
    while (strcmp(study_metric_names[limit->metric], metric) != 0)
        limit->metric++;
}

// One mass without damper, under the records.
static StudyRequest request_make(size_t records) {
    StudyRequest request = {0};
    scene_without_damper(&request.simulation);
    request.simulation.scene.duration = 5;
    variant_free(request.simulation.scene.excitation);
    request.simulation.scene.excitation = variant_new(&excitation_free.kind);
    request.study = variant_new(&study_fragility.kind);
    assert_non_null(request.study);
    for (size_t i = 0; i < records; i++)
        add_record(study_of(&request), i, false);
    problem_clear(&problem);
    return request;
}

static Status complete(StudyRequest *request) {
    return study_request_complete(request, NULL, NULL, &problem);
}

static Fragility *run(StudyRequest *request) {
    Variant *answer;
    const Status completed = complete(request);
    if (completed != STATUS_OK)
        print_error("%s: %s\n", problem.faults[0].pointer, problem.faults[0].detail);
    assert_int_equal(completed, STATUS_OK);
    assert_int_equal(
        study_run(request->study, &request->simulation, &(StudyTools){0}, &answer, &problem),
        STATUS_OK);
    return (Fragility *)(void *)answer;
}

TEST(curves_of_a_linear_scene_are_lines_and_their_limits_are_fitted) {
    StudyRequest request = request_make(RECORDS);
    FragilityStudy *study = study_of(&request);
    study->levels = (FragilityLevels){.from = 0.5, .to = 15, .count = 30};
    add_limit(study, "peak_displacement", 0.02);
    Fragility *answer = run(&request);
    assert_true(answer->made.runs == RECORDS * 30 && answer->made.failed == 0 &&
                answer->made.steps > 0);
    assert_true(answer->curves.count == RECORDS && answer->intensity.measure == 0);
    CensoredNumber intervals[RECORDS];
    double at_last[RECORDS];
    for (size_t r = 0; r < RECORDS; r++) {
        const FragilityCurve *curve = &answer->curves.at[r];
        const double slope = curve->points.at[29].metrics.peak_displacement / 15;
        assert_true(curve->intensity >= 4 && curve->points.count == 30);
        for (size_t l = 0; l < 30; l++) {
            const FragilityPoint *point = &curve->points.at[l];
            assert_true(fabs(point->level - 0.5 * (double)(l + 1)) < 1e-14);
            assert_true(fabs(point->metrics.peak_displacement / (slope * point->level) - 1) <
                        1e-12);
            assert_true(point->metrics.impacts == 0 && isnan(point->metrics.peak_storey_drift));
        }
        const double capacity = 0.02 / slope;
        intervals[r] = (CensoredNumber){floor(capacity / 0.5) * 0.5, ceil(capacity / 0.5) * 0.5};
        if (capacity > 15)
            intervals[r] = (CensoredNumber){15, (double)INFINITY};
        at_last[r] = slope * 15;
    }
    LognormalFit fit;
    assert_true(lognormal_fit(intervals, RECORDS, 0.95, &fit));
    const FragilityState *fitted = &answer->limits.at[0];
    assert_true(fitted->median == fit.median && fitted->dispersion == fit.dispersion);
    assert_true(fitted->median_interval_95.at[1] == fit.median_interval[1] &&
                fitted->dispersion_interval_95.at[0] == fit.dispersion_interval[0]);
    reals_sort(at_last, RECORDS);
    const FragilityFractile *last = &answer->fractiles.at[29];
    assert_true(last->level == 15 && last->count == RECORDS);
    assert_true(fabs(last->p50 / statistics_quantile(at_last, RECORDS, 0.5) - 1) < 1e-12);
    assert_true(fabs(last->p84 / statistics_quantile(at_last, RECORDS, 0.84) - 1) < 1e-12);
    assert_true(answer->made.warnings.count == 0);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

// The oscillator of the intensity is the scene itself: all curves are one line.
TEST(an_intensity_of_the_scenes_own_oscillator_leaves_no_dispersion) {
    StudyRequest request = request_make(4);
    FragilityStudy *study = study_of(&request);
    const SdofStructure *structure =
        (const SdofStructure *)(void *)request.simulation.scene.structure;
    const double omega = sqrt(structure->stiffness / structure->mass);
    study->intensity.period = 2 * 3.14159265358979323846 / omega;
    study->intensity.damping_ratio = structure->damping / (2 * structure->mass * omega);
    set_levels(study, (double[]){1, 2, 4, 8}, 4);
    add_limit(study, "peak_displacement", 3 / (omega * omega));
    add_limit(study, "peak_displacement", 1000);
    add_limit(study, "peak_base_shear", 0);
    Fragility *answer = run(&request);
    for (size_t r = 0; r < 4; r++)
        for (size_t l = 0; l < 4; l++) {
            const FragilityPoint *point = &answer->curves.at[r].points.at[l];
            assert_true(fabs(point->metrics.peak_displacement * omega * omega / point->level - 1) <
                        1e-4);
        }
    static const char *const whys[] = {"take more levels between 2 and 4 m/s^2",
                                       "take higher levels", "take lower levels"};
    assert_true(answer->made.warnings.count == 3);
    for (size_t i = 0; i < 3; i++) {
        assert_true(isnan(answer->limits.at[i].median) && isnan(answer->limits.at[i].dispersion));
        assert_non_null(strstr(answer->made.warnings.at[i].detail, whys[i]));
    }
    assert_true(answer->limits.at[0].exceeded == 4 && answer->limits.at[1].exceeded == 0);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(a_limit_without_a_run_asks_for_no_other_levels) {
    StudyRequest request = request_make(2);
    set_levels(study_of(&request), (double[]){1e200, 2e200}, 2);
    add_limit(study_of(&request), "peak_displacement", 0.02);
    Fragility *answer = run(&request);
    assert_true(answer->made.failed == 4 && answer->limits.at[0].exceeded == 0);
    assert_non_null(strstr(answer->made.warnings.at[0].detail, "unknown: no run has this metric"));
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(runs_that_fail_are_counted_and_say_nothing) {
    StudyRequest request = request_make(3);
    FragilityStudy *study = study_of(&request);
    set_levels(study, (double[]){1, 5, 1e200}, 3);
    add_limit(study, "peak_displacement", 0.02);
    request.simulation.scene.duration = 3;
    Fragility *answer = run(&request);
    assert_true(answer->made.runs == 9 && answer->made.failed == 3 &&
                answer->made.failures.count == 1);
    assert_true(answer->made.failures.at[0].count == 3 && answer->made.failures.at[0].first == 2);
    assert_non_null(answer->made.failures.at[0].detail);
    assert_true(isnan(answer->curves.at[0].points.at[2].metrics.peak_displacement));
    assert_true(answer->fractiles.at[2].count == 0 && isnan(answer->fractiles.at[2].p50));
    // The records last 3.98 s.
    assert_string_equal(answer->made.warnings.at[0].pointer, "/duration");
    assert_non_null(strstr(answer->made.warnings.at[0].detail, "3 of the records (r0, r1, r2)"));
    variant_free(&answer->variant);
    study_request_clear(&request);
}

static void refuse(StudyRequest *request, const char *pointer, const char *detail) {
    problem_clear(&problem);
    assert_int_equal(complete(request), STATUS_INVALID);
    size_t i = 0;
    while (i < problem.count && (strcmp(problem.faults[i].pointer, pointer) != 0 ||
                                 strstr(problem.faults[i].detail, detail) == NULL))
        i++;
    if (i == problem.count)
        print_error("%s: %s\n", problem.faults[0].pointer, problem.faults[0].detail);
    assert_true(i < problem.count);
}

TEST(senseless_requests_are_refused_at_their_place) {
    StudyRequest request = request_make(2);
    FragilityStudy *study = study_of(&request);
    refuse(&request, "/study/levels", "is required");
    refuse(&request, "/study/limits", "is required");
    add_limit(study, "peak_displacement", 0.02);
    study->levels.from = 1;
    refuse(&request, "/study/levels", "needs values, or a range");
    study->levels.to = 1;
    study->levels.count = 4;
    refuse(&request, "/study/levels", "from must be below to");
    set_levels(study, (double[]){1, 3, 2}, 3);
    refuse(&request, "/study/levels", "has values and a range");
    study->levels.from = study->levels.to = (double)NAN;
    study->levels.count = COUNT_ABSENT;
    refuse(&request, "/study/levels/2", "must be above the one before it");
    study->levels.values.at[0] = 0;
    refuse(&request, "/study/levels/0", "must be above 0");
    study->levels.values.at[0] = 1;
    study->levels.values.at[2] = 4;
    study->intensity.damping_ratio = 0.1;
    refuse(&request, "/study/intensity/damping_ratio", "needs the period");
    study->intensity.period = 1;
    study->intensity.measure = 0;
    refuse(&request, "/study/intensity", "leave one of them out");
    study->intensity.measure = CHOICE_ABSENT;
    add_limit(study, "peak_storey_drift", 1);
    refuse(&request, "/study/limits/1/metric", "needs a structure of the kind frame");
    study->limits.at[1].metric = 0;
    while (strcmp(study_metric_names[study->limits.at[1].metric], "rms_displacement_reduction") !=
           0)
        study->limits.at[1].metric++;
    refuse(&request, "/study/limits/1/metric", "must be a metric that grows");
    study->limits.count = 1;
    free(study->records.at[1].name);
    study->records.at[1].name = strdup("r0");
    refuse(&request, "/study/records/1", "is listed twice");
    free(study->records.at[1].name);
    study->records.at[1].name = strdup("r1");
    add_record(study, 2, true);
    refuse(&request, "/study/records/2", "is a base at rest");
    study_request_clear(&request);
}

// The records move the base of the scene's own run, too, unless it names another one.
TEST(an_excitation_that_the_records_would_replace_is_refused) {
    StudyRequest request = request_make(2);
    Warnings warnings = {NULL, 0};
    set_levels(study_of(&request), (double[]){1, 2}, 2);
    add_limit(study_of(&request), "peak_displacement", 0.02);
    assert_int_equal(study_request_complete(&request, NULL, &warnings, &problem), STATUS_OK);
    for (size_t i = 0; i < warnings.count; i++)
        assert_null(strstr(warnings.at[i].detail, "nothing moves"));
    warnings_clear(&warnings);
    const ExcitationRecord *record =
        (const ExcitationRecord *)(void *)request.simulation.scene.excitation;
    assert_string_equal(record->name, "r0");
    assert_int_equal(complete(&request), STATUS_OK);
    variant_free(request.simulation.scene.excitation);
    request.simulation.scene.excitation = variant_new(&excitation_sine.kind);
    refuse(&request, "/excitation", "is of the kind sine: leave it out");
    study_request_clear(&request);
    request = request_make(1);
    Excitation *start = (Excitation *)(void *)request.simulation.scene.excitation;
    assert_true(reals_allocate(&start->displacement, 1));
    start->displacement.at[0] = 0.01;
    refuse(&request, "/excitation", "give the start with the kind record");
    study_request_clear(&request);
}

TEST(an_accuracy_target_leaves_all_runs_the_same_settings) {
    Fragility *answers[2];
    for (size_t i = 0; i < 2; i++) {
        StudyRequest request = request_make(2);
        simulation_clear(&request.simulation);
        scene_with_damper(&request.simulation, 0.61, 0.025);
        paper_model(&request.simulation, "hunt_crossley");
        request.simulation.scene.duration = 5;
        variant_free(request.simulation.scene.excitation);
        request.simulation.scene.excitation = variant_new(&excitation_free.kind);
        if (i == 1)
            ((AccuracyAuto *)(void *)request.simulation.accuracy)->target = 1e-2;
        set_levels(study_of(&request), (double[]){1, 4, 8}, 3);
        add_limit(study_of(&request), "peak_displacement", 0.02);
        answers[i] = run(&request);
        study_request_clear(&request);
    }
    assert_true(answers[0]->made.steps == answers[1]->made.steps);
    for (size_t r = 0; r < 2; r++)
        for (size_t l = 0; l < 3; l++)
            assert_memory_equal(&answers[0]->curves.at[r].points.at[l].metrics,
                                &answers[1]->curves.at[r].points.at[l].metrics,
                                sizeof(StudyMetrics));
    variant_free(&answers[0]->variant);
    variant_free(&answers[1]->variant);
}

static bool stop_at_once(void *context, double fraction) {
    (void)context;
    (void)fraction;
    return false;
}

TEST(a_fragility_stops_when_it_is_asked_to) {
    StudyRequest request = request_make(2);
    Variant *answer;
    set_levels(study_of(&request), (double[]){1, 2}, 2);
    add_limit(study_of(&request), "peak_displacement", 0.02);
    assert_int_equal(complete(&request), STATUS_OK);
    const Progress progress = {NULL, stop_at_once};
    assert_int_equal(study_run(request.study, &request.simulation,
                               &(StudyTools){.progress = &progress}, &answer, &problem),
                     STATUS_CANCELLED);
    assert_null(answer);
    study_request_clear(&request);
}
