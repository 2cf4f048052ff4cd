// What a scene does not require does not run: counters say so, decisions report it with a number,
// and the answer is that of the run with everything in it.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "server/json/parse.h"
#include "tests/support/test.h"

#define STRUCTURE "\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}"
#define BUFFER "{\"restitution\": 0.61, \"contact_time\": 0.025}"
#define DAMPER(clearance)                                                                          \
    "\"dampers\": [{\"mass\": 0.1107, \"clearance\": " clearance ", \"offset\": 0.1, "             \
    "\"buffer\": " BUFFER "}]"
#define FRAME                                                                                      \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [1, 1, 1], \"stiffnesses\": [1000, 1000, "   \
    "1000], \"damping_ratio\": 0.02}"
#define RELEASE "\"excitation\": {\"kind\": \"free\", \"displacement\": 0.015}"
#define RANDOM "\"excitation\": {\"kind\": \"random\", \"band\": [0, 15], \"rms\": 1}"
#define SINE "\"excitation\": {\"kind\": \"sine\", \"frequency\": 10, \"amplitude\": 1}"
#define SHORT "\"duration\": 1, \"sample_rate\": 100"
#define TIME "\"duration\": 10, \"sample_rate\": 1000"
#define ALL                                                                                        \
    "\"output\": {\"channels\": [\"displacement\", \"velocity\", \"acceleration\", "               \
    "\"damper_displacement\", \"damper_velocity\", \"penetration\", \"contact_force\", "           \
    "\"mean_acceleration\", \"base_acceleration\"]}"
#define SUMMARY "\"output\": {\"channels\": [], \"psd\": null, \"impacts\": false}"

