#include <math.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/solve/cycle_flow.h"
#include "tests/support/flows.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static const double TURN = 6.283185307179586;

// Settles within so many cycles; the period must be as wanted.
static const Orbit *settle(CycleFlow *flow, size_t cycles, size_t wanted) {
    assert_int_equal(cycle_flow_settle(flow, cycles, 8), STATUS_OK);
    assert_int_equal(cycle_flow_orbit(flow)->period, wanted);
    return cycle_flow_orbit(flow);
}

// Masri and Caughey's two symmetric impacts per cycle, M = K = 1.
static CycleFlow *masri_caughey(double clearance) {
    const double C = 0.1;
    Simulation simulation;
    paper_scene(&simulation, 0.6, 0.025, 10);
    paper_model(&simulation, "impulse");
    SdofStructure *structure = (SdofStructure *)(void *)simulation.scene.structure;
    structure->mass = structure->stiffness = 1;
    structure->damping = C;
    simulation.scene.dampers.at[0].mass = 0.1;
    simulation.scene.dampers.at[0].clearance = clearance;
    paper_sine(&simulation, 1 / sqrt(1 + C * C), 1 / TURN);
    ((ExcitationSine *)(void *)simulation.scene.excitation)->quantity = SINE_DISPLACEMENT;
    return flow_of(&simulation);
}

TEST(the_masri_caughey_orbit_is_found_to_rounding) {
    CycleFlow *flow = masri_caughey(20);
    CycleMotion motion;
    const Orbit *orbit = settle(flow, 200, 1);
    // The free mass flies straight, at |w| in absolute coordinates, from one stop to the other in
    // half a cycle: where the structure is then follows.
    const double amplitude = 1 / sqrt(1.01), speed = orbit->y[1] + orbit->y[3] + amplitude;
    assert_true(fabs(fabs(speed) / 6.441388128148 - 1) < 1e-12);
    assert_true(fabs(fabs(speed) * TURN / 4 - 10 - 0.118108811155) < 1e-11);
    assert_true(cycle_flow_radius(flow) < 0.7);
    assert_int_equal(cycle_flow_run(flow, 1, NULL, 0, &motion), STATUS_OK);
    assert_int_equal(motion.impacts, 2);
    cycle_flow_free(flow);
}

// Determinant of the return map: volumes shrink by exp(-C T / M) and, at each of two impacts, by
// e^2, for position and speed both turn back by e.
TEST(the_product_of_the_multipliers_is_that_of_all_contractions) {
    CycleFlow *flow = masri_caughey(20);
    const Orbit *orbit = settle(flow, 200, 1);
    double real = 1, imaginary = 0;
    for (size_t i = 0; i < orbit->size; i++) {
        const double kept = real;
        real = real * orbit->real[i] - imaginary * orbit->imaginary[i];
        imaginary = kept * orbit->imaginary[i] + imaginary * orbit->real[i];
    }
    assert_true(fabs(real / (exp(-0.1 * TURN) * pow(0.6, 4)) - 1) < 1e-10);
    assert_true(fabs(imaginary) < 1e-15);
    cycle_flow_free(flow);
}

TEST(a_power_law_is_followed_by_differences) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.02, 10);
    paper_model(&simulation, "hunt_crossley");
    paper_sine(&simulation, 1, 4.4);
    CycleFlow *flow = flow_of(&simulation);
    assert_false(cycle_flow_is_linearised(flow));
    (void)settle(flow, 200, 1);
    assert_true(cycle_flow_radius(flow) > 0.1 && cycle_flow_radius(flow) < 1);
    cycle_flow_free(flow);
}

TEST(without_a_damper_the_multipliers_are_those_of_the_free_vibration) {
    Simulation simulation;
    scene_without_damper(&simulation);
    paper_sine(&simulation, 1, 3);
    CycleFlow *flow = flow_of(&simulation);
    CycleMotion motion;
    (void)settle(flow, 200, 1);
    assert_true(fabs(cycle_flow_radius(flow) / exp(-1.092 / 1.35 / 2 / 3) - 1) < 1e-12);
    assert_int_equal(cycle_flow_run(flow, 1, NULL, 0, &motion), STATUS_OK);
    assert_true(fabs(motion.peak_displacement / cycle_flow_undamped_peak(flow) - 1) < 1e-10);
    assert_true(fabs(motion.rms_displacement * sqrt(2) / motion.peak_displacement - 1) < 1e-10);
    cycle_flow_free(flow);
}

// A structure that follows its base, and a mass that keeps its distance: it may stand anywhere.
TEST(a_mass_that_touches_no_stop_has_multipliers_of_one) {
    Simulation simulation;
    paper_scene(&simulation, 0.61, 0.025, 10);
    paper_sine(&simulation, 0.01, 3);
    CycleFlow *flow = flow_of(&simulation);
    CycleMotion motion;
    assert_int_equal(cycle_flow_settle(flow, 400, 8), STATUS_OK);
    const size_t period = cycle_flow_orbit(flow)->period;
    if (period > 0) {
        assert_true(fabs(cycle_flow_radius(flow) - 1) < 1e-6);
        assert_int_equal(cycle_flow_run(flow, period, NULL, 0, &motion), STATUS_OK);
        assert_int_equal(motion.impacts, 0);
    }
    cycle_flow_free(flow);
}
