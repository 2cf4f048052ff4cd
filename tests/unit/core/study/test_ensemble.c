

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/excitation/excitation.h"
#include "core/study/ensemble.h"
#include "core/study/study.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/taken.h"
#include "tests/support/test.h"

static Problem problem;

static EnsembleStudy *study_of(StudyRequest *inquiry) {
    return (EnsembleStudy *)(void *)inquiry->study;
}

// The paper's random scene with seed 5 and an ensemble of so many runs; completed by the caller.
static StudyRequest study_request_make(double duration, uint64_t runs) {
    StudyRequest inquiry = {0};
    paper_scene(&inquiry.simulation, 0.61, 0.025, duration);
    paper_random(&inquiry.simulation, 1, 5);
    inquiry.study = variant_new(&study_ensemble.kind);
    assert_non_null(inquiry.study);
    study_of(&inquiry)->runs = runs;
    problem_clear(&problem);
    return inquiry;
}

static void complete(StudyRequest *inquiry) {
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
}

static Status run(const StudyRequest *inquiry, const Progress *progress,
                  const SimulationLimits *limits, Workspace *workspace, Ensemble **answer) {
    const StudyTools tools = {.limits = limits, .progress = progress, .workspace = workspace};
    Variant *made = NULL;
    const Status status = study_run(inquiry->study, &inquiry->simulation, &tools, &made, &problem);
    *answer = (Ensemble *)(void *)made;
    return status;
}

static Ensemble *make(const StudyRequest *inquiry, const SimulationLimits *limits) {
    Ensemble *answer;
    if (run(inquiry, NULL, limits, NULL, &answer) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return answer;
}

TEST(each_row_is_the_scene_with_its_seed) {
    StudyRequest inquiry = study_request_make(4, 5);
    inquiry.simulation.output.reduction = false; // as in the members
    complete(&inquiry);
    assert_int_equal(study_of(&inquiry)->first_seed, 5); // the scene's own
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 5 && answer->made.failed == 0 && answer->table.count == 5);
    double steps = 0;
    for (size_t i = 0; i < 5; i++) {
        Simulation *simulation = &inquiry.simulation;
        ((ExcitationRandom *)(void *)simulation->scene.excitation)->seed = 5 + i;
        Outcome *outcome;
        assert_int_equal(simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem),
                         STATUS_OK);
        const RunRecord *row = &answer->table.at[i];
        assert_true(row->number == 5 + i && row->steps == outcome->steps && row->why == NULL);
        assert_memory_equal(&row->summary, &outcome->summary, sizeof outcome->summary);
        steps += outcome->steps;
        outcome_unref(outcome);
    }
    assert_true(answer->made.steps == steps);
    assert_true(answer->target.why == NULL && answer->target.predicted_runs == COUNT_ABSENT);
    const RunStatistic *impacts = &answer->statistics.impacts;
    assert_true(impacts->count == 5 && impacts->low < impacts->mean);
    assert_int_equal(answer->spectra.count, 1);
    assert_string_equal(answer->spectra.at[0].channel, "mean_acceleration");
    assert_true(answer->spectra.at[0].low.at[40] < answer->spectra.at[0].mean.at[40]);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(a_target_ends_it_and_looser_ones_end_it_sooner) {
    static const double targets[] = {0.5, 0.1, 1e-9};
    StudyRequest inquiry = study_request_make(4, 60);
    double made[COUNT(targets)];
    for (int metric = 0; metric <= STATISTICS_PSD; metric += STATISTICS_PSD) {
        for (size_t i = 0; i < COUNT(targets); i++) {
            study_of(&inquiry)->target = targets[i];
            study_of(&inquiry)->metric = metric;
            complete(&inquiry);
            Ensemble *answer = make(&inquiry, NULL);
            const EnsembleTarget *target = &answer->target;
            made[i] = (double)answer->made.runs;
            assert_true(answer->table.count == answer->made.runs && target->metric == metric);
            assert_true(target->is_kept && target->estimated_error <= targets[i]);
            assert_true(target->pilot == 8 && target->predicted_runs >= 8);
            assert_true(target->confidence == 0.99 && target->error == targets[i]);
            variant_free(&answer->variant);
        }
        assert_true(made[0] < made[1] && made[1] <= made[2] && made[2] == 60);
    }
    study_request_clear(&inquiry);
}

