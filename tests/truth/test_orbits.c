// Periodic orbits of drawn scenes, found by settling and by shooting from amid a transient: those
// that are called stable attract, those called unstable repel, and the matrix of the return map
// agrees with its differences. Arguments: the number of orbits,
// and of the seed.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/solve/cycle_flow.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

enum { STATE = 16, CYCLES = 20000 };
static const double NEAR_ONE = 1e-3; // of the largest multiplier: not decided by so many cycles

static Problem problem;
static uint64_t source;

// Steele, Lea and Flood 2014 (SplitMix64).
static double draw(double from, double to) {
    uint64_t bits = source += 0x9e3779b97f4a7c15U;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
    return from + (to - from) * (double)((bits ^ (bits >> 31)) >> 11) * 0x1p-53;
}

static void draw_frame(Simulation *simulation) {
    Scene *scene = &simulation->scene;
    scene_choose(&scene->structure, &structure_kinds, "frame");
    ShearFrame *frame = (ShearFrame *)(void *)scene->structure;
    assert_true(reals_allocate(&frame->masses, 2) && reals_allocate(&frame->stiffnesses, 2));
    for (size_t i = 0; i < 2; i++) {
        frame->masses.at[i] = 1.35;
        frame->stiffnesses.at[i] = draw(1500, 2500);
    }
    frame->structure.damping_ratio = draw(0.01, 0.05);
    scene->dampers.at = realloc(scene->dampers.at, 2 * sizeof *scene->dampers.at);
    assert_non_null(scene->dampers.at);
    assert_int_equal(fields_copy(damper_fields, &scene->dampers.at[0], &scene->dampers.at[1]),
                     STATUS_OK);
    scene->dampers.count = 2;
    scene->dampers.at[1].storey = 1;
}

static CycleFlow *draw_flow(void) {
    static const char *const models[] = {"impulse", "spring_damper", "spring_damper",
                                         "hunt_crossley"};
    Simulation simulation;
    CycleFlow *flow = NULL;
    const char *model = models[(size_t)draw(0, 3.2)];
    const double contact_time = pow(10, draw(-3.5, -1.6));
    paper_scene(&simulation, draw(0.3, 0.9), contact_time, 1);
    Damper *damper = &simulation.scene.dampers.at[0];
    damper->mass = draw(0.03, 0.4);
    damper->clearance = draw(0.004, 0.03);
    damper->offset = draw(0, 1) < 0.3 ? draw(-1e-3, 1e-3) : 0;
    paper_sine(&simulation, draw(0.3, 3), draw(2, 7));
    paper_model(&simulation, model);
    if (strcmp(model, "spring_damper") == 0)
        ((Contact *)(void *)simulation.scene.contact)->separation = draw(0, 1) < 0.3;
    if (draw(0, 1) < 0.25)
        draw_frame(&simulation);
    problem_clear(&problem);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_cycle_flow(&simulation, NULL, NULL, NULL, &flow, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].pointer : "");
    simulation_clear(&simulation);
    return flow;
}

static double distance_of(const Orbit *orbit, const double *y) {
    double most = 0;
    for (size_t i = 0; i < orbit->size; i++)
        most = fmax(most, fabs(y[i] - orbit->y[i]) / orbit->scales[i]);
    return most;
}

// Central differences of the map over the orbit, on which the flow is. It keeps its contacts.
static void slopes_make(const Orbit *orbit, CycleFlow *flow, size_t period, double step,
                        double *slopes) {
    double ends[2][STATE], moved[STATE];
    for (size_t i = 0; i < orbit->size; i++) {
        for (int side = 0; side < 2; side++) {
            memcpy(moved, orbit->y, orbit->size * sizeof *moved);
            moved[i] += (side == 0 ? step : -step) * orbit->scales[i];
            cycle_flow_restore(flow, moved);
            assert_int_equal(cycle_flow_run(flow, period, NULL, 0, NULL), STATUS_OK);
            cycle_flow_get(flow, ends[side]);
        }
        for (size_t k = 0; k < orbit->size; k++)
            slopes[k * orbit->size + i] = (ends[0][k] - ends[1][k]) / (2 * step * orbit->scales[k]);
    }
}

static double matrix_difference(const Orbit *orbit, const double *a, const double *b) {
    double worst = 0, most = 1;
    for (size_t i = 0; i < orbit->size * orbit->size; i++) {
        worst = fmax(worst, fabs(a[i] - b[i]));
        most = fmax(most, fabs(orbit->matrix[i]));
    }
    return worst / most;
}