static Simulation simulation_of(const char *members) {
    Simulation simulation;
    Problem problem;
    const size_t size = strlen(members) + 3;
    char *text = malloc(size);
    assert_non_null(text);
    snprintf(text, size, "{%s}", members);
    problem_clear(&problem);
    (void)json_parse(text, strlen(text), simulation_fields, &simulation, &problem);
    if (simulation_complete(&simulation, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s: %s", text, problem.count > 0 ? problem.faults[0].detail : problem.detail);
    free(text);
    return simulation;
}

static Outcome *outcome_of(const char *members) {
    Simulation simulation = simulation_of(members);
    Problem problem;
    Outcome *outcome;
    problem_clear(&problem);
    if (simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s: %s", members, problem.detail);
    simulation_clear(&simulation);
    return outcome;
}

// The omission of that name, NULL if there is none.
static const Decision *left_out(const PlanReport *plan, const char *about) {
    for (size_t i = 0; i < plan->decisions.count; i++)
        if (strcmp(plan->decisions.at[i].about, about) == 0 &&
            strcmp(plan->decisions.at[i].chose, "left_out") == 0)
            return &plan->decisions.at[i];
    return NULL;
}

static void assert_left_out(const Outcome *outcome, const char *about) {
    const Decision *decision = left_out(&outcome->plan, about);
    if (decision == NULL)
        fail_msg("no omission of %s is told", about);
    if (decision->value != decision->value)
        fail_msg("%s: without a number", about);
}

// The same run with all that looks for stops, sample by sample beside the outcome's.
static void assert_as_with_contacts(const char *members, const Outcome *outcome) {
    Simulation simulation = simulation_of(members);
    Problem problem;
    Plan *plan;
    Base base = {0};
    Response response = {0};
    problem_clear(&problem);
    const Scene *scene = &simulation.scene;
    const Excitation *excitation = scene_excitation(scene);
    const Span span = {.duration = scene->duration, .sample_rate = scene->sample_rate};
    assert_int_equal(plan_new(scene, "auto", "exact", &plan, &problem), STATUS_OK);
    assert_int_equal(excitation_make(excitation, &span, NULL, &base, &problem), STATUS_OK);
    const Columns *series = &outcome->response.series;
    RunColumn *columns = calloc(series->count, sizeof *columns);
    double *values = calloc(series->count * series->rows, sizeof *values);
    assert_true(columns != NULL && values != NULL);
    for (size_t i = 0; i < series->count; i++) {
        size_t number;
        const Channel *channel = channel_find(series->at[i].name, &number);
        columns[i] = (RunColumn){(ChannelId)(channel - channels), number > 0 ? number - 1 : 0,
                                 values + i * series->rows};
    }
    Run run = {.plan = plan, .base = &base, .columns = columns, .column_count = series->count};
    if (solver_exact.run(&solver_exact, &run, &response, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    assert_true(run.work.stop_searches > 0);
    for (size_t i = 0; i < series->count; i++) {
        double largest = 0.01, apart = 0; // what should be 0 is a rounding
        for (size_t j = 0; j < series->rows; j++) {
            largest = fmax(largest, fabs(columns[i].values[j]));
            apart = fmax(apart, fabs(columns[i].values[j] - series->at[i].values[j]));
        }
        if (!(apart <= 1e-12 * largest))
            fail_msg("%s: %s is %g apart, of %g", members, series->at[i].name, apart, largest);
    }
    const Peaks *a = &response.peaks, *b = &outcome->response.peaks;
    assert_true(fabs(a->displacement - b->displacement) <= 1e-12 * a->displacement);
    assert_true(fabs(a->damper_displacement - b->damper_displacement) <=
                1e-12 * a->damper_displacement);
    assert_true(fabs(a->acceleration - b->acceleration) <= 1e-12 * a->acceleration);
    free(columns);
    free(values);
    response_clear(&response);
    base_clear(&base);
    plan_free(plan);
    simulation_clear(&simulation);
}

TEST(where_no_stop_is_reached_none_is_looked_for) {
    static const char *const scenes[] = {
        STRUCTURE ", " DAMPER("0.1") ", " RELEASE ", " TIME ", " ALL,
        STRUCTURE ", " DAMPER("100") ", " RANDOM ", " TIME ", " ALL,
        STRUCTURE ", " DAMPER("1.5") ", " SINE ", " TIME ", " ALL,
        // Intervals too long for blocks.
        STRUCTURE ", " DAMPER("0.1") ", " RELEASE ", \"duration\": 30, \"sample_rate\": 20, " ALL,
        STRUCTURE ", " DAMPER("0.1") ", " RELEASE ", \"duration\": 30, \"sample_rate\": 2, " ALL,
        // Another law, or the other separation: without contacts it is all one.
        STRUCTURE ", " DAMPER("0.1") ", \"contact\": {\"model\": \"hunt_crossley\"}, " RELEASE
                                     ", " TIME ", " ALL,
        STRUCTURE ", " DAMPER("0.1") ", \"contact\": {\"separation\": \"zero_force\"}, " RELEASE
                                     ", " TIME ", " ALL,
        STRUCTURE ", " DAMPER("0.1") ", \"contact\": {\"model\": \"impulse\"}, " RELEASE ", " TIME
                                     ", " ALL,
        FRAME ", " DAMPER("0.5") ", \"excitation\": {\"kind\": \"free\", \"displacement\": [0.01, "
                                 "0.02, 0.03]}, " TIME,
        FRAME ", " DAMPER("100") ", " RANDOM ", " TIME,
    };
    for (size_t i = 0; i < COUNT(scenes); i++) {
        Outcome *outcome = outcome_of(scenes[i]);
        assert_left_out(outcome, "contacts");
        assert_true(left_out(&outcome->plan, "contacts")->value < 1);
        const WorkCounters *work = &outcome->work;
        assert_int_equal(work->stop_searches, 0);
        assert_int_equal(work->contacts + work->bounces + work->rests, 0);
        assert_int_equal(work->neighbour_samples, 0);
        assert_true(outcome->summary.error_estimate < 1e-9);
        assert_as_with_contacts(scenes[i], outcome);
        outcome_unref(outcome);
    }
}

// Neither steps nor roots; and a contact too stiff for the step is none's concern.
TEST(solvers_that_step_look_for_no_stops_either) {
    static const char *const settings[] = {
        "\"solver\": \"precise\", \"step\": 1e-3", "\"solver\": \"rk4\", \"step\": 1e-3",
        "\"solver\": \"newmark\", \"step\": 1e-3", "\"solver\": \"adaptive\", \"tolerance\": 1e-9",
        "\"solver\": \"exact\""};
    double peaks[COUNT(settings)];
    for (size_t i = 0; i < COUNT(settings); i++)
        for (int is_far = 0; is_far < 2; is_far++) {
            char members[800];
            snprintf(members, sizeof members,
                     STRUCTURE ", \"dampers\": [{\"mass\": 0.1107, \"clearance\": %s, "
                               "\"buffer\": " BUFFER "}], " RELEASE ", " TIME
                               ", \"accuracy\": {%s}",
                     is_far ? "0.1" : "0.015", settings[i]);
            Outcome *outcome = outcome_of(members);
            const WorkCounters *work = &outcome->work;
            assert_int_equal(work->stop_searches == 0, is_far);
            assert_int_equal(left_out(&outcome->plan, "contacts") != NULL, is_far);
            assert_int_equal(work->contacts > 0, !is_far);
            assert_true(i + 1 == COUNT(settings) || work->steps > 100);
            peaks[i] = outcome->summary.rms_displacement;
            outcome_unref(outcome);
        }
    for (size_t i = 0; i + 1 < COUNT(settings); i++)
        assert_true(fabs(peaks[i] - peaks[COUNT(settings) - 1]) < 1e-3 * peaks[i]);
    Outcome *stiff = outcome_of(STRUCTURE ", \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.1, "
                                          "\"buffer\": {\"restitution\": 0.46, \"contact_time\": "
                                          "1e-5}}], " RELEASE ", " TIME
                                          ", \"accuracy\": {\"solver\": \"rk4\", \"step\": 1e-3}");
    assert_true(stiff->summary.impacts == 0);
    outcome_unref(stiff);
}

TEST(where_one_may_be_reached_all_of_it_runs) {
    static const char *const scenes[] = {
        STRUCTURE ", " DAMPER("0.015") ", " RELEASE ", " TIME,
        STRUCTURE ", " DAMPER("0.015") ", " RANDOM ", " TIME,
        FRAME ", " DAMPER("0.02") ", \"excitation\": {\"kind\": \"free\", \"displacement\": [0.01, "
                                  "0.02, 0.03]}, " TIME,
    };
    for (size_t i = 0; i < COUNT(scenes); i++) {
        Outcome *outcome = outcome_of(scenes[i]);
        assert_null(left_out(&outcome->plan, "contacts"));
        assert_true(outcome->work.stop_searches > 0);
        assert_int_equal(outcome->work.contacts, outcome->summary.impacts);
        assert_int_equal(outcome->work.ledger_rows, outcome->response.impacts.count);
        assert_true(outcome->summary.impacts > 0);
        outcome_unref(outcome);
    }
    Outcome *frame = outcome_of(scenes[2]);
    assert_true(frame->work.neighbour_samples > 0);
    outcome_unref(frame);
}

TEST(bounces_and_rests_are_counted_apart) {
    Outcome *outcome =
        outcome_of(STRUCTURE ", " DAMPER("0.015") ", \"contact\": {\"model\": "
                                                  "\"impulse\"}, " RELEASE ", " TIME);
    assert_int_equal(outcome->work.contacts, 0);
    assert_int_equal(outcome->work.bounces, outcome->summary.impacts);
    outcome_unref(outcome);
    outcome = outcome_of(STRUCTURE ", " DAMPER("0.015") ", \"contact\": {\"model\": "
                                                        "\"hunt_crossley\"}, " RELEASE ", " TIME);
    assert_true(outcome->work.steps > 100); // of contacts
    assert_int_equal(outcome->work.contacts, outcome->summary.impacts);
    outcome_unref(outcome);
}

TEST(a_still_base_is_flown_over_in_closed_form) {
    Outcome *outcome = outcome_of(STRUCTURE ", " RELEASE ", " TIME);
    assert_left_out(outcome, "forcing");
    assert_int_equal(outcome->work.unforced_samples, 10000);
    assert_int_equal(outcome->work.flight_samples, 0);
    assert_int_equal(outcome->work.base_samples, 0);
    outcome_unref(outcome);
    outcome = outcome_of(STRUCTURE ", " RANDOM ", " TIME);
    assert_null(left_out(&outcome->plan, "forcing"));
    assert_int_equal(outcome->work.unforced_samples, 0);
    assert_int_equal(outcome->work.flight_samples, 10000);
    assert_true(outcome->work.base_samples >= 10001);
    outcome_unref(outcome);
}

TEST(where_nothing_moves_nothing_is_integrated) {
    static const char *const bases[] = {
        "\"kind\": \"free\"",
        "\"kind\": \"random\", \"band\": [0, 15], \"rms\": 0",
        "\"kind\": \"sine\", \"frequency\": 3, \"amplitude\": 0",
        "\"kind\": \"record\", \"interval\": 0.01, \"samples\": [0, 0, 0, 0]",
        "\"kind\": \"record\", \"interval\": 0.01, \"samples\": [1, -1, 1], \"scale\": 0",
        "\"kind\": \"half_sine\", \"amplitude\": 0, \"length\": 0.1",
    };
    static const char *const names[] = {"exact", "rk4"};
    for (size_t i = 0; i < COUNT(bases) * COUNT(names); i++) {
        char members[800];
        snprintf(members, sizeof members,
                 STRUCTURE ", " DAMPER("0.015") ", \"excitation\": {%s}, " SHORT ", " ALL
                                                ", \"accuracy\": {\"solver\": \"%s\"}",
                 bases[i % COUNT(bases)], names[i / COUNT(bases)]);
        Outcome *outcome = outcome_of(members);
        assert_left_out(outcome, "motion");
        const WorkCounters *work = &outcome->work;
        assert_int_equal(work->steps + work->stop_searches, 0);
        assert_true(outcome->summary.peak_displacement == 0 &&
                    outcome->summary.rms_acceleration == 0 &&
                    outcome->summary.energy_residual == 0 && outcome->summary.error_estimate == 0);
        assert_int_equal(outcome->warnings.count, 0);
        const Columns *series = &outcome->response.series;
        assert_int_equal(series->rows, 101);
        assert_int_equal(work->channel_values, series->count * series->rows);
        for (size_t c = 0; c < series->count; c++)
            for (size_t j = 0; j < series->rows; j++)
                assert_true(series->at[c].values[j] ==
                            (strcmp(series->at[c].name, "damper_displacement") == 0 ? 0.1 : 0));
        outcome_unref(outcome);
    }
    // Held between stops without room, or on one of them, it is a matter for the solver.
    Outcome *held = outcome_of(STRUCTURE ", " DAMPER("0") ", " SHORT);
    assert_null(left_out(&held->plan, "motion"));
    assert_true(held->work.stop_searches > 0);
    outcome_unref(held);
}

TEST(what_is_not_asked_for_is_not_made) {
    Outcome *whole = outcome_of(STRUCTURE ", " DAMPER("0.015") ", " RANDOM ", " TIME);
    assert_int_equal(whole->work.channel_values, 6 * 10001);
    assert_true(whole->work.spectrum_segments > 0);
    assert_null(left_out(&whole->plan, "channels"));
    assert_null(left_out(&whole->plan, "psd"));
    assert_null(left_out(&whole->plan, "impacts"));
    Outcome *bare = outcome_of(STRUCTURE ", " DAMPER("0.015") ", " RANDOM ", " TIME ", " SUMMARY);
    assert_left_out(bare, "channels");
    assert_left_out(bare, "psd");
    assert_left_out(bare, "impacts");
    assert_true(left_out(&bare->plan, "channels")->value == 5 * 10001);
    assert_true(left_out(&bare->plan, "psd")->value == (double)whole->work.spectrum_segments);
    assert_int_equal(
        bare->work.channel_values + bare->work.spectrum_segments + bare->work.ledger_rows, 0);
    // What is left answers the same.
    assert_null(bare->response.impacts.at);
    assert_int_equal(bare->summary.impacts, whole->summary.impacts);
    const double all[2][4] = {{whole->summary.peak_contact_force, whole->summary.rms_displacement,
                               whole->response.energy.contact, whole->summary.peak_acceleration},
                              {bare->summary.peak_contact_force, bare->summary.rms_displacement,
                               bare->response.energy.contact, bare->summary.peak_acceleration}};
    for (int i = 0; i < 4; i++)
        assert_true(fabs(all[0][i] - all[1][i]) <= 1e-9 * fabs(all[0][i]));
    outcome_unref(whole);
    outcome_unref(bare);
}

// A stepping solver takes its error from impacts, a table its warning: listed or not.
TEST(what_impacts_tell_is_told_without_their_list) {
    static const char *const scenes[] = {
        STRUCTURE
        ", " DAMPER("0.015") ", " RELEASE ", " TIME
                             ", \"accuracy\": {\"solver\": \"rk4\", \"step\": 1e-4}, \"output\": "
                             "{\"psd\": null, \"impacts\": %s}",
        STRUCTURE
        ", \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": {\"table\": "
        "[{\"approach_speed\": 0.1, \"restitution\": 0.6, \"contact_time\": 0.02}, "
        "{\"approach_speed\": 0.2, \"restitution\": 0.5, \"contact_time\": 0.01}]}}], " RELEASE
        ", " TIME ", \"output\": {\"psd\": null, \"impacts\": %s}",
        STRUCTURE ", " DAMPER("0.015") ", \"contact\": {\"model\": \"impulse\"}, " RELEASE ", " TIME
                                       ", \"output\": {\"psd\": null, \"impacts\": %s}",
    };
    for (size_t i = 0; i < COUNT(scenes); i++) {
        Outcome *outcomes[2];
        for (int k = 0; k < 2; k++) {
            char members[800];
            // NOLINTNEXTLINE: the formats stand above
            snprintf(members, sizeof members, scenes[i], k == 0 ? "true" : "false");
            outcomes[k] = outcome_of(members);
        }
        const Summary *listed = &outcomes[0]->summary, *counted = &outcomes[1]->summary;
        assert_true(listed->impacts > 0);
        assert_int_equal(listed->impacts, counted->impacts);
        assert_true(listed->error_estimate == counted->error_estimate);
        assert_int_equal(outcomes[0]->response.resting_count, outcomes[1]->response.resting_count);
        assert_int_equal(outcomes[0]->warnings.count, outcomes[1]->warnings.count);
        for (size_t k = 0; k < outcomes[0]->warnings.count; k++)
            assert_string_equal(outcomes[0]->warnings.at[k].detail,
                                outcomes[1]->warnings.at[k].detail);
        assert_int_equal(outcomes[0]->warnings.count > 0, i == 0 || i == 1);
        outcome_unref(outcomes[0]);
        outcome_unref(outcomes[1]);
    }
}

// Rows would be more than are allowed; counted, they take no room.
TEST(an_unlisted_run_has_as_many_impacts_as_it_likes) {
    static const SimulationLimits limits = {.impacts = 5};
    for (int is_listed = 0; is_listed < 2; is_listed++) {
        Simulation simulation =
            simulation_of(STRUCTURE ", " DAMPER("0.015") ", " RELEASE ", " TIME);
        Problem problem;
        Outcome *outcome;
        problem_clear(&problem);
        simulation.output.impacts = is_listed;
        const Status status = simulation_run(&simulation, &limits, NULL, NULL, &outcome, &problem);
        assert_int_equal(status, is_listed ? STATUS_LIMIT : STATUS_OK);
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

TEST(a_plan_tells_beforehand_what_it_can) {
    static const struct {
        const char *members;
        bool is_told, is_open;
    } cases[] = {
        {STRUCTURE ", " DAMPER("0.1") ", " RELEASE ", " TIME, true, false},
        {STRUCTURE ", " DAMPER("0.015") ", " RELEASE ", " TIME, false, false},
        {STRUCTURE ", " DAMPER("100") ", " RANDOM ", " TIME, false, true},
        {STRUCTURE ", " RANDOM ", " TIME, false, false},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Simulation simulation = simulation_of(cases[i].members);
        Problem problem;
        PlanReport plan;
        problem_clear(&problem);
        assert_int_equal(simulation_plan(&simulation, &plan, &problem), STATUS_OK);
        assert_int_equal(left_out(&plan, "contacts") != NULL, cases[i].is_told);
        bool is_open = false;
        for (size_t k = 0; k < plan.decisions.count; k++)
            is_open = is_open || strcmp(plan.decisions.at[k].chose, "open") == 0;
        assert_int_equal(is_open, cases[i].is_open);
        fields_clear(plan_report_fields, &plan);
        simulation_clear(&simulation);
    }
}
