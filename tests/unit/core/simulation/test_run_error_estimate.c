// Scenes whose steps once stated less than they missed: where both runs of a pair miss the same,
// their difference tells nothing.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "server/json/parse.h"
#include "tests/support/test.h"

static Problem told;

// The document's own solver, or the exact one.
static Outcome *run(const char *text, bool is_exact, const SimulationLimits *limits) {
    Simulation simulation;
    Outcome *outcome = NULL;
    problem_clear(&told);
    assert_int_equal(json_parse(text, strlen(text), simulation_fields, &simulation, &told),
                     STATUS_OK);
    if (is_exact) {
        variant_free(simulation.accuracy);
        simulation.accuracy = variant_new(&solver_exact.kind);
        assert_non_null(simulation.accuracy);
    }
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &told), STATUS_OK);
    if (simulation_run(&simulation, limits, NULL, NULL, &outcome, &told) != STATUS_OK)
        fail_msg("%s", told.detail);
    simulation_clear(&simulation);
    return outcome;
}

// Up to its horizon a run is off by no more than ten times what it states.
static void assert_states_its_error(const char *text) {
    Outcome *stepped = run(text, false, NULL), *exact = run(text, true, NULL);
    const double *a = stepped->response.series.at[0].values;
    const double *b = exact->response.series.at[0].values;
    const Summary *summary = &stepped->summary;
    const double until = isnan(summary->trust_horizon) ? INFINITY : 0.7 * summary->trust_horizon;
    const double error = isnan(summary->trust_horizon)
                             ? summary->error_estimate
                             : fmin(summary->error_estimate, RESPONSE_DIVERGENCE);
    double largest = 0, apart = 0;
    for (size_t i = 0; i < exact->response.count; i++) {
        largest = fmax(largest, fabs(b[i]));
        if ((double)i / exact->response.sample_rate < until)
            apart = fmax(apart, fabs(a[i] - b[i]));
    }
    assert_true(largest > 0);
    if (!(apart <= fmax(10 * error, 1e-9) * largest))
        fail_msg("off by %g, states %g to %g s", apart / largest, error, until);
    outcome_unref(stepped);
    outcome_unref(exact);
}

#define FAST "{\"structure\": {\"mass\": 1, \"stiffness\": 3947841760, \"damping\": 0},"
#define HEAVY(buffer)                                                                              \
    "\"dampers\": [{\"mass\": 1000, \"clearance\": 1e-6, \"buffer\": " buffer "}],"
#define SWEEP                                                                                      \
    "\"excitation\": {\"kind\": \"chirp\", \"amplitude\": 1000, \"start_frequency\": 1000, "       \
    "\"end_frequency\": 30000}, \"duration\": 0.0025, \"sample_rate\": 200000,"
#define END "\"output\": {\"channels\": [\"displacement\"], \"psd\": null}}"

TEST(steps_as_long_as_the_bases_lines_have_a_shorter_neighbour) {
    assert_states_its_error(FAST SWEEP "\"accuracy\": {\"solver\": \"rk4\"}," END);
    assert_states_its_error(FAST SWEEP "\"accuracy\": {\"solver\": \"newmark\"}," END);
}

TEST(a_pulse_between_two_instants_is_not_missed) {
    static const char *const kinds[] = {"half_sine", "triangular"};
    static const char *const steppers[] = {"precise", "rk4", "newmark"};
    char text[1024];
    for (size_t i = 0; i < COUNT(kinds) * COUNT(steppers); i++) {
        (void)snprintf(text, sizeof text,
                       FAST "\"excitation\": {\"kind\": \"%s\", \"amplitude\": 1000, \"start\": "
                            "1.1e-5, \"length\": 4e-7}, \"duration\": 0.0025, \"sample_rate\": "
                            "200000, \"accuracy\": {\"solver\": \"%s\"}," END,
                       kinds[i % COUNT(kinds)], steppers[i / COUNT(kinds)]);
        assert_states_its_error(text);
    }
}

TEST(a_contact_that_both_runs_see_late_is_told) {
    assert_states_its_error(
        FAST HEAVY("{\"restitution\": 0.001, \"contact_time\": 1}") SWEEP
        "\"contact\": {\"model\": \"flores\"}, \"accuracy\": {\"solver\": \"rk4\"}," END);
}

// The horizon is that of the first late bounce, not of the first that the two runs disagree on.
TEST(a_late_bounce_ends_trust) {
    static const char text[] =
        "{\"structure\": {\"mass\": 10, \"stiffness\": 1}, \"dampers\": [{\"mass\": 5, "
        "\"clearance\": "
        "4e-5, \"velocity\": -1.3e-5, \"buffer\": {\"restitution\": 0.1}}], \"contact\": "
        "{\"model\": "
        "\"impulse\"}, \"excitation\": {\"kind\": \"free\", \"displacement\": 0.0014}, "
        "\"accuracy\": "
        "{\"solver\": \"precise\"}, \"duration\": 20, \"sample_rate\": 5," END;
    assert_states_its_error(text);
}

