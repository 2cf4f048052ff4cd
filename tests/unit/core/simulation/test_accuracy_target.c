// accuracy.target: what is asked, told, refused and stopped. Whether targets are kept is
// tests/truth/test_target.c's question.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/result/response.h"
#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "tests/support/document.h"
#include "tests/support/test.h"

#define LINEAR                                                                                     \
    "\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}, "                    \
    "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, "                                      \
    "\"buffer\": {\"restitution\": 0.61, \"contact_time\": 0.025}}], "                             \
    "\"excitation\": {\"kind\": \"free\", \"displacement\": 0.015}"
#define POWER LINEAR ", \"contact\": {\"model\": \"hunt_crossley\"}"
// The Lyapunov exponent of a mass between elastic stops that a sine drives is large.
#define CHAOTIC                                                                                    \
    "\"structure\": {\"mass\": 1, \"stiffness\": 1000}, "                                          \
    "\"dampers\": [{\"mass\": 0.5, \"clearance\": 0.01, "                                          \
    "\"buffer\": {\"restitution\": 0.9, \"contact_time\": 0.001}}], "                              \
    "\"contact\": {\"model\": \"hunt_crossley\"}, "                                                \
    "\"excitation\": {\"kind\": \"sine\", \"frequency\": 4, \"amplitude\": 3}"

static Outcome *run(const char *members) {
    Simulation simulation;
    Outcome *outcome = NULL;
    document_pass(&simulation, members);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, NULL), STATUS_OK);
    simulation_clear(&simulation);
    return outcome;
}

static const Decision *find(const PlanReport *plan, const char *about) {
    for (size_t i = 0; i < plan->decisions.count; i++)
        if (strcmp(plan->decisions.at[i].about, about) == 0)
            return &plan->decisions.at[i];
    fail_msg("no decision about %s", about);
    return NULL;
}

TEST(linear_contact_is_run_exactly_and_says_so) {
    Outcome *outcome = run(LINEAR ", \"accuracy\": {\"target\": 1e-3}");
    Outcome *plain = run(LINEAR);
    const PlanTarget *target = &outcome->plan.target;
    assert_string_equal(target->way, "exact");
    assert_int_equal(target->verdict, VERDICT_KEPT);
    assert_int_equal(target->metric, METRIC_DISPLACEMENT);
    assert_true(target->error == 1e-3 && target->estimated_error < 1e-9);
    assert_int_equal(target->attempts.count, 1);
    assert_string_equal(find(&outcome->plan, "solver")->chose, "exact");
    assert_non_null(strstr(find(&outcome->plan, "target")->why, "no cheaper settings"));
    assert_true(isnan(plain->plan.target.error));
    assert_memory_equal(outcome->response.series.block, plain->response.series.block,
                        plain->response.series.rows * plain->response.series.count *
                            sizeof(double));
    outcome_unref(outcome);
    outcome_unref(plain);
}

TEST(a_power_law_is_followed_no_closer_than_asked_for) {
    Outcome *loose = run(POWER ", \"accuracy\": {\"target\": 1e-2}");
    Outcome *tight = run(POWER ", \"accuracy\": {\"target\": 1e-8}");
    Outcome *whole = run(POWER);
    assert_true(strstr(loose->plan.target.way, "tolerance") != NULL);
    assert_int_equal(loose->plan.target.verdict, VERDICT_KEPT);
    assert_int_equal(loose->warnings.count, 0); // nothing to advise
    assert_int_equal(tight->plan.target.verdict, VERDICT_KEPT);
    assert_true(loose->steps < tight->steps && tight->steps < 1.5 * whole->steps);
    double worst = 0;
    for (size_t i = 0; i < whole->response.count; i++)
        worst = fmax(worst, fabs(loose->response.series.at[0].values[i] -
                                 whole->response.series.at[0].values[i]));
    assert_true(worst > 0 && worst <= 1e-2 * whole->summary.peak_displacement);
    outcome_unref(loose);
    outcome_unref(tight);
    outcome_unref(whole);
}

#define FRAME(contact_time)                                                                        \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [100, 100, 100], "                           \
    "\"stiffnesses\": [1e6, 1e6, 1e6], \"damping_ratio\": 0.02}, "                                 \
    "\"dampers\": [{\"mass\": 1, \"clearance\": 0.02, "                                            \
    "\"buffer\": {\"restitution\": 0.5, \"contact_time\": " #contact_time "}}], "                  \
    "\"excitation\": {\"kind\": \"free\", \"displacement\": [0.005, 0.01, 0.015]}"
#define SEEN ", \"output\": {\"channels\": [\"displacement_3\"]}"
#define HEARD ", \"output\": {\"channels\": [\"contact_force_1\"]}"