TEST(all_are_made_where_none_differs) {
    StudyRequest inquiry = study_request_make(1, 30);
    study_of(&inquiry)->target = 0.5;
    study_of(&inquiry)->metric = STATISTICS_IMPACTS;
    // Nothing reaches the stops: a rare seed might.
    ((ExcitationRandom *)(void *)inquiry.simulation.scene.excitation)->rms = 1e-6;
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 30 && answer->target.is_kept &&
                answer->target.estimated_error == 0);
    assert_true(answer->statistics.impacts.mean == 0 && answer->statistics.impacts.high == 0);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(a_seed_that_fails_is_a_row_with_its_reason) {
    StudyRequest inquiry = study_request_make(4, 20);
    complete(&inquiry);
    Ensemble *whole = make(&inquiry, NULL);
    const SimulationLimits limits = {.impacts = (size_t)whole->statistics.impacts.median};
    Ensemble *answer = make(&inquiry, &limits);
    assert_true(answer->made.runs == 20 && answer->made.failed > 0 && answer->made.failed < 20);
    assert_int_equal(answer->made.failures.count, 1);
    assert_string_equal(answer->made.failures.at[0].reason, "limit");
    assert_true(answer->made.warnings.count == 1);
    assert_non_null(strstr(answer->made.warnings.at[0].detail, "of 20 runs failed; the first"));
    assert_true(answer->made.failures.at[0].count == answer->made.failed);
    assert_true(answer->statistics.rms_displacement.count == 20 - answer->made.failed);
    bool is_first = true;
    for (size_t i = 0; i < 20; i++) {
        const RunRecord *row = &answer->table.at[i];
        assert_true((row->why != NULL) == (whole->table.at[i].summary.impacts > limits.impacts));
        if (row->why == NULL)
            continue;
        assert_true(isnan(row->steps) && isnan(row->summary.rms_displacement));
        assert_non_null(strstr(row->why, "impacts"));
        if (is_first)
            assert_int_equal(answer->made.failures.at[0].first, row->number);
        is_first = false;
    }
    variant_free(&answer->variant);
    variant_free(&whole->variant);
    study_request_clear(&inquiry);
}