// The difference of the matrix to central differences, relative to its largest value; NAN where
// these themselves do not settle, as where an orbit only just touches a stop.
static double difference_of(const Orbit *orbit, CycleFlow *flow, size_t period) {
    double slopes[2][STATE * STATE], least = (double)NAN;
    slopes_make(orbit, flow, period, 1e-6, slopes[0]);
    for (int i = 1; i < 4; i++) {
        slopes_make(orbit, flow, period, 1e-6 * pow(10, -i), slopes[i % 2]);
        if (matrix_difference(orbit, slopes[0], slopes[1]) < 5e-6)
            least = fmin(least, matrix_difference(orbit, slopes[i % 2], orbit->matrix));
    }
    return least;
}

// Starts beside the orbit. Whether the distance falls to a tenth of the first and stays there
// (stable), or grows to ten times of it.
static bool orbit_behaves(const Orbit *orbit, CycleFlow *flow, size_t period, bool is_stable) {
    const double start = 1e-6;
    double y[STATE];
    for (size_t i = 0; i < orbit->size; i++)
        y[i] = orbit->y[i] + draw(-1, 1) * start * orbit->scales[i];
    cycle_flow_restore(flow, y);
    size_t quiet = 0;
    for (size_t i = 0; i < CYCLES; i += period) {
        assert_int_equal(cycle_flow_run(flow, period, NULL, 0, NULL), STATUS_OK);
        cycle_flow_get(flow, y);
        const double distance = distance_of(orbit, y);
        if (!is_stable && distance > 10 * start)
            return true;
        quiet = distance < start / 10 ? quiet + 1 : 0;
        if (is_stable && quiet == 10)
            return true;
    }
    return false;
}

int main(int argc, char **argv) {
    const size_t orbits = argc > 1 ? strtoul(argv[1], NULL, 10) : 12;
    size_t counts[2] = {0, 0}, wrong[2] = {0, 0}, near_one = 0, not_smooth = 0, scenes = 0;
    double worst = 0;
    source = argc > 2 ? strtoul(argv[2], NULL, 10) : 7;
    while (counts[0] + counts[1] < orbits) {
        CycleFlow *flow = draw_flow();
        const Orbit *orbit = cycle_flow_orbit(flow);
        scenes++;
        assert_true(orbit->size <= STATE);
        if (scenes % 2 == 0) {
            assert_int_equal(cycle_flow_settle(flow, 200, 8), STATUS_OK);
        } else {
            const size_t period = 1 + (size_t)draw(0, 2.5);
            assert_int_equal(cycle_flow_run(flow, 100 + (size_t)draw(0, 20), NULL, 0, NULL),
                             STATUS_OK);
            assert_int_equal(cycle_flow_shift(flow, false), STATUS_OK);
            if (cycle_flow_is_flying(flow))
                assert_int_equal(cycle_flow_shoot(flow, period), STATUS_OK);
        }
        const size_t period = orbit->period;
        const bool is_found = period > 0;
        const double radius = is_found ? cycle_flow_radius(flow) : 1;
        if (is_found && fabs(radius - 1) < NEAR_ONE) {
            near_one++;
        } else if (is_found) {
            const bool is_stable = radius < 1;
            counts[is_stable]++;
            if (!orbit_behaves(orbit, flow, period, is_stable)) {
                printf("scene %zu: radius %.6g, period %zu: wrong\n", scenes, radius, period);
                wrong[is_stable]++;
            }
            if (cycle_flow_is_linearised(flow)) {
                const double difference = difference_of(orbit, flow, period);
                not_smooth += isnan(difference) ? 1 : 0;
                if (difference > 1e-5)
                    printf("scene %zu: radius %.6g, period %zu: difference %.3g\n", scenes, radius,
                           period, difference);
                worst = fmax(worst, difference);
            }
        }
        cycle_flow_free(flow);
    }
    printf("%zu stable orbits (%zu do not attract), %zu unstable (%zu do not repel), %zu with a "
           "multiplier near 1, of %zu scenes; largest difference of a matrix %.2g, %zu without "
           "derivatives\n",
           counts[1], wrong[1], counts[0], wrong[0], near_one, scenes, worst, not_smooth);
    return wrong[0] + wrong[1] > 0 || !(worst < 1e-5) || 20 * not_smooth > orbits;
}