// Blows for pushes: only where they keep the target and nobody asks for a force.
TEST(contacts_are_impulses_where_that_keeps_the_target) {
    Outcome *struck = run(FRAME(1e-8) SEEN ", \"accuracy\": {\"target\": 1e-2}");
    Outcome *whole = run(FRAME(1e-8) SEEN);
    assert_string_equal(struck->plan.target.way, "exact, impulses");
    assert_int_equal(struck->plan.target.verdict, VERDICT_KEPT);
    assert_string_equal(struck->plan.contact_model, "impulse");
    assert_string_equal(find(&struck->plan, "contact_model")->why, "chosen by accuracy.target");
    assert_true(struck->steps < whole->steps);
    const double *x = struck->response.series.at[0].values,
                 *y = whole->response.series.at[0].values;
    for (size_t i = 0; i < whole->response.count; i++)
        assert_true(fabs(x[i] - y[i]) <= 1e-2 * whole->summary.peak_displacement);
    outcome_unref(struck);
    outcome_unref(whole);
    static const char *const others[] = {
        FRAME(1e-8) HEARD ", \"accuracy\": {\"target\": 1e-2}",
        FRAME(1e-8) SEEN ", \"accuracy\": {\"target\": 1e-9}",
        FRAME(1e-2) SEEN ", \"accuracy\": {\"target\": 1e-2}",
        FRAME(1e-8) SEEN ", \"accuracy\": {\"target\": 1e-2, \"metric\": \"peak_force\"}",
        FRAME(1e-8) SEEN
        ", \"contact\": {\"model\": \"spring_damper\"}, \"accuracy\": {\"target\": 1e-2}",
    };
    for (size_t i = 0; i < COUNT(others); i++) {
        Outcome *outcome = run(others[i]);
        assert_string_equal(outcome->plan.contact_model, "spring_damper");
        outcome_unref(outcome);
    }
}

// Of a motion that has died away what was wrong before is a larger part.
TEST(late_statistics_are_beside_what_is_left_of_the_motion) {
    Simulation simulation;
    document_pass(&simulation, POWER ", \"accuracy\": {\"target\": 1e-2, \"metric\": "
                                     "\"rms_displacement\"}");
    simulation.scene.duration = 10;
    simulation.output.statistics_from = 8;
    Outcome *aimed, *whole;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &aimed, NULL), STATUS_OK);
    ((AccuracyAuto *)(void *)simulation.accuracy)->target = (double)NAN;
    ((AccuracyAuto *)(void *)simulation.accuracy)->metric = CHOICE_ABSENT;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &whole, NULL), STATUS_OK);
    const double error =
        fabs(aimed->summary.rms_displacement / whole->summary.rms_displacement - 1);
    assert_int_equal(aimed->plan.target.verdict, VERDICT_KEPT);
    assert_true(error <= aimed->plan.target.estimated_error);
    outcome_unref(aimed);
    outcome_unref(whole);
    simulation_clear(&simulation);
}

TEST(what_does_not_move_has_no_error) {
    Outcome *outcome = run("\"structure\": {\"mass\": 1, \"stiffness\": 9}, \"excitation\": "
                           "{\"kind\": \"free\"}, \"accuracy\": {\"target\": 1e-3, "
                           "\"metric\": \"rms_displacement\"}");
    assert_int_equal(outcome->plan.target.verdict, VERDICT_KEPT);
    assert_true(outcome->plan.target.estimated_error == 0);
    outcome_unref(outcome);
}

TEST(what_no_double_can_keep_is_marked) {
    Simulation simulation;
    document_pass(&simulation, CHAOTIC ", \"accuracy\": {\"target\": 1e-4}");
    simulation.scene.duration = 60;
    Outcome *outcome;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, NULL), STATUS_OK);
    const PlanTarget *target = &outcome->plan.target;
    assert_int_equal(target->verdict, VERDICT_MISSED);
    assert_string_equal(target->way, "exact");
    assert_true(target->estimated_error > 1e-4);
    assert_true(target->attempts.count >= 1);
    bool is_warned = false;
    for (size_t i = 0; i < outcome->warnings.count; i++)
        is_warned = is_warned || strcmp(outcome->warnings.at[i].pointer, "/accuracy/target") == 0;
    assert_true(is_warned);
    outcome_unref(outcome);
    ((AccuracyAuto *)(void *)simulation.accuracy)->metric = METRIC_RMS_DISPLACEMENT;
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, NULL), STATUS_OK);
    assert_int_equal(outcome->plan.target.verdict, VERDICT_UNKNOWN);
    assert_true(isnan(outcome->plan.target.estimated_error));
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

