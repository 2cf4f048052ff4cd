#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/excitation/excitation.h"
#include "core/study/optimize.h"
#include "tests/support/fields.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static OptimizeStudy *study_of(const StudyRequest *request) {
    return (OptimizeStudy *)(void *)request->study;
}

// The paper's free vibration for 2 s; the rms displacement is to be small.
static StudyRequest request_make(size_t candidates) {
    StudyRequest request = {0};
    scene_with_damper(&request.simulation, 0.61, 0.025);
    request.simulation.scene.duration = 2;
    request.study = variant_new(&study_optimize.kind);
    assert_non_null(request.study);
    OptimizeStudy *study = study_of(&request);
    study->max_candidates = candidates;
    study->objectives.at = calloc(2, sizeof *study->objectives.at);
    study->objectives.count = 1;
    study->objectives.at[0].metric = 1; // rms_displacement
    problem_clear(&problem);
    return request;
}

static StudyAxis *variable_add(StudyRequest *request, const char *pointer, double from, double to) {
    StudyAxes *axes = &study_of(request)->variables;
    axes->at = realloc(axes->at, (axes->count + 1) * sizeof *axes->at);
    assert_non_null(axes->at);
    StudyAxis *axis = &axes->at[axes->count++];
    *axis = (StudyAxis){.pointer = strdup(pointer),
                        .from = from,
                        .to = to,
                        .count = COUNT_ABSENT,
                        .spacing = CHOICE_ABSENT};
    return axis;
}

static void constraint_add(StudyRequest *request, int metric, double min, double max) {
    OptimizeConstraints *all = &study_of(request)->constraints;
    all->at = realloc(all->at, (all->count + 1) * sizeof *all->at);
    assert_non_null(all->at);
    all->at[all->count++] = (OptimizeConstraint){metric, min, max};
}