TEST(where_all_fail_the_study_says_so_and_nothing_else) {
    StudyRequest inquiry = study_request_make(4, 10);
    study_of(&inquiry)->target = 0.1;
    complete(&inquiry);
    const SimulationLimits limits = {.impacts = 1};
    Ensemble *answer = make(&inquiry, &limits);
    assert_true(answer->made.runs == 10 && answer->made.failed == 10 && !answer->target.is_kept);
    assert_true(isnan(answer->target.estimated_error));
    assert_true(isnan(answer->statistics.rms_displacement.mean) && answer->spectra.count == 0);
    assert_non_null(strstr(answer->target.why, "none of the 10 runs"));
    assert_non_null(strstr(answer->made.warnings.at[0].detail, "so that nothing is known"));
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(what_is_not_known_is_not_told) {
    StudyRequest inquiry = study_request_make(2, 3);
    paper_model(&inquiry.simulation, "impulse");
    paper_no_psd(&inquiry.simulation);
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(isnan(answer->statistics.peak_contact_force.mean));
    assert_true(answer->statistics.impacts.mean > 0);
    assert_true(answer->spectra.count == 0 && answer->frequency.count == 0);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

typedef struct CpuBudget {
    int left, asked;
    double last;
} CpuBudget;

static bool lose(void *context, double fraction) {
    CpuBudget *patience = context;
    assert_true(fraction >= patience->last - 1e-12 && fraction <= 1 + 1e-9);
    patience->last = fraction;
    patience->asked++;
    return patience->left-- > 0;
}

TEST(it_tells_its_progress_and_can_be_stopped_wherever_it_is) {
    StudyRequest inquiry = study_request_make(1, 40);
    study_of(&inquiry)->target = 0.1;
    complete(&inquiry);
    Ensemble *answer;
    CpuBudget patience = {.left = 1 << 30};
    const Progress progress = {&patience, lose};
    assert_int_equal(run(&inquiry, &progress, NULL, NULL, &answer), STATUS_OK);
    const int whole = patience.asked;
    assert_true(whole >= (int)answer->made.runs && patience.last > 0.5);
    variant_free(&answer->variant);
    for (int left = 0; left < whole; left += 1 + whole / 40) {
        patience = (CpuBudget){.left = left};
        problem_clear(&problem);
        assert_int_equal(run(&inquiry, &progress, NULL, NULL, &answer), STATUS_CANCELLED);
        assert_null(answer);
        assert_int_equal(patience.asked, left + 1); // and asks no more
    }
    study_request_clear(&inquiry);
}

TEST(the_same_study_has_the_same_bytes_in_any_workspace) {
    StudyRequest inquiry = study_request_make(3, 20);
    study_of(&inquiry)->target = 0.08;
    study_of(&inquiry)->metric = STATISTICS_PSD;
    complete(&inquiry);
    Workspace workspace = {0};
    Taken taken[3] = {{NULL, 0}};
    for (size_t i = 0; i < 3; i++) {
        Ensemble *answer;
        assert_int_equal(run(&inquiry, NULL, NULL, i > 0 ? &workspace : NULL, &answer), STATUS_OK);
        canonical_write(study_ensemble.answer->fields, answer, take, &taken[i]);
        variant_free(&answer->variant);
    }
    for (size_t i = 1; i < 3; i++) {
        assert_int_equal(taken[i].count, taken[0].count);
        assert_memory_equal(taken[i].bytes, taken[0].bytes, taken[0].count);
    }
    for (size_t i = 0; i < 3; i++)
        free(taken[i].bytes);
    workspace_clear(&workspace);
    study_request_clear(&inquiry);
}

static void assert_refused(StudyRequest *inquiry, const SimulationLimits *limits,
                           const char *pointer, const char *says) {
    problem_clear(&problem);
    assert_int_equal(study_request_complete(inquiry, limits, NULL, &problem), STATUS_INVALID);
    if (!problem_concerns(&problem, pointer) || strstr(problem.faults[0].detail, says) == NULL)
        fail_msg("%s: %s", problem.faults[0].pointer, problem.faults[0].detail);
    study_request_clear(inquiry);
}

TEST(what_cannot_be_answered_is_refused) {
    StudyRequest inquiry = study_request_make(1, 20);
    paper_free(&inquiry.simulation, 0.015);
    assert_refused(&inquiry, NULL, "/study/kind", "must be random, is free");

    inquiry = study_request_make(1, 1);
    assert_refused(&inquiry, NULL, "/study/runs", "must be within [2, 10000]");

    inquiry = study_request_make(1, 20);
    study_of(&inquiry)->target = 0;
    assert_refused(&inquiry, NULL, "/study/target", "must be above 0");

    inquiry = study_request_make(1, 20);
    study_of(&inquiry)->first_seed = (UINT64_C(1) << 53) - 19;
    assert_refused(&inquiry, NULL, "/study/first_seed", "must be at most 9007199254740972");

    inquiry = study_request_make(1, 20);
    study_of(&inquiry)->target = 0.1;
    study_of(&inquiry)->metric = STATISTICS_PEAK_CONTACT_FORCE;
    paper_model(&inquiry.simulation, "impulse");
    assert_refused(&inquiry, NULL, "/study/metric", "impulses have none");

    inquiry = study_request_make(600, 20);
    inquiry.simulation.output.psd.segment = 600000;
    assert_refused(&inquiry, NULL, "/output/psd/segment", "at most 262144 are allowed");

    inquiry = study_request_make(1, 2000);
    const SimulationLimits limits = {.steps = 1e5};
    assert_refused(&inquiry, &limits, "/study", "at most 0.03 s are allowed: ask for fewer runs");
}

TEST(a_metric_without_a_target_is_left_out) {
    StudyRequest inquiry = study_request_make(1, 20);
    study_of(&inquiry)->metric = STATISTICS_PSD;
    complete(&inquiry);
    assert_int_equal(study_of(&inquiry)->metric, CHOICE_ABSENT);
    study_of(&inquiry)->target = 0.1;
    complete(&inquiry);
    assert_int_equal(study_of(&inquiry)->metric, STATISTICS_RMS_DISPLACEMENT);
    study_request_clear(&inquiry);
}