// A frame under a power law: the base's shear is that of the exact run to the target.
TEST(drift_and_base_shear_are_metrics_of_a_target) {
#define DRIFTING                                                                                   \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [100, 80], \"stiffnesses\": [9e4, 7e4]}, "   \
    "\"dampers\": [{\"mass\": 6, \"clearance\": 0.004, "                                           \
    "\"buffer\": {\"restitution\": 0.5, \"contact_time\": 0.02}}], "                               \
    "\"contact\": {\"model\": \"hunt_crossley\"}, "                                                \
    "\"excitation\": {\"kind\": \"free\", \"displacement\": [0.005, 0.01]}"
    Outcome *exact = run(DRIFTING ", \"accuracy\": {\"solver\": \"exact\"}");
    const Summary *should = &exact->summary;
    static const char *const names[] = {"peak_storey_drift", "peak_base_shear"};
    const double values[] = {should->peak_storey_drift, should->peak_base_shear};
    for (size_t i = 0; i < COUNT(names); i++) {
        char members[1024];
        snprintf(members, sizeof members,
                 "%s, \"accuracy\": {\"target\": 1e-3, \"metric\": \"%s\"}", DRIFTING, names[i]);
        Outcome *outcome = run(members);
        const Summary *is = &outcome->summary;
        const double value = i == 0 ? is->peak_storey_drift : is->peak_base_shear;
        assert_int_equal(outcome->plan.target.metric, METRIC_PEAK_STOREY_DRIFT + (int)i);
        assert_int_equal(outcome->plan.target.verdict, VERDICT_KEPT);
        assert_non_null(strstr(outcome->plan.target.way, "tolerance"));
        assert_true(value != values[i] && fabs(value / values[i] - 1) < 1e-3);
        outcome_unref(outcome);
    }
    outcome_unref(exact);
}

TEST(a_dry_run_names_the_way) {
    Simulation simulation;
    PlanReport report;
    document_pass(&simulation, POWER ", \"accuracy\": {\"target\": 1e-4}");
    assert_int_equal(simulation_plan(&simulation, &report, NULL), STATUS_OK);
    assert_non_null(strstr(report.target.way, "exact, tolerance"));
    assert_true(report.target.predicted_error <= 1e-4);
    assert_true(isnan(report.target.estimated_error));
    assert_int_equal(report.target.verdict, CHOICE_ABSENT);
    assert_int_equal(report.target.attempts.count, 0);
    fields_clear(plan_report_fields, &report);
    const double cost = simulation_cost(&simulation).steps;
    ((AccuracyAuto *)(void *)simulation.accuracy)->target = (double)NAN;
    assert_true(cost > 0 && cost <= simulation_cost(&simulation).steps);
    simulation_clear(&simulation);
}

TEST(what_cannot_be_a_metric_is_refused) {
    document_refuse(LINEAR ", \"accuracy\": {\"target\": 2}", "/accuracy/target",
                    "must be within [1e-15, 1], is 2");
    document_refuse(LINEAR ", \"output\": {\"psd\": null}, "
                           "\"accuracy\": {\"target\": 0.1, \"metric\": \"psd\"}",
                    "/accuracy/metric", "psd needs spectra: ask for some in /output/psd");
    document_refuse(LINEAR ", \"contact\": {\"model\": \"impulse\"}, "
                           "\"accuracy\": {\"target\": 0.1, \"metric\": \"peak_force\"}",
                    "/accuracy/metric",
                    "peak_force needs contacts with a force: impulses have none, choose another "
                    "contact model");
    document_refuse("\"structure\": {\"mass\": 1, \"stiffness\": 1}, "
                    "\"accuracy\": {\"target\": 0.1, \"metric\": \"impacts\"}",
                    "/accuracy/metric", "impacts needs a damper: the scene has none");
}

static void put(void *context, const void *bytes, size_t size) {
    char *text = context;
    const size_t used = strlen(text);
    for (size_t i = 0; i < size && used + i + 1 < 4096; i++)
        text[used + i] = ((const char *)bytes)[i] == '\0' ? ' ' : ((const char *)bytes)[i];
}

TEST(a_metric_without_a_target_means_nothing) {
    char plain[4096] = "", with[4096] = "";
    Simulation simulation;
    document_pass(&simulation, LINEAR);
    canonical_write(simulation_fields, &simulation, put, plain);
    simulation_clear(&simulation);
    document_pass(&simulation, LINEAR ", \"accuracy\": {\"metric\": \"impacts\"}");
    canonical_write(simulation_fields, &simulation, put, with);
    simulation_clear(&simulation);
    assert_string_equal(plain, with);
}

typedef struct Countdown {
    double last;
    int left;
    bool is_back;
} Countdown;

static bool advance(void *context, double fraction) {
    Countdown *countdown = context;
    countdown->is_back = countdown->is_back || fraction < countdown->last || fraction > 1;
    countdown->last = fraction;
    return --countdown->left > 0;
}

TEST(progress_goes_forward_over_all_runs_and_a_stop_is_heard) {
    Simulation simulation;
    Problem *problem = calloc(1, sizeof *problem);
    assert_non_null(problem);
    document_pass(&simulation, CHAOTIC ", \"accuracy\": {\"target\": 1e-4}");
    simulation.scene.duration = 60;
    Countdown countdown = {.left = 1 << 30};
    const Progress progress = {&countdown, advance};
    Outcome *outcome;
    assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, problem),
                     STATUS_OK);
    assert_false(countdown.is_back);
    assert_true(countdown.last > 0.6);
    outcome_unref(outcome);
    const int calls = (1 << 30) - countdown.left;
    for (int left = 1; left < calls; left += calls / 7 + 1) {
        countdown = (Countdown){.left = left};
        problem_clear(problem);
        assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, problem),
                         STATUS_CANCELLED);
        assert_null(outcome);
        assert_int_equal(problem->status, STATUS_CANCELLED);
    }
    simulation_clear(&simulation);
    free(problem);
}
