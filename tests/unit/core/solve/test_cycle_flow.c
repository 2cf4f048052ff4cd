#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/solve/cycle_flow.h"
#include "tests/support/flows.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static const double TURN = 6.283185307179586;
static Problem problem;

// The paper's damper on a frame of two storeys, and another one below it.
static void frame_scene(Simulation *simulation, double e, double contact_time, double amplitude) {
    paper_scene(simulation, e, contact_time, 1);
    paper_sine(simulation, amplitude, 3);
    Scene *scene = &simulation->scene;
    scene_choose(&scene->structure, &structure_kinds, "frame");
    ShearFrame *frame = (ShearFrame *)(void *)scene->structure;
    assert_true(reals_allocate(&frame->masses, 2) && reals_allocate(&frame->stiffnesses, 2));
    frame->masses.at[0] = frame->masses.at[1] = 1.35;
    frame->stiffnesses.at[0] = frame->stiffnesses.at[1] = 2000;
    frame->structure.damping_ratio = 0.02;
    scene->dampers.at = realloc(scene->dampers.at, 2 * sizeof *scene->dampers.at);
    assert_non_null(scene->dampers.at);
    assert_int_equal(fields_copy(damper_fields, &scene->dampers.at[0], &scene->dampers.at[1]),
                     STATUS_OK);
    scene->dampers.count = 2;
    scene->dampers.at[1].storey = 1;
    scene->dampers.at[1].clearance = 0.01;
}

// The largest difference of the linearised motion over `cycles` to central differences of the
// motion, over the largest value.
static double difference_of(CycleFlow *flow, size_t settle, size_t cycles) {
    const Orbit *orbit = cycle_flow_orbit(flow);
    const size_t size = orbit->size;
    const double *scales = orbit->scales;
    double y[16], columns[256] = {0}, ahead[16], behind[16], worst = 0, most = 0;
    assert_in_range(size, 1, 16);
    assert_int_equal(cycle_flow_run(flow, settle - 1, NULL, 0, NULL), STATUS_OK);
    assert_int_equal(cycle_flow_settle(flow, 1, 1), STATUS_OK); // for the scales
    cycle_flow_get(flow, y);
    cycle_flow_keep(flow);
    for (size_t i = 0; i < size; i++)
        columns[i * size + i] = scales[i];
    assert_int_equal(cycle_flow_run(flow, cycles, columns, size, NULL), STATUS_OK);
    for (size_t i = 0; i < size; i++) {
        for (int side = 1; side >= -1; side -= 2) {
            double moved[16];
            memcpy(moved, y, size * sizeof *y);
            moved[i] += side * 1e-7 * scales[i];
            cycle_flow_restore(flow, moved);
            assert_int_equal(cycle_flow_run(flow, cycles, NULL, 0, NULL), STATUS_OK);
            cycle_flow_get(flow, side > 0 ? ahead : behind);
        }
        for (size_t k = 0; k < size; k++) {
            const double by_difference = (ahead[k] - behind[k]) / 2e-7 / scales[k],
                         linearised = columns[i * size + k] / scales[k];
            worst = fmax(worst, fabs(by_difference - linearised));
            most = fmax(most, fabs(linearised));
        }
    }
    return worst / most;
}

TEST(the_linearised_motion_agrees_with_differences_of_the_motion) {
    static const struct {
        const char *model;
        double e, contact_time, amplitude;
        int separation;
        bool is_frame;
    } cases[] = {
        {"spring_damper", 0.61, 0.025, 1, SEPARATION_ZERO_PENETRATION, false},
        {"spring_damper", 0.61, 0.025, 1, SEPARATION_ZERO_FORCE, false},
        {"spring_damper", 0.46, 0.0003, 2, SEPARATION_ZERO_PENETRATION, false},
        {"impulse", 0.61, 0.025, 1, CHOICE_ABSENT, false},
        {"spring_damper", 0.61, 0.025, 2, SEPARATION_ZERO_PENETRATION, true},
        {"spring_damper", 0.61, 0.025, 2, SEPARATION_ZERO_FORCE, true},
        {"impulse", 0.61, 0.025, 2, CHOICE_ABSENT, true},
        {"impulse", 0.2, 0.025, 20, CHOICE_ABSENT, true}, // masses that rest
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Simulation simulation;
        if (cases[i].is_frame)
            frame_scene(&simulation, cases[i].e, cases[i].contact_time, cases[i].amplitude);
        else {
            paper_scene(&simulation, cases[i].e, cases[i].contact_time, 1);
            paper_sine(&simulation, cases[i].amplitude, 3);
        }
        paper_model(&simulation, cases[i].model);
        ((Contact *)(void *)simulation.scene.contact)->separation = cases[i].separation;
        CycleFlow *flow = flow_of(&simulation);
        const double difference = difference_of(flow, 20, 2);
        if (!(difference < 1e-6))
            fail_msg("case %zu: %g", i, difference);
        cycle_flow_free(flow);
    }
}

TEST(cycles_of_a_flow_are_those_of_a_run) {
    Simulation simulation, copy;
    paper_scene(&simulation, 0.61, 0.025, 10);
    paper_sine(&simulation, 1, 4);
    static const char *const names[] = {"displacement", "velocity"};
    paper_channels(&simulation, names, COUNT(names));
    problem_clear(&problem);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(fields_copy(simulation_fields, &simulation, &copy), STATUS_OK);
    CycleFlow *flow = flow_of(&copy);
    Outcome *outcome = NULL;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    CycleMotion motion;
    double x, v;
    assert_int_equal(cycle_flow_run(flow, 20, NULL, 0, &motion), STATUS_OK);
    cycle_flow_top(flow, &x, &v);
    const Columns *series = &outcome->response.series;
    assert_true(fabs(columns_find(series, "displacement")->values[5000] - x) < 1e-12);
    assert_true(fabs(columns_find(series, "velocity")->values[5000] - v) < 1e-11);
    // Over the whole run, with a peak of its own: the start.
    assert_int_equal(cycle_flow_run(flow, 20, NULL, 0, &motion), STATUS_OK);
    double peak = 0, sum = 0;
    for (size_t i = 5000; i < 10000; i++) {
        const double value = columns_find(series, "displacement")->values[i];
        peak = fmax(peak, fabs(value));
        sum += value * value / 5000;
    }
    assert_true(motion.peak_displacement >= peak && motion.peak_displacement < peak * 1.0002);
    assert_true(fabs(motion.rms_displacement / sqrt(sum) - 1) < 1e-3);
    outcome_unref(outcome);
    simulation_clear(&simulation);
    cycle_flow_free(flow);
}

TEST(the_peak_without_dampers_is_that_of_the_steady_state) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 1);
    paper_sine(&simulation, 1, 4);
    CycleFlow *flow = flow_of(&simulation);
    const double W = 4 * TURN;
    const double wanted = 1.35 / hypot(865 - 1.35 * W * W, 1.092 * W);
    assert_true(fabs(cycle_flow_undamped_peak(flow) / wanted - 1) < 1e-12);
    cycle_flow_free(flow);
}

TEST(only_a_sine_has_cycles) {
    Simulation simulation;
    CycleFlow *flow = NULL;
    paper_scene(&simulation, 0.61, 0.025, 1);
    problem_clear(&problem);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_cycle_flow(&simulation, NULL, NULL, NULL, &flow, &problem),
                     STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/kind");
    assert_null(flow);
    simulation_clear(&simulation);
}
