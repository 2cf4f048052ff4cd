#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/document.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem told;

#define SDOF "\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}"
#define DAMPER                                                                                     \
    "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": {\"restitution\": 0.5, "   \
    "\"contact_time\": 0.002}}]"
#define RANDOM "\"excitation\": {\"kind\": \"random\", \"band\": [0, 15], \"rms\": 1}"
#define NO_PSD "\"output\": {\"psd\": null}"

#define PULSE "\"excitation\": {\"kind\": \"triangular\", \"amplitude\": 5, \"length\": 25}"

static Cost cost_of(const char *members, double duration, double sample_rate) {
    Simulation simulation;
    document_pass(&simulation, members);
    simulation.scene.duration = duration;
    simulation.scene.sample_rate = sample_rate;
    const Cost cost = simulation_cost(&simulation);
    simulation_clear(&simulation);
    return cost;
}

#define HELD                                                                                       \
    "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0, \"buffer\": {\"restitution\": 0.5, "       \
    "\"contact_time\": 0.0005}}]"

TEST(work_counted_is_about_what_was_predicted) {
    static const char *const scenes[] = {
        SDOF "," HELD "," RANDOM "," NO_PSD,
        SDOF "," DAMPER "," RANDOM "," NO_PSD,
        SDOF "," DAMPER "," RANDOM "," NO_PSD ", \"accuracy\": {\"solver\": \"rk4\"}",
        SDOF "," DAMPER "," RANDOM "," NO_PSD ", \"accuracy\": {\"solver\": \"precise\"}",
        SDOF "," DAMPER "," RANDOM "," NO_PSD ", \"accuracy\": {\"solver\": \"newmark\"}",
        SDOF "," DAMPER "," RANDOM "," NO_PSD ", \"accuracy\": {\"solver\": \"adaptive\"}",
        SDOF "," DAMPER "," RANDOM "," NO_PSD ", \"contact\": {\"model\": \"hunt_crossley\"}",
        // Pieces under a pulse, in flight and in contact; soft contacts, which last for many
        // samples; a contact that rings, then is pressed.
        SDOF "," DAMPER "," PULSE "," NO_PSD,
        SDOF "," HELD "," PULSE "," NO_PSD,
        SDOF ",\"dampers\": [{\"mass\": 0.1, \"clearance\": 0.0001, \"buffer\": "
             "{\"restitution\": 1, \"contact_time\": 0.2}}]," RANDOM "," NO_PSD
             ", \"contact\": {\"model\": \"hertz\"}",
        SDOF "," HELD "," PULSE "," NO_PSD ", \"contact\": {\"separation\": \"zero_force\"}",
        "\"structure\": {\"kind\": \"frame\", \"masses\": [9, 9, 9], \"stiffnesses\": [9000, "
        "9000, 9000], \"damping_ratio\": 0.02}," DAMPER "," RANDOM "," NO_PSD,
    };
    for (size_t i = 0; i < COUNT(scenes); i++) {
        Simulation simulation;
        Outcome *outcome;
        document_pass(&simulation, scenes[i]);
        simulation.scene.duration = 30;
        simulation.scene.sample_rate = 1000;
        problem_clear(&told);
        assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &told), STATUS_OK);
        const Cost cost = simulation_cost(&simulation);
        const double solving = cost.steps - cost.base - cost.output;
        if (!(outcome->steps > solving / 3 && outcome->steps < 3 * solving))
            fail_msg("%zu: %g steps, predicted %g", i, outcome->steps, solving);
        assert_true(cost.cpu_seconds == cost.steps * SOLVER_STEP);
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

#define MASS                                                                                       \
    "{\"mass\": 0.1, \"clearance\": 0, \"buffer\": {\"restitution\": 0.5, \"contact_time\": "      \
    "0.01}}"
#define EIGHT                                                                                      \
    "\"dampers\": [" MASS "," MASS "," MASS "," MASS "," MASS "," MASS "," MASS "," MASS "]"

// Newmark's step solves equations of the contact forces, a table of the precise solver belongs to
// one set of contacts.
TEST(masses_in_contact_cost_what_the_solver_does_about_them) {
    static const char scene[] = SDOF "," EIGHT "," PULSE "," NO_PSD ", \"accuracy\": {\"solver\": ";
    char text[sizeof scene + 100];
    double steps[3];
    for (size_t i = 0; i < 3; i++) {
        snprintf(text, sizeof text, "%s\"%s\", \"step\": 0.001}", scene,
                 (const char *const[]){"rk4", "newmark", "precise"}[i]);
        steps[i] = cost_of(text, 30, 1000).steps;
    }
    assert_true(steps[1] > 2 * steps[0] && steps[1] < 10 * steps[0]);
    assert_true(steps[2] > 1.2 * steps[0] && steps[2] < 10 * steps[0]);
}

TEST(memory_predicted_holds_series_hidden_columns_and_base) {
    const double samples = 1e6 * sizeof(double);
    const double five = cost_of(SDOF "," DAMPER "," NO_PSD, 1000, 1000).bytes;
    const double base = cost_of(SDOF "," DAMPER "," RANDOM "," NO_PSD, 1000, 1000).bytes;
    const double hidden = cost_of(SDOF "," DAMPER "," RANDOM, 1000, 1000).bytes;
    assert_true(five > 5 * samples && five < 5.5 * samples);
    assert_true(fabs(base - five - 0.1 * samples) < 0.05 * samples ||
                base - five > 0.9 * samples); // its rate is the document's or the run's
    assert_true(fabs(hidden - base - samples) < 0.1 * samples);
}

// A random base is made of at least two blocks, which are the longer the narrower the band is.
TEST(a_narrow_band_takes_time_and_memory_however_short_the_run_is) {
    static const char narrow[] = SDOF ", \"excitation\": {\"kind\": \"random\", \"band\": [200, "
                                      "200.1], \"rate\": 1000, \"rms\": 1}," NO_PSD;
    static const char wide[] = SDOF ", \"excitation\": {\"kind\": \"random\", \"band\": [20, 200], "
                                    "\"rate\": 1000, \"rms\": 1}," NO_PSD;
    const Cost cost = cost_of(narrow, 0.1, 1000), less = cost_of(wide, 0.1, 1000);
    // Measured: 0.09 s, and three arrays of 2^22 numbers with a quarter turn of sines.
    assert_true(cost.cpu_seconds > 0.045 && cost.cpu_seconds < 0.18);
    assert_true(cost.bytes > 115e6 && cost.bytes < 150e6);
    assert_true(less.cpu_seconds < 1e-3 && less.bytes < 1e6);
}

// Fewer modes are not given away: their effect is predicted by a run of all, in every run.
TEST(the_prediction_of_what_modes_change_counts) {
    static const char frame[] =
        "\"structure\": {\"kind\": \"frame\", \"masses\": [9, 9, 9], "
        "\"stiffnesses\": [9000, 9000, 9000], \"damping_ratio\": 0.02}," NO_PSD;
    static const char fewer[] =
        "\"structure\": {\"kind\": \"frame\", \"masses\": [9, 9, 9], "
        "\"stiffnesses\": [9000, 9000, 9000], \"damping_ratio\": 0.02}," NO_PSD
        ", \"accuracy\": {\"solver\": \"exact\", \"modes\": 1}";
    static const char target[] =
        "\"structure\": {\"kind\": \"frame\", \"masses\": [9, 9, 9], "
        "\"stiffnesses\": [9000, 9000, 9000], \"damping_ratio\": 0.02}," NO_PSD
        ", \"accuracy\": {\"solver\": \"auto\", \"target\": 1e-9}";
    const double steps = truncation_cost(1000, 1000, 0, 63, 3);
    assert_true(steps > 1e5);
    assert_true(cost_of(fewer, 1000, 1000).steps > 0.9 * steps);
    assert_true(cost_of(target, 1000, 1000).steps > cost_of(frame, 1000, 1000).steps + 0.9 * steps);
}

// A record is still after its last sample, however short its interval.
TEST(a_short_record_makes_no_long_run) {
    const Cost cost =
        cost_of(SDOF ", \"excitation\": {\"kind\": \"record\", \"samples\": [0, 1, -1, "
                     "0], \"interval\": 1e-8}," NO_PSD,
                2, 200);
    assert_true(cost.steps < 1e5);
}

static void refuse(const char *members, const SimulationLimits *limits, double duration,
                   double sample_rate, const char *pointer, const char *says) {
    Simulation simulation;
    document_pass(&simulation, members);
    simulation.scene.duration = duration;
    simulation.scene.sample_rate = sample_rate;
    problem_clear(&told);
    assert_int_equal(simulation_complete(&simulation, limits, NULL, &told), STATUS_INVALID);
    if (strstr(detail_at(&told, pointer), says) == NULL)
        fail_msg("%s: %s", told.faults[0].pointer, told.faults[0].detail);
    simulation_clear(&simulation);
}

TEST(what_takes_too_long_is_refused_where_it_helps_most) {
    const SimulationLimits second = {.steps = 1 / SOLVER_STEP};
    refuse(SDOF "," DAMPER "," NO_PSD ", \"accuracy\": {\"solver\": \"rk4\", \"step\": 1e-6}",
           &second, 100, 100, "/accuracy", " by rk4, at most 1 s are allowed: take longer steps");
    refuse(SDOF "," DAMPER "," NO_PSD, &second, 1e5, 1e4, "/duration",
           "at most 1 s are allowed: take a shorter one");
    refuse("\"structure\": {\"mass\": 1, \"stiffness\": 1e18}," DAMPER "," NO_PSD, &second, 100,
           100, "/duration", "moves many times within a sample interval");
    refuse(SDOF ", \"output\": {\"channels\": [], \"psd\": {\"segment\": 64, \"overlap\": 63}}",
           &second, 2000, 1000, "/output/psd", "most of it for spectra");
    refuse(SDOF ",\"excitation\": {\"kind\": \"chirp\", \"amplitude\": 1, \"start_frequency\": 1, "
                "\"end_frequency\": 2, \"sweep_time\": 1e4, \"rate\": 3000},"
                "\"output\": {\"channels\": [], \"psd\": null}",
           &second, 1e4, 3000, "/excitation", "to make the base's motion");
}

TEST(what_takes_too_much_memory_is_refused) {
    const SimulationLimits limits = {.bytes = 1e6};
    refuse(SDOF "," DAMPER "," NO_PSD, &limits, 100, 1000, "/output/channels",
           "would take about 4.1 MB of memory, at most 1 MB are allowed");
}

#define SPECTRUM                                                                                   \
    SDOF ", \"output\": {\"channels\": [], \"psd\": {\"channels\": [\"displacement\"]}}"
#define ALL_SPECTRA                                                                                \
    SDOF "," DAMPER ", \"output\": {\"channels\": [], \"psd\": {\"channels\": [\"displacement\", " \
         "\"velocity\", \"acceleration\", \"mean_acceleration\", \"damper_displacement\", "        \
         "\"damper_velocity\", \"penetration\", \"contact_force\", \"base_acceleration\"]}}"

// Of 33,554,001 samples.
static Status complete_spectra(const char *members, uint64_t segment, uint64_t overlap,
                               const SimulationLimits *limits, Cost *cost) {
    Simulation simulation;
    document_pass(&simulation, members);
    simulation.scene.duration = 33554;
    simulation.scene.sample_rate = 1000;
    simulation.output.psd.segment = segment;
    simulation.output.psd.overlap = overlap;
    problem_clear(&told);
    const Status status = simulation_complete(&simulation, limits, NULL, &told);
    *cost = simulation_cost(&simulation);
    simulation_clear(&simulation);
    return status;
}

static void refuse_spectra(const char *members, uint64_t segment, uint64_t overlap,
                           const SimulationLimits *limits, const char *says) {
    Cost cost;
    assert_int_equal(complete_spectra(members, segment, overlap, limits, &cost), STATUS_INVALID);
    if (strstr(detail_at(&told, "/output/psd"), says) == NULL)
        fail_msg("%s: %s", told.faults[0].pointer, told.faults[0].detail);
}

// 8388593 and 16777213 are primes.
TEST(spectra_are_priced_by_the_length_of_segments_and_its_prime_factors) {
    Cost cached, smooth, prime;
    const SimulationLimits minute = {.steps = 60 / SOLVER_STEP};
    assert_int_equal(complete_spectra(SPECTRUM, 4096, 2048, &minute, &cached), STATUS_OK);
    assert_int_equal(complete_spectra(SPECTRUM, 1 << 24, 1 << 23, &minute, &smooth), STATUS_OK);
    assert_int_equal(complete_spectra(SPECTRUM, 16777213, 8388606, &minute, &prime), STATUS_OK);
    assert_true(smooth.spectra > 1.2 * cached.spectra && smooth.spectra < 4 * cached.spectra);
    assert_true(prime.spectra > 10 * smooth.spectra);
    refuse_spectra(ALL_SPECTRA, 8388593, 7549733, &minute, "a segment without large prime factors");
}

TEST(spectra_that_cannot_be_kept_are_refused) {
    const SimulationLimits document = {.document_bytes = 9e8}, memory = {.bytes = 1e9};
    refuse_spectra(ALL_SPECTRA, 1 << 25, 0, &document,
                   "about 1.34e+03 MB, at most 900 MB can be stored");
    refuse_spectra(SPECTRUM, 1 << 25, 0, &memory,
                   "MB of memory, at most 1000 MB are allowed: ask for shorter segments");
}

TEST(spectra_count_against_the_steps_of_a_run) {
    const SimulationLimits limits = {.steps = 5e4};
    for (uint64_t overlap = 0; overlap < 64; overlap += 63) {
        Simulation simulation;
        Outcome *outcome = NULL;
        document_pass(&simulation, SPECTRUM);
        simulation.scene.duration = 100;
        simulation.output.psd.segment = 64;
        simulation.output.psd.overlap = overlap;
        problem_clear(&told);
        assert_int_equal(simulation_run(&simulation, &limits, NULL, NULL, &outcome, &told),
                         overlap == 0 ? STATUS_OK : STATUS_LIMIT);
        if (overlap > 0)
            assert_non_null(strstr(told.detail, "stopped at the spectra"));
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

// Two masses between stops without clearance, T_c a hundred-thousandth of a sample interval.
TEST(a_run_predicted_too_little_stops_at_a_count_of_its_own) {
    static const char members[] =
        "\"structure\": {\"mass\": 25695.8, \"stiffness\": 3134636.4, \"damping\": 9081.86},"
        "\"dampers\": [{\"mass\": 0.0319433, \"clearance\": 0, \"buffer\": {\"restitution\": "
        "0.214, "
        "\"contact_time\": 5e-08}}, {\"mass\": 17.8, \"clearance\": 0, \"buffer\": "
        "{\"restitution\": "
        "0.214, \"contact_time\": 5e-08}}], \"contact\": {\"model\": \"spring_damper\", "
        "\"separation\": \"zero_force\"}, \"excitation\": {\"kind\": \"sine\", \"amplitude\": "
        "1000, "
        "\"frequency\": 0.6}, " NO_PSD;
    const SimulationLimits limits = {.steps = 1e5};
    char first[sizeof told.detail] = "";
    for (int i = 0; i < 2; i++) {
        Simulation simulation;
        Outcome *outcome;
        document_pass(&simulation, members);
        problem_clear(&told);
        assert_int_equal(simulation_run(&simulation, &limits, NULL, NULL, &outcome, &told),
                         STATUS_LIMIT);
        assert_non_null(strstr(told.detail, "more than 3e+05 solver steps, about 0.009 s of CPU"));
        if (i > 0)
            assert_string_equal(told.detail, first);
        snprintf(first, sizeof first, "%s", told.detail);
        simulation_clear(&simulation);
    }
}

TEST(many_dampers_on_many_storeys_are_predicted_to_take_long) {
    enum { SIZE = 1 << 15 };
    char *text = malloc(SIZE);
    assert_non_null(text);
    size_t used =
        (size_t)snprintf(text, SIZE, "\"structure\": {\"kind\": \"frame\", \"masses\": [");
    for (int i = 0; i < 200; i++)
        used += (size_t)snprintf(text + used, SIZE - used, "%s1000", i > 0 ? ", " : "");
    used += (size_t)snprintf(text + used, SIZE - used, "], \"stiffnesses\": [");
    for (int i = 0; i < 200; i++)
        used += (size_t)snprintf(text + used, SIZE - used, "%s1e8", i > 0 ? ", " : "");
    used +=
        (size_t)snprintf(text + used, SIZE - used, "], \"damping_ratio\": 0.02}, \"dampers\": [");
    for (int i = 0; i < 64; i++)
        used +=
            (size_t)snprintf(text + used, SIZE - used,
                             "%s{\"mass\": 10, \"clearance\": 0.001, \"storey\": %d, \"buffer\": "
                             "{\"restitution\": 0.5, \"contact_time\": 0.001}}",
                             i > 0 ? ", " : "", 3 * i + 1);
    (void)snprintf(text + used, SIZE - used,
                   "], " RANDOM
                   ", \"output\": {\"channels\": [\"displacement_200\"], \"psd\": null}");
    assert_true(cost_of(text, 30, 1000).cpu_seconds > 10);
    free(text);
}

// A contact is followed with all other masses, each of which adds a little.
TEST(a_contact_among_many_masses_is_predicted_by_their_number) {
    const double one = step_work_steps(STEP_WORK_POWER, 20, 1, false);
    assert_true(step_work_steps(STEP_WORK_POWER, 20, 16, false) < 4 * one);
    assert_true(step_work_steps(STEP_WORK_POWER, 20, 64, false) < 8 * one);
}

// As measured: 200 steps a sample of 100 storeys, 4000 of 200.
TEST(coupled_flight_is_predicted_by_the_pairs_of_modes) {
    assert_in_range(step_work_steps(STEP_WORK_FLIGHT, 100, 0, true), 200, 600);
    assert_in_range(step_work_steps(STEP_WORK_FLIGHT, 200, 0, true), 2000, 6000);
}
