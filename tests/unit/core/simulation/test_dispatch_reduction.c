// The reduction of peaks and rms by dampers: a comparison with the scene without them.
#include "core/simulation/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Outcome *run(Simulation *simulation) {
    Outcome *outcome = NULL;
    Problem problem;
    problem_clear(&problem);
    const Status status = simulation_complete(simulation, NULL, NULL, &problem);
    if (status != STATUS_OK)
        print_error("%s %s\n", problem.faults[0].pointer, problem.faults[0].detail);
    assert_int_equal(status, STATUS_OK);
    assert_int_equal(simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    return outcome;
}

TEST(a_reduction_is_that_of_two_runs) {
    Simulation with, without;
    scene_with_damper(&with, 0.61, 0.025);
    scene_without_damper(&without);
    Outcome *a = run(&with), *b = run(&without);
    assert_true(a->has_reduction && !b->has_reduction);
    const Reduction *reduction = &a->reduction;
    assert_true(reduction->peak_displacement_reduction ==
                1 - a->summary.peak_displacement / b->summary.peak_displacement);
    assert_true(fabs(reduction->rms_displacement_reduction -
                     (1 - a->summary.rms_displacement / b->summary.rms_displacement)) < 1e-12);
    assert_true(reduction->rms_displacement_reduction > 0.3);
    assert_true(fabs(reduction->rms_acceleration_reduction -
                     (1 - a->summary.rms_acceleration / b->summary.rms_acceleration)) < 1e-12);
    assert_true(fabs(reduction->peak_acceleration_reduction -
                     (1 - a->summary.peak_acceleration / b->summary.peak_acceleration)) < 1e-12);
    outcome_unref(a);
    outcome_unref(b);
    simulation_clear(&with);
    simulation_clear(&without);
}

TEST(the_rest_is_as_without_it_and_its_cost_is_predicted) {
    Simulation asked, plain;
    scene_with_damper(&asked, 0.61, 0.025);
    scene_with_damper(&plain, 0.61, 0.025);
    plain.output.reduction = false;
    Outcome *a = run(&asked), *b = run(&plain);
    assert_true(a->has_reduction && !b->has_reduction);
    assert_memory_equal(a->response.series.block, b->response.series.block,
                        a->response.series.count * a->response.series.rows * sizeof(double));
    assert_true(a->steps > b->steps);
    const Cost dear = simulation_cost(&asked), cheap = simulation_cost(&plain);
    Simulation bare = plain;
    bare.scene.dampers.count = bare.output.channels.count = bare.output.psd.channels.count = 0;
    const double apart = simulation_cost(&bare).steps;
    assert_true(apart > 0 && dear.steps == cheap.steps + apart);
    outcome_unref(a);
    outcome_unref(b);
    simulation_clear(&asked);
    simulation_clear(&plain);
}

TEST(where_nothing_moves_nothing_is_known) {
    Simulation still;
    scene_with_damper(&still, 0.61, 0.025);
    scene_start(&still, 0, 0);
    Outcome *outcome = run(&still);
    assert_true(outcome->has_reduction);
    assert_true(isnan(outcome->reduction.peak_displacement_reduction));
    outcome_unref(outcome);
    simulation_clear(&still);
}

TEST(every_law_and_a_target_have_one) {
    for (size_t i = 0; contacts[i] != NULL; i++) {
        Simulation simulation;
        // Hertz's gives all energy back.
        scene_with_damper(&simulation, contacts[i] == &contact_hertz ? 1 : 0.61, 0.025);
        scene_choose(&simulation.scene.contact, &contact_kinds, contacts[i]->kind.name);
        if (i == 0)
            ((AccuracyAuto *)(void *)simulation.accuracy)->target = 1e-4;
        Outcome *outcome = run(&simulation);
        assert_true(outcome->has_reduction &&
                    fabs(outcome->reduction.rms_displacement_reduction) < 1);
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

static bool never(void *context, double fraction) {
    (void)context;
    return fraction < 0.8;
}

TEST(it_can_be_stopped) {
    Simulation simulation;
    Outcome *outcome = NULL;
    const Progress progress = {NULL, never};
    scene_with_damper(&simulation, 0.61, 0.025);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, NULL),
                     STATUS_CANCELLED);
    assert_null(outcome);
    simulation_clear(&simulation);
}

// A workspace keeps the baselines that are dear; the answer is the same, with the same work.
TEST(a_baseline_is_computed_once) {
    Simulation simulation;
    Workspace workspace = {0};
    Outcome *outcomes[3];
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_choose(&simulation.accuracy, &solver_kinds, "rk4");
    for (size_t i = 0; i < COUNT(outcomes); i++) {
        if (i == 2)
            simulation.scene.dampers.at[0].clearance *= 2;
        assert_int_equal(simulation_complete(&simulation, NULL, NULL, NULL), STATUS_OK);
        assert_int_equal(simulation_run(&simulation, NULL, NULL, &workspace, &outcomes[i], NULL),
                         STATUS_OK);
    }
    assert_int_equal(workspace.next_baseline, 1);
    assert_memory_equal(&outcomes[0]->reduction, &outcomes[1]->reduction, sizeof(Reduction));
    assert_memory_equal(&outcomes[0]->work, &outcomes[1]->work, sizeof(WorkCounters));
    assert_true(outcomes[0]->steps == outcomes[1]->steps);
    const double rms = outcomes[0]->summary.rms_displacement;
    assert_true(fabs(rms / (1 - outcomes[0]->reduction.rms_displacement_reduction) -
                     outcomes[2]->summary.rms_displacement /
                         (1 - outcomes[2]->reduction.rms_displacement_reduction)) < 1e-12 * rms);
    simulation.scene.duration *= 2;
    outcome_unref(outcomes[2]);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, &workspace, &outcomes[2], NULL),
                     STATUS_OK);
    assert_int_equal(workspace.next_baseline, 2);
    for (size_t i = 0; i < COUNT(outcomes); i++)
        outcome_unref(outcomes[i]);
    workspace_clear(&workspace);
    simulation_clear(&simulation);
}
