// Requests judged and completed to their canonical form.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/simulation/simulation.h"
#include "core/solve/exact.h"
#include "core/solve/solver.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"
#include "tests/support/verdict.h"

static Verdict told;

static Status complete(Simulation *simulation) {
    return verdict_complete(&told, simulation);
}

static Damper *damper_of(Simulation *simulation) {
    return &simulation->scene.dampers.at[0];
}

static SdofStructure *sdof_of(Simulation *simulation) {
    return (SdofStructure *)(void *)simulation->scene.structure;
}

static void want(Texts *texts, size_t count, const char *const *names) {
    for (size_t i = 0; i < texts->count; i++)
        free(texts->at[i]);
    free(texts->at);
    *texts = texts_of(count, names);
}

typedef struct CanonicalBytes {
    unsigned char at[4096];
    size_t length;
} CanonicalBytes;

static void take(void *context, const void *bytes, size_t size) {
    CanonicalBytes *all = context;
    assert_true(size <= sizeof all->at - all->length);
    memcpy(all->at + all->length, bytes, size);
    all->length += size;
}

static CanonicalBytes canonical(const Simulation *simulation) {
    CanonicalBytes all = {.length = 0};
    canonical_write(simulation_fields, simulation, take, &all);
    return all;
}

static bool same(const CanonicalBytes *a, const CanonicalBytes *b) {
    return a->length == b->length && memcmp(a->at, b->at, a->length) == 0;
}

TEST(the_papers_scene_is_sound_and_complete) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(told.problem.count, 0);
    assert_int_equal(told.warnings.count, 0);
    assert_int_equal(simulation.output.channels.count, 5);
    assert_int_equal(simulation.output.psd.segment, 4096);
    assert_int_equal(simulation.output.psd.overlap, 2048);
    assert_int_equal(simulation.output.psd.window, WELCH_HANN);
    assert_int_equal(simulation.output.psd.detrend, WELCH_DETREND_CONSTANT);
    assert_int_equal(damper_of(&simulation)->storey, 1);
    assert_ptr_equal(simulation.accuracy->kind, solvers[0]);
    simulation_clear(&simulation);
}

TEST(completing_twice_changes_nothing) {
    for (int form = 0; form < 4; form++) {
        Simulation simulation, copy;
        if (form == 3)
            scene_without_damper(&simulation);
        else
            scene_with_damper(&simulation, 0.61, form == 0 ? NAN : 0.025);
        if (form == 2)
            want(&simulation.output.psd.channels, 0, NULL);
        assert_int_equal(complete(&simulation), STATUS_OK);
        const CanonicalBytes once = canonical(&simulation);
        assert_int_equal(fields_copy(simulation_fields, &simulation, &copy), STATUS_OK);
        assert_int_equal(complete(&copy), STATUS_OK);
        const CanonicalBytes twice = canonical(&copy);
        assert_true(same(&once, &twice));
        simulation_clear(&simulation);
        simulation_clear(&copy);
    }
}

TEST(scenes_that_mean_the_same_have_the_same_bytes) {
    Simulation a, b;
    scene_with_damper(&a, 0.61, NAN);
    scene_with_damper(&b, 0.61, 0.025);
    scene_choose(&a.scene.contact, &contact_kinds, "impulse");
    scene_choose(&b.scene.contact, &contact_kinds, "impulse");
    a.title = strdup("one");
    b.labels = texts_of(1, (const char *const[]){"other"});
    b.output.psd.segment = 4096;
    damper_of(&b)->offset = -0.0;
    assert_int_equal(complete(&a), STATUS_OK);
    assert_int_equal(complete(&b), STATUS_OK);
    CanonicalBytes first = canonical(&a), second = canonical(&b);
    assert_true(same(&first, &second));
    damper_of(&b)->offset = 1e-300;
    second = canonical(&b);
    assert_false(same(&first, &second));
    simulation_clear(&a);
    simulation_clear(&b);
}