TEST(a_base_that_ends_at_once_is_no_error_of_adaptive_steps) {
    static const char text[] =
        "{\"structure\": {\"mass\": 329, \"stiffness\": 0.0437, \"damping\": 0.4}, \"excitation\": "
        "{\"kind\": \"record\", \"interval\": 0.00044856, \"samples\": [328, 351, 400, 380, 351, "
        "330]}, "
        "\"accuracy\": {\"solver\": \"adaptive\", \"tolerance\": 6e-4}, \"duration\": 0.061, "
        "\"sample_rate\": 819," END;
    assert_states_its_error(text);
    Outcome *outcome = run(text, false, NULL);
    assert_true(outcome->summary.error_estimate < 1e-9);
    outcome_unref(outcome);
}

// At 0.7 of what rk4 bears, its neighbour may not take longer steps.
TEST(a_neighbour_that_would_be_unstable_takes_shorter_steps) {
    static const char text[] =
        "{\"structure\": {\"mass\": 1, \"stiffness\": 4e6, \"damping\": 1}, \"excitation\": "
        "{\"kind\": "
        "\"free\", \"displacement\": 0.01}, \"accuracy\": {\"solver\": \"rk4\", \"step\": 0.001}, "
        "\"duration\": 0.1, \"sample_rate\": 1000," END;
    Outcome *outcome = run(text, false, NULL);
    assert_true(outcome->summary.error_estimate > 0.1);
    outcome_unref(outcome);
    assert_states_its_error(text);
}

// A mass that crosses its clearance many times within a step: with what speed is chance.
TEST(a_speed_that_is_chance_is_told) {
    assert_states_its_error(
        FAST
        "\"dampers\": [{\"mass\": 1e-6, \"clearance\": 1e-6, \"buffer\": {\"restitution\": 0.001, "
        "\"contact_time\": 1}}], \"contact\": {\"model\": \"jankowski\"}, \"excitation\": "
        "{\"kind\": "
        "\"chirp\", \"amplitude\": 1000, \"start_frequency\": 1000, \"end_frequency\": 30000, "
        "\"displacement\": 0.1}, \"duration\": 0.0025, \"sample_rate\": 200000, \"accuracy\": "
        "{\"solver\": \"rk4\"}," END);
}

TEST(a_mass_without_clearance_is_taken_along_from_the_start) {
    assert_states_its_error(
        "{\"structure\": {\"mass\": 1, \"stiffness\": 1e4, \"damping\": 1}, \"dampers\": "
        "[{\"mass\": "
        "0.5, \"clearance\": 0, \"buffer\": {\"restitution\": 0.9, \"contact_time\": 0.001}}], "
        "\"excitation\": {\"kind\": \"triangular\", \"amplitude\": 1, \"length\": 0.002}, "
        "\"accuracy\": "
        "{\"solver\": \"adaptive\"}, \"duration\": 0.1, \"sample_rate\": 1000," END);
}

// Nothing moves until then: what errors are measured by has to grow.
TEST(adaptive_steps_follow_a_base_that_begins_late) {
    static const char *const kinds[] = {
        "{\"kind\": \"half_sine\", \"amplitude\": 1, \"start\": 0.3, \"length\": 0.05}",
        "{\"kind\": \"triangular\", \"amplitude\": 1, \"start\": 0.3, \"length\": 0.05, "
        "\"displacement\": 1e-9}",
        "{\"kind\": \"record\", \"samples\": [0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0], "
        "\"interval\": 0.04}"};
    for (size_t i = 0; i < COUNT(kinds); i++) {
        char text[800];
        snprintf(text, sizeof text,
                 "{\"structure\": {\"mass\": 1, \"stiffness\": 900, \"damping\": 1}, "
                 "\"dampers\": [], \"excitation\": %s, \"duration\": 0.5, \"sample_rate\": 100, "
                 "\"accuracy\": {\"solver\": \"adaptive\"}," END,
                 kinds[i]);
        assert_states_its_error(text);
    }
}

TEST(adaptive_steps_follow_what_a_mass_brings_to_a_structure_at_rest) {
    assert_states_its_error(
        "{\"structure\": {\"mass\": 1, \"stiffness\": 900, \"damping\": 1}, \"dampers\": "
        "[{\"mass\": 0.1, \"clearance\": 0.02, \"velocity\": 0.4, \"buffer\": {\"restitution\": "
        "0.6, \"contact_time\": 0.01}}], \"contact\": {\"model\": \"flores\"}, \"excitation\": "
        "{\"kind\": \"free\"}, \"duration\": 0.5, \"sample_rate\": 1000, "
        "\"accuracy\": {\"solver\": \"adaptive\"}," END);
}
