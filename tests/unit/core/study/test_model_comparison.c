

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/model_comparison.h"
#include "core/study/study.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static CompareStudy *study_of(StudyRequest *inquiry) {
    return (CompareStudy *)(void *)inquiry->study;
}

static StudyRequest study_request_make(double restitution, double contact_time, double duration) {
    StudyRequest inquiry = {0};
    paper_scene(&inquiry.simulation, restitution, contact_time, duration);
    inquiry.study = variant_new(&study_compare.kind);
    assert_non_null(inquiry.study);
    problem_clear(&problem);
    return inquiry;
}

static void name(Texts *texts, const char *text) {
    texts->at = realloc(texts->at, (texts->count + 1) * sizeof *texts->at);
    assert_non_null(texts->at);
    assert_non_null(texts->at[texts->count++] = strdup(text));
}

static void complete(StudyRequest *inquiry) {
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
}

static Comparison *make(const StudyRequest *inquiry) {
    const StudyTools tools = {0};
    Variant *made = NULL;
    if (study_run(inquiry->study, &inquiry->simulation, &tools, &made, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return (Comparison *)(void *)made;
}

static const CompareEntry *entry_of(const Comparison *answer, const char *called) {
    for (size_t i = 0; i < answer->entries.count; i++)
        if (strcmp(answer->entries.at[i].name, called) == 0)
            return &answer->entries.at[i];
    fail_msg("there is no %s", called);
    return NULL;
}

static void clear(StudyRequest *inquiry, Comparison *answer) {
    if (answer != NULL)
        variant_free(&answer->variant);
    study_request_clear(inquiry);
}

TEST(all_laws_and_both_rules_are_tried_and_what_cannot_be_says_why) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 4);
    complete(&inquiry);
    assert_true(study_of(&inquiry)->models.count == 8 &&
                study_of(&inquiry)->separations.count == 2 && study_of(&inquiry)->storey == 1);
    Comparison *answer = make(&inquiry);
    assert_int_equal(answer->entries.count, 9);
    assert_string_equal(answer->entries.at[0].name, "spring_damper, zero_penetration");
    const CompareEntry *hertz = entry_of(answer, "hertz");
    assert_int_equal(hertz->status, COMPARE_REFUSED);
    assert_non_null(strstr(hertz->why, "/dampers/0/buffer/restitution: must be 1"));
    for (size_t i = 0; i < answer->entries.count; i++) {
        const CompareEntry *entry = &answer->entries.at[i];
        if (entry == hertz)
            continue;
        assert_true(entry->status == COMPARE_RUN && entry->why == NULL);
        assert_true(entry->density.count == answer->frequency.count && entry->steps > 0);
        assert_int_equal(entry->derived.count, 2);
    }
    clear(&inquiry, answer);
}

TEST(the_reference_is_the_scenes_own_run_and_apart_from_itself_by_nothing) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 4);
    name(&study_of(&inquiry)->models, "impulse");
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    assert_int_equal(answer->entries.count, 2);
    const CompareEntry *own = &answer->entries.at[0];
    Outcome *outcome;
    assert_int_equal(simulation_run(&inquiry.simulation, NULL, NULL, NULL, &outcome, &problem),
                     STATUS_OK);
    assert_memory_equal(&own->summary, &outcome->summary, sizeof own->summary);
    assert_memory_equal(own->density.at, outcome->spectrum.densities.at[0].values,
                        own->density.count * sizeof(double));
    outcome_unref(outcome);
    assert_true(own->psd.level == 0 && own->psd.difference == 0 && own->displacement.relative == 0);
    assert_true(isnan(own->divergence.time) && own->differences.rms_displacement == 0);
    const CompareEntry *impulse = &answer->entries.at[1];
    assert_true(impulse->separation == CHOICE_ABSENT && impulse->summary.impacts > 0);
    assert_true(isnan(impulse->differences.peak_contact_force) && impulse->psd.level > 3);
    // The first impact is the same; what follows is not.
    assert_true(impulse->divergence.time > 0.0416 && impulse->divergence.time < 0.2);
    assert_true(impulse->divergence.is_trusted && isnan(impulse->divergence.horizon));
    clear(&inquiry, answer);
}