TEST(all_faults_of_a_scene_are_told_at_once_and_each_once) {
    Simulation simulation;
    scene_with_damper(&simulation, 1.3, 0);
    sdof_of(&simulation)->mass = -1;
    sdof_of(&simulation)->structure.damping_ratio = 0.01;
    damper_of(&simulation)->clearance = -0.5;
    damper_of(&simulation)->position = 1;
    simulation.scene.duration = 0;
    simulation.output.statistics_from = -1;
    want(&simulation.output.channels, 3, (const char *const[]){"velocity", "speed", "velocity"});
    simulation.output.psd.segment = 0;
    simulation.output.psd.overlap = 10;
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_string_equal(detail_at(&told.problem, "/structure/mass"), "must be above 0 kg, is -1");
    verdict_begins(detail_at(&told.problem, "/structure/damping_ratio"), "excludes damping");
    assert_string_equal(detail_at(&told.problem, "/dampers/0/clearance"),
                        "must be at least 0 m, is -0.5");
    assert_string_equal(detail_at(&told.problem, "/dampers/0/buffer/restitution"),
                        "must be within [0, 1], is 1.3");
    assert_string_equal(detail_at(&told.problem, "/dampers/0/buffer/contact_time"),
                        "must be above 0 s, is 0");
    assert_string_equal(detail_at(&told.problem, "/duration"), "must be above 0 s, is 0");
    verdict_begins(detail_at(&told.problem, "/output/channels/1"),
                   "must be one of usual, displacement");
    verdict_begins(detail_at(&told.problem, "/output/channels/2"), "velocity is asked for twice");
    verdict_begins(detail_at(&told.problem, "/output/statistics_from"), "must be at least 0 s");
    verdict_begins(detail_at(&told.problem, "/output/psd/segment"), "must be at least 1");
    assert_int_equal(told.problem.count, 10);
    assert_string_equal(told.problem.detail, "/structure/mass: must be above 0 kg, is -1");
    simulation_clear(&simulation);
}

TEST(a_fault_of_the_reader_fails_the_request_and_is_not_repeated) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    sdof_of(&simulation)->mass = (double)NAN;
    verdict_clear(&told);
    problem_add(&told.problem, STATUS_INVALID, "/structure/mass", "must be a number");
    assert_int_equal(verdict_more(&told, &simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 1);
    assert_string_equal(told.problem.faults[0].detail, "must be a number");
    sdof_of(&simulation)->mass = 1;
    problem_clear(&told.problem);
    problem_add(&told.problem, STATUS_INVALID, "/structur", "unknown key");
    assert_int_equal(verdict_more(&told, &simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 1);
    simulation_clear(&simulation);
}

TEST(an_empty_request_names_what_is_missing) {
    Simulation simulation;
    assert_int_equal(fields_default(simulation_fields, &simulation), STATUS_OK);
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 3);
    assert_string_equal(detail_at(&told.problem, "/structure"),
                        "is required: the primary structure");
    assert_string_equal(detail_at(&told.problem, "/duration"), "is required: simulated time [s]");
    assert_string_equal(detail_at(&told.problem, "/sample_rate"),
                        "is required: samples per second of simulated time [Hz]");
    simulation_clear(&simulation);
    // Also where it was never filled in at all.
    memset(&simulation, 0, sizeof simulation);
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    simulation_clear(&simulation);
    assert_int_equal(fields_default(simulation_fields, &simulation), STATUS_OK);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, NULL), STATUS_INVALID);
    simulation_clear(&simulation);
}

TEST(without_a_damper_its_usual_channels_are_left_out) {
    Simulation simulation;
    scene_without_damper(&simulation);
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.channels.count, 3);
    assert_string_equal(simulation.output.channels.at[2], "acceleration");
    want(&simulation.output.channels, 2, (const char *const[]){"displacement", "contact_force"});
    want(&simulation.output.psd.channels, 1, (const char *const[]){"penetration"});
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 2);
    assert_string_equal(detail_at(&told.problem, "/output/channels/1"),
                        "contact_force needs a damper, the scene has none");
    assert_string_equal(detail_at(&told.problem, "/output/psd/channels/0"),
                        "penetration needs a damper, the scene has none");
    simulation_clear(&simulation);
}