static void complete(StudyRequest *request) {
    problem_clear(&problem);
    if (study_request_complete(request, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
}

static Optimum *run(const StudyRequest *request) {
    const StudyTools tools = {.limits = NULL};
    Variant *answer;
    if (study_run(request->study, &request->simulation, &tools, &answer, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return (Optimum *)(void *)answer;
}

static void end(StudyRequest *request, Optimum *optimum) {
    if (optimum != NULL)
        variant_free(&optimum->variant);
    study_request_clear(request);
}

static double rms_at(const StudyRequest *request, double clearance) {
    Simulation scene;
    Outcome *outcome;
    assert_int_equal(fields_copy(simulation_fields, &request->simulation, &scene), STATUS_OK);
    scene.scene.dampers.at[0].clearance = clearance;
    assert_int_equal(simulation_complete(&scene, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&scene, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    const double rms = outcome->summary.rms_displacement;
    outcome_unref(outcome);
    simulation_clear(&scene);
    return rms;
}

// Every candidate within all intervals of the region is within 2 % of the best.
static void assert_region(const Optimum *optimum) {
    const double best = optimum->best.objectives.at[0].value;
    size_t inside = 0;
    for (size_t i = 0; i < optimum->history.count; i++) {
        const OptimumCandidate *candidate = &optimum->history.at[i];
        bool is_inside = true;
        for (size_t j = 0; j < optimum->region.count; j++) {
            const double value = strtod(candidate->values.at[j].value, NULL);
            is_inside = is_inside && value >= optimum->region.at[j].low &&
                        value <= optimum->region.at[j].high;
        }
        inside += is_inside;
        if (is_inside)
            assert_true(candidate->feasible && candidate->objectives.at[0] <= 1.02 * best);
    }
    assert_true(inside > 1);
}

TEST(the_best_clearance_is_that_of_a_fine_sweep) {
    StudyRequest request = request_make(50);
    variable_add(&request, "/dampers/0/clearance", 0.005, 0.04);
    complete(&request);
    Optimum *optimum = run(&request);
    double least = INFINITY;
    for (size_t i = 0; i <= 500; i++)
        least = fmin(least, rms_at(&request, 0.005 + 0.035 * (double)i / 500));
    assert_int_equal(optimum->candidates, 50);
    assert_int_equal(optimum->made.runs, 52);
    assert_int_equal(optimum->history.count, 50);
    assert_true(optimum->best.feasible && optimum->best.metrics.rms_displacement < 1.003 * least);
    assert_true(optimum->best.objectives.at[0].value == optimum->best.metrics.rms_displacement);
    const double clearance = strtod(optimum->best.values.at[0].value, NULL);
    assert_true(rms_at(&request, clearance) == optimum->best.objectives.at[0].value);
    assert_true(optimum->given.metrics.rms_displacement == rms_at(&request, 0.015));
    assert_true(optimum->undamped.metrics.rms_displacement >
                optimum->given.metrics.rms_displacement);
    assert_true(optimum->undamped.metrics.impacts == 0);
    assert_string_equal(optimum->region.at[0].member.pointer, "/dampers/0/clearance");
    assert_region(optimum);
    assert_true(optimum->region.at[0].low <= clearance && optimum->region.at[0].high >= clearance);
    assert_true(optimum->region.at[0].low < optimum->region.at[0].high);
    for (size_t i = 0; i < optimum->rivals.count; i++) {
        const double other = strtod(optimum->rivals.at[i].values.at[0].value, NULL);
        assert_true(optimum->rivals.at[i].difference >= 0 && fabs(other - clearance) >= 0.0035);
    }
    StudyValue values[1];
    Simulation scene;
    assert_int_equal(study_optimize.solution(request.study, &optimum->variant, values, &problem),
                     STATUS_OK);
    assert_int_equal(study_scene_make(&request.simulation, &study_of(&request)->variables, values,
                                      NULL, false, NULL, &scene, &problem),
                     STATUS_OK);
    assert_true(scene.scene.dampers.at[0].clearance == clearance);
    simulation_clear(&scene);
    end(&request, optimum);
}

typedef struct Text {
    char *at;
    size_t size;
} Text;

static void take(void *context, const void *bytes, size_t size) {
    Text *text = context;
    text->at = realloc(text->at, text->size + size);
    assert_non_null(text->at);
    memcpy(text->at + text->size, bytes, size);
    text->size += size;
}

static StudyRequest request_random(size_t candidates, uint64_t runs) {
    StudyRequest request = request_make(candidates);
    paper_random(&request.simulation, 1, 7);
    study_of(&request)->over.runs = runs;
    variable_add(&request, "/dampers/0/clearance", 0.005, 0.04);
    variable_add(&request, "/dampers/0/mass", 0.02, 0.2);
    return request;
}

TEST(candidates_share_seeds_and_a_repeated_run_gives_the_same_bytes) {
    StudyRequest request = request_random(24, 4);
    complete(&request);
    assert_int_equal(study_of(&request)->over.first_seed, 7);
    Text texts[2] = {{NULL, 0}, {NULL, 0}};
    for (size_t i = 0; i < 2; i++) {
        Optimum *optimum = run(&request);
        canonical_write(study_optimize.answer->fields, optimum, take, &texts[i]);
        if (i == 0) {
            const Reals *interval = &optimum->best.objectives.at[0].interval_95;
            double sum = 0;
            assert_true(interval->count == 2 && interval->at[0] < interval->at[1]);
            for (uint64_t seed = 7; seed < 11; seed++) {
                ((ExcitationRandom *)(void *)request.simulation.scene.excitation)->seed = seed;
                sum += rms_at(&request, 0.015) / 4;
            }
            assert_true(fabs(optimum->given.metrics.rms_displacement / sum - 1) < 1e-12);
            assert_region(optimum);
        }
        end(&(StudyRequest){0}, optimum);
    }
    assert_int_equal(texts[0].size, texts[1].size);
    assert_memory_equal(texts[0].at, texts[1].at, texts[0].size);
    free(texts[0].at);
    free(texts[1].at);
    end(&request, NULL);
}

TEST(two_objectives_give_a_front_in_its_order) {
    StudyRequest request = request_random(30, 2);
    OptimizeStudy *study = study_of(&request);
    study->objectives.count = 2;
    study->objectives.at[1].metric = 4; // impacts
    complete(&request);
    Optimum *optimum = run(&request);
    assert_true(optimum->front.count > 1 && optimum->rivals.count == 0);
    for (size_t i = 1; i < optimum->front.count; i++) {
        const double *before = optimum->front.at[i - 1].objectives.at;
        const double *after = optimum->front.at[i].objectives.at;
        assert_true(before[0] < after[0] && before[1] > after[1]);
    }
    end(&request, optimum);
}

TEST(tied_members_are_all_named_and_variables_without_effect_cause_a_warning) {
    StudyRequest request = request_make(8);
    static const char *const tied[] = {"/dampers/0/clearance", "/dampers/0/mass"};
    StudyAxis *axis = variable_add(&request, tied[0], 0.02, 0.03);
    free(axis->pointer);
    axis->pointer = NULL;
    axis->pointers = texts_of(2, tied);
    study_of(&request)->objectives.at[0].metric = 0; // peak_displacement: that of the start
    complete(&request);
    Optimum *optimum = run(&request);
    const StudyMember *members[] = {&optimum->best.values.at[0].member,
                                    &optimum->history.at[3].values.at[0].member,
                                    &optimum->region.at[0].member};
    for (size_t i = 0; i < COUNT(members); i++) {
        assert_string_equal(members[i]->pointer, tied[0]);
        assert_int_equal(members[i]->pointers.count, 2);
        assert_string_equal(members[i]->pointers.at[1], tied[1]);
    }
    const Warnings *warnings = &optimum->made.warnings;
    assert_true(warnings->count > 0);
    assert_non_null(strstr(warnings->at[warnings->count - 1].detail, "the same objective"));
    end(&request, optimum);
}

TEST(materials_and_maxima_of_a_choice_are_all_tried) {
    StudyRequest request = request_make(500);
    static const char *const masses[] = {"0.05", "0.1", "0.2"};
    variable_add(&request, "/dampers/0/mass", (double)NAN, (double)NAN)->values =
        texts_of(3, masses);
    study_of(&request)->objectives.at[0] = (OptimizeObjective){4, OPTIMIZE_MAXIMIZE};
    complete(&request);
    Optimum *optimum = run(&request);
    assert_int_equal(optimum->candidates, 3);
    double most = 0;
    for (size_t i = 0; i < 3; i++)
        most = fmax(most, optimum->history.at[i].objectives.at[0]);
    assert_true(optimum->best.metrics.impacts == most && most > 0);
    end(&request, optimum);
}

TEST(contacts_without_a_force_do_not_win_by_it) {
    StudyRequest request = request_make(2);
    static const char *const models[] = {"\"impulse\"", "\"spring_damper\""};
    variable_add(&request, "/contact/model", (double)NAN, (double)NAN)->values =
        texts_of(2, models);
    study_of(&request)->objectives.at[0].metric = 5; // peak_contact_force
    complete(&request);
    Optimum *optimum = run(&request);
    assert_true(optimum->made.failed == 0 && optimum->best.metrics.peak_contact_force > 0);
    assert_string_equal(optimum->best.values.at[0].value, models[1]);
    assert_true(isnan(optimum->undamped.metrics.peak_contact_force));
    end(&request, optimum);
}

TEST(constraints_that_none_keeps_are_named_and_the_best_is_absent) {
    StudyRequest request = request_make(20);
    variable_add(&request, "/dampers/0/clearance", 0.005, 0.04);
    constraint_add(&request, 5, (double)NAN, 1e-3);      // peak_contact_force
    constraint_add(&request, 0, (double)NAN, 0.0149999); // peak_displacement: that of the start
    complete(&request);
    Optimum *optimum = run(&request);
    assert_true(optimum->best.values.count == 0 && optimum->best.objectives.count == 0);
    assert_true(field_is_absent(fields_find(study_optimize.answer->fields, "best", NULL), optimum));
    assert_int_equal(optimum->made.warnings.count, 1);
    assert_non_null(strstr(optimum->made.warnings.at[0].detail, "peak_"));
    for (size_t i = 0; i < 20; i++)
        assert_false(optimum->history.at[i].feasible);
    StudyValue values[1];
    assert_int_equal(study_optimize.solution(request.study, &optimum->variant, values, &problem),
                     STATUS_NOT_FOUND);
    end(&request, optimum);
}

// A free mass beyond its stops is no scene.
TEST(candidates_whose_runs_fail_are_counted_and_infeasible) {
    StudyRequest request = request_make(30);
    request.simulation.scene.dampers.at[0].clearance = 0.03;
    variable_add(&request, "/dampers/0/clearance", 0.01, 0.04);
    variable_add(&request, "/dampers/0/position", 0, 0.012);
    complete(&request);
    Optimum *optimum = run(&request);
    size_t infeasible = 0;
    for (size_t i = 0; i < 30; i++) {
        const OptimumCandidate *candidate = &optimum->history.at[i];
        infeasible += !candidate->feasible;
        assert_true((candidate->objectives.count == 0) == !candidate->feasible);
        assert_true(candidate->feasible == (2 * strtod(candidate->values.at[1].value, NULL) <=
                                            strtod(candidate->values.at[0].value, NULL)));
    }
    assert_true(infeasible > 0 && optimum->made.failed == infeasible && optimum->best.feasible);
    assert_int_equal(optimum->made.failures.count, 1);
    assert_string_equal(optimum->made.failures.at[0].reason, "invalid-scene");
    assert_int_equal(optimum->made.failures.at[0].count, infeasible);
    end(&request, optimum);
}

static const char *refusal(StudyRequest *request, const char *pointer) {
    problem_clear(&problem);
    assert_int_equal(study_request_complete(request, NULL, NULL, &problem), STATUS_INVALID);
    return detail_at(&problem, pointer);
}

TEST(senseless_requests_are_refused_where_they_are_wrong) {
    StudyRequest request = request_make(20);
    assert_non_null(strstr(refusal(&request, "/study/variables"), "at least one"));
    StudyAxis *axis = variable_add(&request, "/dampers/0/clearance", 0.04, 0.005);
    assert_non_null(strstr(refusal(&request, "/study/variables/0"), "below"));
    axis->from = -1;
    axis->to = 1;
    assert_non_null(strstr(refusal(&request, "/study/variables/0/from"), "clearance"));
    axis->from = 0.005;
    axis->to = 0.04;
    variable_add(&request, "/dampers/1/mass", 0.1, 0.2);
    assert_non_null(strstr(refusal(&request, "/study/variables/1/pointer"), "dampers"));
    free(study_of(&request)->variables.at[1].pointer);
    study_of(&request)->variables.count = 1;
    study_of(&request)->over.runs = 4;
    assert_non_null(strstr(refusal(&request, "/study/over/runs"), "random"));
    study_of(&request)->over.runs = COUNT_ABSENT;
    study_of(&request)->statistic.of = OPTIMIZE_QUANTILE;
    assert_non_null(strstr(refusal(&request, "/study/statistic"), "mean"));
    study_of(&request)->statistic.of = OPTIMIZE_MAX;
    assert_non_null(strstr(refusal(&request, "/study/statistic"), "/study/over"));
    study_of(&request)->statistic.quantile = 0.5;
    assert_non_null(strstr(refusal(&request, "/study/statistic"), "both"));
    study_of(&request)->statistic = (OptimizeStatistic){CHOICE_ABSENT, (double)NAN};
    study_of(&request)->over.runs = 0;
    assert_non_null(strstr(refusal(&request, "/study/over"), "needs runs, or records"));
    study_of(&request)->over.runs = COUNT_ABSENT;
    PinnedRecords *records = &study_of(&request)->over.records;
    study_of(&request)->over.runs = 0;
    records->at = calloc(2, sizeof *records->at);
    assert_non_null(records->at);
    for (; records->count < 2; records->count++)
        records->at[records->count].name = strdup("quake");
    assert_non_null(strstr(refusal(&request, "/study/over/records/0"), "not loaded"));
    assert_non_null(strstr(refusal(&request, "/study/over/records/1"), "twice"));
    fields_clear(fields_find(study_optimize.kind.fields, "over", NULL)->fields,
                 &study_of(&request)->over);
    constraint_add(&request, 0, (double)NAN, (double)NAN);
    assert_non_null(strstr(refusal(&request, "/study/constraints/0"), "min"));
    study_of(&request)->constraints.at[0].min = 2;
    study_of(&request)->constraints.at[0].max = 1;
    assert_non_null(strstr(refusal(&request, "/study/constraints/0/min"), "at most max"));
    study_of(&request)->constraints.count = 0;
    study_of(&request)->objectives.count = 2;
    study_of(&request)->objectives.at[1].metric = 1;
    assert_non_null(strstr(refusal(&request, "/study/objectives/1/metric"), "another"));
    study_of(&request)->objectives.count = 1;
    complete(&request);
    end(&request, NULL);
}

TEST(variables_that_the_seeds_or_records_of_the_runs_replace_are_refused) {
    StudyRequest request = request_random(20, 2);
    variable_add(&request, "/excitation/seed", 1, 100);
    assert_non_null(strstr(refusal(&request, "/study/variables/2"), "/study/over"));
    StudyAxis *axis = &study_of(&request)->variables.at[2];
    free(axis->pointer);
    axis->pointer = strdup("/excitation/rms");
    complete(&request);
    study_of(&request)->over.runs = 0;
    study_of(&request)->over.first_seed = COUNT_ABSENT;
    PinnedRecords *records = &study_of(&request)->over.records;
    records->at = calloc(1, sizeof *records->at);
    assert_non_null(records->at);
    records->at[records->count++].name = strdup("quake");
    assert_non_null(strstr(refusal(&request, "/study/variables/2"), "/excitation/rms"));
    end(&request, NULL);
}

static NamedRecord *record_make(const char *name) {
    double *values = calloc(50, sizeof *values);
    assert_non_null(values);
    values[10] = 3;
    Reals samples = {values, 50};
    NamedRecord *named = named_record_new(name, "0123", 0.02, &samples);
    assert_non_null(named);
    return named;
}

// What a record keeps of the scene's own, which it replaces, may vary.
TEST(the_initial_state_of_a_record_may_vary) {
    StudyRequest request = request_make(4);
    study_of(&request)->over.runs = 0;
    PinnedRecords *records = &study_of(&request)->over.records;
    records->at = calloc(2, sizeof *records->at);
    assert_non_null(records->at);
    for (; records->count < 2; records->count++) {
        NamedRecord *named = record_make(records->count == 0 ? "quake" : "shock");
        records->at[records->count] =
            (PinnedRecord){strdup(named->name), strdup(named->digest), &named->shared};
    }
    assert_int_equal(study_scene_use_record(&request.simulation, &records->at[0]), STATUS_OK);
    variable_add(&request, "/excitation/displacement", 0.001, 0.01);
    complete(&request);
    Optimum *optimum = run(&request);
    assert_true(optimum->made.failed == 0);
    assert_true(optimum->history.at[0].objectives.at[0] != optimum->history.at[1].objectives.at[0]);
    StudyAxis *axis = &study_of(&request)->variables.at[0];
    free(axis->pointer);
    axis->pointer = strdup("/excitation/name");
    assert_non_null(strstr(refusal(&request, "/study/variables/0"), "/study/over"));
    end(&request, optimum);
}

// After the last run a question of 1, one for every candidate at least.
static bool count_ends(void *context, double fraction) {
    size_t *left = context;
    return fraction < 1 || (*left)-- > 0;
}

TEST(an_optimization_stops_also_while_its_answer_is_made) {
    for (size_t left = 0; left < 20; left++) {
        StudyRequest request = request_make(10);
        variable_add(&request, "/dampers/0/clearance", 0.005, 0.04);
        complete(&request);
        size_t until = left;
        const Progress progress = {&until, count_ends};
        Variant *answer;
        assert_int_equal(study_run(request.study, &request.simulation,
                                   &(StudyTools){.progress = &progress}, &answer, &problem),
                         STATUS_CANCELLED);
        assert_null(answer);
        end(&request, NULL);
    }
}
