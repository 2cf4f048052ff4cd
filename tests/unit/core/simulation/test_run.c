#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "core/simulation/simulation.h"
#include "tests/support/fields.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

typedef enum BaseChoice { FREE, RANDOM, SINE, RECORD, HALF_SINE, KINDS } BaseChoice;

static void choose_base(Simulation *simulation, BaseChoice kind) {
    if (kind == RANDOM)
        paper_random(simulation, 1, 1);
    if (kind == SINE)
        paper_sine(simulation, 1, 1);
    if (kind == HALF_SINE) {
        scene_choose(&simulation->scene.excitation, &excitation_kinds, "half_sine");
        ExcitationPulse *pulse = (ExcitationPulse *)(void *)simulation->scene.excitation;
        pulse->amplitude = 2;
        pulse->length = 0.5;
    }
    if (kind == RECORD) { // coarser than the output
        enum { COUNT = 300 };
        scene_choose(&simulation->scene.excitation, &excitation_kinds, "record");
        ExcitationRecord *record = (ExcitationRecord *)(void *)simulation->scene.excitation;
        record->interval = 0.005;
        record->samples.at = malloc(COUNT * sizeof *record->samples.at);
        assert_non_null(record->samples.at);
        record->samples.count = COUNT;
        for (int i = 0; i < COUNT; i++)
            record->samples.at[i] = 0.01 * ((i * i) % 97 - 48);
    }
}

static Outcome *run(BaseChoice kind, double duration, Workspace *workspace) {
    Simulation simulation;
    Problem problem;
    Outcome *outcome;
    problem_clear(&problem);
    paper_scene(&simulation, 0.61, 0.025, duration);
    choose_base(&simulation, kind);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, workspace, &outcome, &problem),
                     STATUS_OK);
    simulation_clear(&simulation);
    return outcome;
}

static void assert_same(const Columns *a, const Columns *b) {
    assert_int_equal(a->count, b->count);
    assert_int_equal(a->rows, b->rows);
    for (size_t c = 0; c < a->count; c++)
        assert_memory_equal(a->at[c].values, b->at[c].values, a->rows * sizeof(double));
}

TEST(a_workspace_leaves_no_trace_in_a_run) {
    Workspace workspace = {0};
    for (int i = 0; i < 4 * KINDS; i++) {
        // Each kind after itself and after others.
        const BaseChoice kind = (BaseChoice)(i < 2 * KINDS ? i / 2 : i % KINDS);
        const double duration = 3 + i / 2 % 2;
        Outcome *fresh = run(kind, duration, NULL);
        Outcome *used = run(kind, duration, &workspace);
        assert_same(&fresh->response.series, &used->response.series);
        assert_same(&fresh->spectrum.densities, &used->spectrum.densities);
        assert_int_equal(fresh->response.impacts.count, used->response.impacts.count);
        for (size_t k = 0; k < fresh->response.impacts.count; k++)
            assert_true(fresh->response.impacts.at[k].start == used->response.impacts.at[k].start &&
                        fresh->response.impacts.at[k].impulse ==
                            used->response.impacts.at[k].impulse);
        assert_memory_equal(&fresh->response.peaks, &used->response.peaks,
                            sizeof fresh->response.peaks);
        assert_memory_equal(&fresh->summary.error_estimate, &used->summary.error_estimate,
                            sizeof fresh->summary.error_estimate);
        assert_memory_equal(&fresh->response.energy, &used->response.energy,
                            sizeof fresh->response.energy);
        outcome_unref(fresh);
        outcome_unref(used);
    }
    workspace_clear(&workspace);
}

static Problem fault;

typedef struct Looks {
    int count, most;
    double furthest;
} Looks;

static bool look(void *context, double fraction) {
    Looks *looks = context;
    looks->furthest = fraction > looks->furthest ? fraction : looks->furthest;
    return ++looks->count < looks->most;
}

// How far a run of four million samples has come when it is stopped at its so many-th look.
static double stopped_at(double displacement, const char *channel, int most) {
    Simulation simulation = {0};
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_start(&simulation, displacement, 0);
    simulation.scene.duration = 4194;
    simulation.scene.sample_rate = 1000;
    Texts *wanted = &simulation.output.channels;
    for (size_t i = 0; i < wanted->count; i++)
        free(wanted->at[i]);
    free(wanted->at);
    *wanted = texts_of(1, &channel);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &fault), STATUS_OK);
    Outcome *outcome = NULL;
    Looks looks = {.most = most};
    const Progress progress = {&looks, look};
    assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, &fault),
                     STATUS_CANCELLED);
    assert_int_equal(looks.count, most);
    simulation_clear(&simulation);
    return looks.furthest;
}

// Millions of values take long to write, before the first step of all.
TEST(a_run_looks_many_times_while_its_columns_are_made_ready) {
    assert_true(stopped_at(0.015, "contact_force", 60) < 0.21);
    assert_true(stopped_at(0.015, "base_acceleration", 60) < 0.21);
}

TEST(a_run_at_rest_can_be_stopped) {
    (void)stopped_at(0, "displacement", 60);
    (void)stopped_at(0, "damper_displacement", 3);
}

// Intervals of a hundred periods of the structure: where no stop is in reach they are one step
// each, else the run looks whether to go on within them, too.
TEST(long_intervals_take_one_step_or_many_looks) {
    for (int has_stops = 0; has_stops < 2; has_stops++) {
        Simulation simulation;
        Problem problem;
        Outcome *outcome;
        Looks looks = {.most = INT_MAX};
        const Progress progress = {&looks, look};
        problem_clear(&problem);
        paper_scene(&simulation, 0.61, 0.025, 5000);
        simulation.scene.sample_rate = 0.04;
        if (has_stops == 0)
            simulation.scene.dampers.at[0].clearance = 1e6;
        paper_sine(&simulation, 1, 3);
        paper_no_psd(&simulation);
        assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
        assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, &problem),
                         STATUS_OK);
        assert_true(has_stops == 0 ? outcome->work.arcs < 100 : looks.count > 20);
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}