TEST(no_channels_are_what_they_say) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    want(&simulation.output.channels, 0, NULL);
    want(&simulation.output.psd.channels, 0, NULL);
    simulation.output.psd.segment = 100;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.channels.count, 0);
    assert_int_equal(simulation.output.psd.segment, COUNT_ABSENT);
    assert_int_equal(simulation.output.psd.window, CHOICE_ABSENT);
    const CanonicalBytes first = canonical(&simulation);
    // As the reader leaves it where it meets "psd": null.
    const Field *output = fields_find(simulation_fields, "output", NULL);
    const Field *psd = fields_find(output->fields, "psd", NULL);
    assert_true((psd->flags & FIELD_NULL_IS_EMPTY) != 0);
    fields_clear(psd->fields, &simulation.output.psd);
    assert_int_equal(complete(&simulation), STATUS_OK);
    const CanonicalBytes second = canonical(&simulation);
    assert_true(same(&first, &second));
    simulation_clear(&simulation);
}

TEST(a_segment_is_no_longer_than_the_series) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    simulation.scene.duration = 1;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.psd.segment, 1001);
    assert_int_equal(simulation.output.psd.overlap, 500);
    assert_int_equal(told.warnings.count, 0);
    simulation.output.psd.segment = 4096;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.psd.segment, 1001);
    assert_int_equal(simulation.output.psd.overlap, 500);
    assert_string_equal(verdict_warning(&told, "/output/psd/segment"),
                        "is 4096 samples, more than there are: cut to 1001");
    simulation.output.psd.segment = 4096;
    simulation.output.psd.overlap = 3000;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.psd.overlap, 500);
    simulation_clear(&simulation);
}

TEST(segments_overlap_by_less_than_themselves) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    simulation.output.psd.segment = 100;
    simulation.output.psd.overlap = 100;
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 1);
    assert_string_equal(detail_at(&told.problem, "/output/psd/overlap"),
                        "must be less than the segment, 100 samples, is 100");
    simulation.output.psd.segment = COUNT_ABSENT;
    simulation.output.psd.overlap = 5000;
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_string_equal(detail_at(&told.problem, "/output/psd/overlap"),
                        "must be less than the segment, 4096 samples, is 5000");
    simulation.output.psd.segment = 1;
    simulation.output.psd.overlap = COUNT_ABSENT;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(simulation.output.psd.overlap, 0);
    simulation_clear(&simulation);
}

TEST(statistics_begin_within_the_run) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    simulation.output.statistics_from = 10;
    assert_int_equal(complete(&simulation), STATUS_OK);
    simulation.output.statistics_from = 12;
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_string_equal(detail_at(&told.problem, "/output/statistics_from"),
                        "must not be behind the last sample, within [0, 10] s, is 12");
    simulation_clear(&simulation);
}

TEST(a_scene_that_would_take_too_long_is_refused_beforehand) {
    const SimulationLimits few = {.samples = 1 << 25, .steps = 1e6};
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    problem_clear(&told.problem);
    assert_int_equal(simulation_complete(&simulation, &few, NULL, &told.problem), STATUS_OK);
    ((SdofStructure *)(void *)simulation.scene.structure)->damping = 1e12;
    assert_int_equal(simulation_complete(&simulation, &few, NULL, &told.problem), STATUS_INVALID);
    assert_true(problem_concerns(&told.problem, "/duration"));
    simulation_clear(&simulation);
}

