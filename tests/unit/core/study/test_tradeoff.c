

#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/study/study.h"
#include "core/study/tradeoff.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

// A clock that goes on by 1/128 s whenever it is looked at: each timing is of one run.
#define TICK 0.0078125
static double cpu(void *context) {
    return *(double *)context += TICK;
}

static TradeoffStudy *study_of(StudyRequest *inquiry) {
    return (TradeoffStudy *)(void *)inquiry->study;
}

// The paper's scene with a study of so many repeats; completed by the caller.
static StudyRequest study_request_make(double contact_time, double duration, uint64_t repeats) {
    StudyRequest inquiry = {0};
    paper_scene(&inquiry.simulation, 0.61, contact_time, duration);
    inquiry.study = variant_new(&study_tradeoff.kind);
    assert_non_null(inquiry.study);
    study_of(&inquiry)->repeats = repeats;
    problem_clear(&problem);
    return inquiry;
}

static void complete(StudyRequest *inquiry) {
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static Status run(const StudyRequest *inquiry, const Progress *progress,
                  const SimulationLimits *limits, Tradeoff **answer) {
    double now = 0;
    const StudyTools tools = {
        .limits = limits, .progress = progress, .cpu = cpu, .cpu_context = &now};
    Variant *made = NULL;
    const Status status = study_run(inquiry->study, &inquiry->simulation, &tools, &made, &problem);
    *answer = (Tradeoff *)(void *)made;
    return status;
}

static const TradeoffPoint *find(const Tradeoff *answer, const char *name) {
    for (size_t i = 0; i < answer->points.count; i++)
        if (strcmp(answer->points.at[i].name, name) == 0)
            return &answer->points.at[i];
    fail_msg("there is no point %s", name);
    return NULL;
}

static void solver_add(StudyRequest *inquiry, const char *name) {
    Texts *names = &study_of(inquiry)->solvers;
    names->at = realloc(names->at, (names->count + 1) * sizeof *names->at);
    assert_non_null(names->at);
    names->at[names->count++] = strdup(name);
}

TEST(every_solver_is_tried_and_the_reference_with_less) {
    StudyRequest inquiry = study_request_make(0.025, 2, 3);
    Tradeoff *answer;
    complete(&inquiry);
    assert_int_equal(run(&inquiry, NULL, NULL, &answer), STATUS_OK);
    static const char *const names[] = {"exact",
                                        "precise, step 0.001 s",
                                        "rk4, step 0.0001 s",
                                        "newmark, step 1e-05 s",
                                        "adaptive, tolerance 1e-09",
                                        "exact, contact impulse",
                                        "exact, sampled at 500 Hz",
                                        "exact, segments of 500"};
    for (size_t i = 0; i < COUNT(names); i++) {
        const TradeoffPoint *point = find(answer, names[i]);
        assert_int_equal(point->status, TRADEOFF_MEASURED);
        assert_true(point->cpu_minimum == TICK && point->cpu_median == TICK);
        assert_int_equal(point->runs, 3);
        assert_true(point->steps > 0);
    }
    const TradeoffPoint *exact = find(answer, "exact"), *impulse = find(answer, names[5]);
    assert_true(exact->errors.displacement == answer->reference.yardstick.error_estimate);
    assert_true(exact->errors.psd == 0 && exact->errors.peak_force == 0);
    assert_true(isnan(impulse->errors.peak_force) && impulse->errors.displacement > 0.01);
    assert_true(find(answer, names[2])->errors.displacement <
                find(answer, "rk4, step 0.001 s")->errors.displacement);
    assert_true(isnan(find(answer, names[7])->errors.displacement));
    // All take as long: the closest alone is best.
    assert_true(exact->is_best && !impulse->is_best);
    assert_int_equal(answer->recommendation.point, 1);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(a_point_that_fails_or_is_refused_stands_with_its_reason) {
    StudyRequest inquiry = study_request_make(0.0003, 2, 1);
    Tradeoff *answer;
    solver_add(&inquiry, "rk4");
    study_of(&inquiry)->point_steps = 1e6;
    complete(&inquiry);
    assert_int_equal(run(&inquiry, NULL, NULL, &answer), STATUS_OK);
    const TradeoffPoint *unstable = find(answer, "rk4, step 0.001 s");
    const TradeoffPoint *sound = find(answer, "rk4, step 0.0001 s");
    const TradeoffPoint *long_one = find(answer, "rk4, step 1e-05 s");
    assert_int_equal(unstable->status, TRADEOFF_FAILED);
    assert_non_null(strstr(unstable->why, "unstable"));
    assert_int_equal(sound->status, TRADEOFF_MEASURED);
    assert_null(sound->why);
    assert_int_equal(long_one->status, TRADEOFF_REFUSED);
    assert_non_null(strstr(long_one->why, "more than the 1e+06"));
    assert_true(isnan(unstable->cpu_minimum) && isnan(long_one->errors.displacement));
    assert_int_equal(answer->points.count, 3); // what is finer still goes without saying
    for (size_t i = 0; i < answer->points.count; i++)
        assert_string_equal(answer->points.at[i].solver, "rk4");
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

typedef struct CpuBudget {
    int left, asked;
    double last;
} CpuBudget;

static bool lose(void *context, double fraction) {
    CpuBudget *patience = context;
    assert_true(fraction >= 0 && fraction <= 1 + 1e-9);
    patience->last = fraction;
    patience->asked++;
    return patience->left-- > 0;
}

TEST(it_can_be_stopped_wherever_it_is) {
    StudyRequest inquiry = study_request_make(0.025, 1, 2);
    Tradeoff *answer;
    solver_add(&inquiry, "exact");
    complete(&inquiry);
    CpuBudget patience = {.left = 1 << 30};
    const Progress progress = {&patience, lose};
    assert_int_equal(run(&inquiry, &progress, NULL, &answer), STATUS_OK);
    variant_free(&answer->variant);
    const int whole = patience.asked;
    assert_true(whole > 8);
    for (int left = 0; left < whole; left += 1 + whole / (IMPACTD_SANITIZED ? 8 : 40)) {
        patience = (CpuBudget){.left = left};
        problem_clear(&problem);
        assert_int_equal(run(&inquiry, &progress, NULL, &answer), STATUS_CANCELLED);
        assert_null(answer);
        assert_int_equal(patience.asked, left + 1); // and asks no more
    }
    study_request_clear(&inquiry);
}

TEST(the_same_study_has_the_same_errors) {
    StudyRequest inquiry = study_request_make(0.004, 2, 1);
    Tradeoff *a, *b;
    complete(&inquiry);
    assert_int_equal(run(&inquiry, NULL, NULL, &a), STATUS_OK);
    assert_int_equal(run(&inquiry, NULL, NULL, &b), STATUS_OK);
    assert_int_equal(a->points.count, b->points.count);
    for (size_t i = 0; i < a->points.count; i++) {
        assert_memory_equal(&a->points.at[i].errors, &b->points.at[i].errors,
                            sizeof a->points.at[i].errors);
        assert_memory_equal(&a->points.at[i].steps, &b->points.at[i].steps, sizeof(double));
    }
    variant_free(&a->variant);
    variant_free(&b->variant);
    study_request_clear(&inquiry);
}

typedef struct Taken {
    unsigned char bytes[4096];
    size_t count;
} Taken;

static void take(void *context, const void *bytes, size_t size) {
    Taken *taken = context;
    assert_true(taken->count + size <= sizeof taken->bytes);
    memcpy(taken->bytes + taken->count, bytes, size);
    taken->count += size;
}

TEST(without_a_study_an_inquiry_is_its_scene_to_the_byte) {
    StudyRequest inquiry = study_request_make(0.025, 2, 3);
    Taken scene = {.count = 0}, whole = {.count = 0}, studied = {.count = 0};
    complete(&inquiry);
    canonical_write(simulation_fields, &inquiry.simulation, take, &scene);
    canonical_write(study_request_fields, &inquiry, take, &studied);
    variant_free(inquiry.study);
    inquiry.study = NULL;
    canonical_write(study_request_fields, &inquiry, take, &whole);
    assert_int_equal(scene.count, whole.count);
    assert_memory_equal(scene.bytes, whole.bytes, scene.count);
    assert_true(studied.count > whole.count);
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
    StudyRequest inquiry = study_request_make(0.025, 2, 3);
    study_of(&inquiry)->metric = METRIC_PSD;
    paper_no_psd(&inquiry.simulation);
    assert_refused(&inquiry, NULL, "/study/metric", "psd needs spectra");

    inquiry = study_request_make(0.025, 2, 3);
    study_of(&inquiry)->metric = METRIC_PEAK_FORCE;
    paper_model(&inquiry.simulation, "impulse");
    assert_refused(&inquiry, NULL, "/study/metric", "impulses have none");

    inquiry = study_request_make(0.025, 2, 3);
    solver_add(&inquiry, "exact");
    solver_add(&inquiry, "rk5");
    assert_refused(&inquiry, NULL, "/study/solvers/1", "must be one of exact");

    inquiry = study_request_make(0.025, 2, 0);
    assert_refused(&inquiry, NULL, "/study/repeats", "must be within [1, 1000]");

    inquiry = study_request_make(0.025, 2, 1000);
    const SimulationLimits limits = {.steps = 1e6};
    assert_refused(&inquiry, &limits, "/study", "s of CPU in all, at most 0.3 s are allowed");

    inquiry = study_request_make(0.025, 2, 1);
    inquiry.simulation.scene.sample_rate = 1e5; // the reference and one run: 6.4 MB
    const SimulationLimits room = {.steps = 1e9, .bytes = 12e6};
    assert_refused(&inquiry, &room, "/study",
                   "MB of memory, at most 12 MB are allowed: take a shorter");
}

TEST(the_usual_error_is_the_metrics) {
    static const double usual[] = {1e-3, 1e-2, 1e-2, 0, 0.1, 1e-3, 1e-2, 1e-2};
    for (int metric = 0; metric < METRIC_COUNT; metric++) {
        if (metric == METRIC_PEAK_STOREY_DRIFT)
            continue; // of frames
        StudyRequest inquiry = study_request_make(0.025, 2, 3);
        study_of(&inquiry)->metric = metric;
        complete(&inquiry);
        assert_true(study_of(&inquiry)->error == usual[metric]);
        study_request_clear(&inquiry);
    }
}

TEST(every_storey_of_a_frame_is_compared) {
    StudyRequest inquiry = study_request_make(0.025, 1, 1);
    Variant **structure = &inquiry.simulation.scene.structure;
    scene_choose(structure, &structure_kinds, "frame");
    ShearFrame *frame = (ShearFrame *)(void *)*structure;
    for (size_t i = 0; i < 2; i++) {
        Reals *all[] = {&frame->masses, &frame->stiffnesses};
        const double values[] = {1.35, 865};
        all[i]->at = malloc(4 * sizeof(double));
        assert_non_null(all[i]->at);
        all[i]->count = 4;
        for (size_t k = 0; k < 4; k++)
            all[i]->at[k] = values[i];
    }
    Excitation *start = (Excitation *)(void *)inquiry.simulation.scene.excitation;
    free(start->displacement.at);
    start->displacement.at = calloc(4, sizeof(double));
    assert_non_null(start->displacement.at);
    start->displacement.count = 4;
    start->displacement.at[3] = 0.015;
    solver_add(&inquiry, "exact");
    solver_add(&inquiry, "newmark");
    complete(&inquiry);
    Tradeoff *answer;
    assert_int_equal(run(&inquiry, NULL, NULL, &answer), STATUS_OK);
    const TradeoffPoint *point = find(answer, "newmark, step 0.001 s");
    assert_int_equal(point->status, TRADEOFF_MEASURED);
    assert_true(point->errors.displacement > 0 && point->errors.displacement < 1);
    assert_true(find(answer, "exact")->errors.mean_acceleration == 0);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}