TEST(each_variant_is_the_scene_with_that_contact) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 3);
    name(&study_of(&inquiry)->separations, "zero_force");
    name(&study_of(&inquiry)->models, "flores");
    name(&study_of(&inquiry)->models, "spring_damper");
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    assert_int_equal(answer->entries.count, 3);
    Simulation single;
    paper_scene(&single, 0.61, 0.025, 3);
    ((Contact *)(void *)single.scene.contact)->separation = SEPARATION_ZERO_FORCE;
    assert_int_equal(simulation_complete(&single, NULL, NULL, &problem), STATUS_OK);
    Outcome *outcome;
    assert_int_equal(simulation_run(&single, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    const CompareEntry *entry = entry_of(answer, "spring_damper, zero_force");
    assert_memory_equal(&entry->summary, &outcome->summary, sizeof entry->summary);
    assert_true(entry->derived.at[0].stiffness == outcome->plan.derived.at[0].stiffness);
    assert_true(entry->contacts.energy_lost == outcome->response.energy.contact);
    outcome_unref(outcome);
    simulation_clear(&single);
    clear(&inquiry, answer);
}

TEST(impulses_alone_leave_no_contact_time_to_others) {
    StudyRequest inquiry = study_request_make(0.61, (double)NAN, 2);
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    assert_string_equal(answer->entries.at[0].name, "impulse");
    const CompareEntry *entry = entry_of(answer, "spring_damper, zero_penetration");
    assert_int_equal(entry->status, COMPARE_REFUSED);
    assert_non_null(strstr(entry->why, "contact_time"));
    assert_true(isnan(entry->steps) && entry->density.count == 0);
    clear(&inquiry, answer);
}

TEST(aluminium_parts_by_little_in_the_band_of_the_base) {
    StudyRequest inquiry = study_request_make(0.46, 0.0003, 30);
    paper_random(&inquiry.simulation, 1, 3);
    name(&study_of(&inquiry)->models, "impulse");
    study_of(&inquiry)->band = (Reals){calloc(2, sizeof(double)), 2};
    study_of(&inquiry)->band.at[0] = 0.5;
    study_of(&inquiry)->band.at[1] = 15;
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    const CompareEntry *impulse = &answer->entries.at[1];
    assert_true(impulse->psd.from >= 0.5 && impulse->psd.to <= 15);
    assert_true(impulse->psd.level > 0.3 && impulse->psd.level < 2.5);
    clear(&inquiry, answer);
}

TEST(a_trace_holds_every_extreme) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 10);
    name(&study_of(&inquiry)->models, "impulse");
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    assert_true(answer->trace_samples == 26); // 10001 samples in at most 400 buckets
    for (size_t i = 0; i < 2; i++) {
        const CompareTrace *trace = &answer->entries.at[i].trace;
        double most = 0;
        for (size_t k = 0; k < trace->minimum.count; k++)
            most = fmax(most, fmax(fabs(trace->minimum.at[k]), fabs(trace->maximum.at[k])));
        assert_true(trace->minimum.count == 385 && trace->maximum.count == 385);
        assert_true(most == answer->entries.at[i].displacement.other_peak);
    }
    clear(&inquiry, answer);
}

TEST(a_target_is_set_aside_so_that_no_variant_becomes_another) {
    StudyRequest inquiry = study_request_make(0.46, 0.0003, 2);
    AccuracyAuto *accuracy = (AccuracyAuto *)(void *)inquiry.simulation.accuracy;
    accuracy->target = 0.1;
    name(&study_of(&inquiry)->models, "impulse");
    complete(&inquiry);
    Comparison *answer = make(&inquiry);
    assert_true(!isnan(answer->entries.at[0].summary.peak_contact_force));
    assert_true(answer->entries.at[0].contacts.mean_duration > 1e-4);
    clear(&inquiry, answer);
}

static bool stop(void *context, double fraction) {
    (void)fraction;
    return ++*(int *)context < 3;
}

TEST(it_stops_when_told_and_its_cost_is_that_of_its_runs) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 10);
    complete(&inquiry);
    int calls = 0;
    const Progress progress = {&calls, stop};
    const StudyTools tools = {.progress = &progress};
    Variant *made;
    assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &made, &problem),
                     STATUS_CANCELLED);
    assert_null(made);
    Cost cost;
    assert_int_equal(study_request_cost(&inquiry, NULL, &cost, NULL), STATUS_OK);
    const double alone = simulation_cost(&inquiry.simulation).steps;
    assert_true(cost.steps > 6 * alone && cost.steps < 60 * alone);
    clear(&inquiry, NULL);
}

TEST(faults_are_told_at_their_places) {
    StudyRequest inquiry = study_request_make(0.61, 0.025, 1);
    CompareStudy *study = study_of(&inquiry);
    name(&study->models, "hertzz");
    name(&study->models, "auto");
    study->storey = 2;
    study->band = (Reals){calloc(1, sizeof(double)), 1};
    assert_int_equal(study_request_complete(&inquiry, NULL, NULL, &problem), STATUS_INVALID);
    assert_true(problem.count == 4);
    assert_string_equal(problem.faults[0].pointer, "/study/models/0");
    assert_string_equal(problem.faults[0].did_you_mean, "hertz");
    assert_string_equal(problem.faults[1].pointer, "/study/models/1");
    assert_string_equal(problem.faults[2].pointer, "/study/storey");
    assert_string_equal(problem.faults[3].pointer, "/study/band");
    study_request_clear(&inquiry);
    StudyRequest bare = {0};
    scene_without_damper(&bare.simulation);
    bare.study = variant_new(&study_compare.kind);
    problem_clear(&problem);
    assert_int_equal(study_request_complete(&bare, NULL, NULL, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/kind");
    study_request_clear(&bare);
}