TEST(so_is_one_whose_solver_would_take_too_many_steps) {
    const SimulationLimits few = {.samples = 1 << 25, .steps = 1e6};
    for (const Solver *const *solver = solvers; *solver != NULL; solver++) {
        if ((*solver)->cost == NULL)
            continue;
        Simulation simulation;
        scene_with_damper(&simulation, 0.61, 0.025);
        scene_choose(&simulation.accuracy, &solver_kinds, (*solver)->kind.name);
        simulation.scene.duration = 1;
        simulation.output.reduction = false;
        problem_clear(&told.problem);
        assert_int_equal(simulation_complete(&simulation, &few, NULL, &told.problem), STATUS_OK);
        simulation.scene.duration = 1e4;
        assert_int_equal(simulation_complete(&simulation, &few, NULL, &told.problem),
                         STATUS_INVALID);
        assert_non_null(strstr(detail_at(&told.problem, "/accuracy"), (*solver)->kind.name));
        simulation_clear(&simulation);
    }
}

TEST(titles_and_labels_have_their_limits) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    simulation.title = malloc(202);
    memset(simulation.title, 't', 201);
    simulation.title[201] = '\0';
    const char *labels[33];
    for (size_t i = 0; i < COUNT(labels); i++)
        labels[i] = "label";
    simulation.labels = texts_of(COUNT(labels), labels);
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_int_equal(told.problem.count, 2);
    assert_string_equal(detail_at(&told.problem, "/title"), "must have at most 200, has 201 bytes");
    assert_string_equal(detail_at(&told.problem, "/labels"), "must have at most 32, has 33 texts");
    simulation_clear(&simulation);
}

static void damp_more(Simulation *simulation, size_t count) {
    Damper *dampers = realloc(simulation->scene.dampers.at, count * sizeof *dampers);
    assert_non_null(dampers);
    for (size_t i = 1; i < count; i++)
        assert_int_equal(fields_copy(damper_fields, &dampers[0], &dampers[i]), STATUS_OK);
    simulation->scene.dampers = (Dampers){dampers, count};
}

TEST(sixty_four_dampers_are_the_most) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    damp_more(&simulation, 64);
    assert_int_equal(complete(&simulation), STATUS_OK);
    damp_more(&simulation, 65);
    assert_int_equal(complete(&simulation), STATUS_INVALID);
    assert_string_equal(detail_at(&told.problem, "/dampers"),
                        "must have at most 64, has 65 elements");
    simulation_clear(&simulation);
}

TEST(accuracy_is_chosen_by_its_solver) {
    assert_string_equal(solver_kinds.tag, "solver");
    assert_ptr_equal(solver_kinds.at(0), solvers[0]);
    assert_ptr_equal(kind_find(&solver_kinds, "exact"), &solver_exact.kind);
    for (size_t i = 0; solvers[i] != NULL; i++)
        assert_ptr_equal(kind_find(&solver_kinds, solvers[i]->kind.name), &solvers[i]->kind);
    assert_null(kind_find(&solver_kinds, "euler"));
}

static int teardown(void **state) {
    (void)state;
    verdict_clear(&told);
    return 0;
}

// What no law of the scene uses is left out, and so is no other scene.
TEST(a_tolerance_is_for_power_laws_alone) {
    static const char *const models[] = {"spring_damper", "impulse", "auto", "hunt_crossley",
                                         "jankowski"};
    for (size_t i = 0; i < COUNT(models); i++) {
        CanonicalBytes bytes[2];
        for (int has = 0; has < 2; has++) {
            Simulation simulation;
            scene_with_damper(&simulation, 0.61, 0.025);
            scene_choose(&simulation.scene.contact, &contact_kinds, models[i]);
            scene_choose(&simulation.accuracy, &solver_kinds, "exact");
            AccuracyExact *exact = (AccuracyExact *)(void *)simulation.accuracy;
            assert_true(isnan(exact->tolerance));
            if (has == 1)
                exact->tolerance = 1e-6;
            Problem problem;
            problem_clear(&problem);
            assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
            assert_int_equal(isnan(exact->tolerance), has == 0 || i < 3);
            bytes[has] = canonical(&simulation);
            simulation_clear(&simulation);
        }
        assert_int_equal(same(&bytes[0], &bytes[1]), i < 3);
    }
}

TEST_GROUP(NULL, teardown)
