// Storey drifts and the base shear: channels and peaks, by every solver, against displacements and
// velocities.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "tests/support/document.h"
#include "tests/support/test.h"

#define START                                                                                      \
    "\"excitation\": {\"kind\": \"random\", \"band\": [0.5, 15], \"rms\": 2, \"seed\": 7}, "
#define DAMPER                                                                                     \
    "\"dampers\": [{\"mass\": 6, \"clearance\": 0.002, \"buffer\": {\"restitution\": 0.5, "        \
    "\"contact_time\": 0.04}}], "
#define FRAME                                                                                      \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [100, 80, 60], \"stiffnesses\": [9e4, 7e4, " \
    "5e4], \"dampings\": [60, 40, 30]}, " START
#define FRAME_CHANNELS                                                                             \
    "\"output\": {\"channels\": [\"displacement_1\", \"displacement_2\", \"displacement_3\", "     \
    "\"velocity_1\", \"storey_drift_1\", \"storey_drift_2\", \"storey_drift_3\", "                 \
    "\"base_shear\"], "                                                                            \
    "\"psd\": null}"

static Outcome *run(const char *members) {
    Simulation simulation;
    Outcome *outcome = NULL;
    Problem problem;
    problem_clear(&problem);
    document_pass(&simulation, members);
    assert_int_equal(simulation_run(&simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    simulation_clear(&simulation);
    return outcome;
}

static double largest(const Columns *series, size_t column) {
    double most = 0;
    for (size_t i = 0; i < series->rows; i++)
        most = fmax(most, fabs(series->at[column].values[i]));
    return most;
}

// Samples see all but what an event between them adds.
static void assert_peak(double peak, double sampled) {
    assert_true(peak >= sampled * (1 - 1e-12));
    assert_true(peak <= sampled * 1.05);
}

TEST(drifts_and_base_shear_of_a_frame_follow_from_its_motion_by_every_solver) {
    static const char *const solver_names[] = {"exact", "adaptive", "newmark", "rk4", "precise"};
    double drift = 0, shear = 0;
    for (size_t k = 0; k < COUNT(solver_names); k++) {
        char members[1024];
        snprintf(members, sizeof members, "%s\"accuracy\": {\"solver\": \"%s\"}, %s", FRAME DAMPER,
                 solver_names[k], FRAME_CHANNELS);
        Outcome *outcome = run(members);
        const Columns *series = &outcome->response.series;
        double storeys = 0;
        for (size_t i = 0; i < series->rows; i++) {
            const double x1 = series->at[0].values[i], x2 = series->at[1].values[i],
                         x3 = series->at[2].values[i], v1 = series->at[3].values[i];
            assert_true(fabs(series->at[4].values[i] - x1) < 1e-14);
            assert_true(fabs(series->at[5].values[i] - (x2 - x1)) < 1e-14);
            assert_true(fabs(series->at[6].values[i] - (x3 - x2)) < 1e-14);
            assert_true(fabs(series->at[7].values[i] - (9e4 * x1 + 60 * v1)) < 1e-9);
        }
        for (size_t i = 4; i < 7; i++)
            storeys = fmax(storeys, largest(series, i));
        const Summary *summary = &outcome->summary;
        assert_peak(summary->peak_storey_drift, storeys);
        assert_peak(summary->peak_base_shear, largest(series, 7));
        assert_true(summary->impacts > 2);
        assert_true(outcome->reduction.peak_storey_drift_reduction < 1 &&
                    outcome->reduction.peak_base_shear_reduction < 1);
        drift = k == 0 ? summary->peak_storey_drift : drift;
        shear = k == 0 ? summary->peak_base_shear : shear;
        assert_true(fabs(summary->peak_storey_drift / drift - 1) < 0.01);
        assert_true(fabs(summary->peak_base_shear / shear - 1) < 0.01);
        outcome_unref(outcome);
    }
}

TEST(the_peaks_of_drift_and_base_shear_do_not_depend_on_the_channels) {
    Outcome *all = run(FRAME DAMPER FRAME_CHANNELS),
            *bare = run(FRAME DAMPER "\"output\": {\"channels\": [], \"psd\": null}");
    assert_true(all->summary.peak_storey_drift == bare->summary.peak_storey_drift);
    assert_true(all->summary.peak_base_shear == bare->summary.peak_base_shear);
    outcome_unref(all);
    outcome_unref(bare);
}

// One storey: of the kinds sdof, frame and matrices, by the kernels of one mass and by the others.
TEST(the_base_shear_of_one_mass_is_that_of_its_spring_and_dashpot) {
    static const char *const kinds[] = {
        "\"mass\": 100, \"stiffness\": 9e4, \"damping\": 60",
        "\"kind\": \"frame\", \"masses\": [100], \"stiffnesses\": [9e4], \"dampings\": [60]",
        ("\"kind\": \"matrices\", \"mass\": [[100]], \"stiffness\": [[9e4]], \"damping\": [[60]], "
         "\"influence\": [1]")};
    static const char *const solver_names[] = {"exact", "rk4"};
    for (size_t k = 0; k < 2 * COUNT(kinds); k++) {
        char members[1024];
        const bool is_frame = k / 2 == 1;
        snprintf(members, sizeof members,
                 START DAMPER
                 "\"structure\": {%s}, \"accuracy\": {\"solver\": \"%s\"}, \"output\": "
                 "{\"channels\": [\"displacement\", \"velocity\", \"base_shear\"%s]}",
                 kinds[k / 2], solver_names[k % 2], is_frame ? ", \"storey_drift\"" : "");
        Outcome *outcome = run(members);
        const Columns *series = &outcome->response.series;
        for (size_t i = 0; i < series->rows; i++) {
            const double x = series->at[0].values[i], v = series->at[1].values[i];
            assert_true(fabs(series->at[2].values[i] - (9e4 * x + 60 * v)) < 1e-9);
            assert_true(!is_frame || series->at[3].values[i] == x);
        }
        assert_peak(outcome->summary.peak_base_shear, largest(series, 2));
        assert_true(outcome->summary.impacts > 2);
        if (is_frame)
            assert_true(outcome->summary.peak_storey_drift == outcome->summary.peak_displacement);
        else
            assert_true(isnan(outcome->summary.peak_storey_drift) &&
                        isnan(outcome->reduction.peak_storey_drift_reduction));
        outcome_unref(outcome);
    }
    Outcome *alone = run(START "\"structure\": {\"kind\": \"frame\", \"masses\": [100], "
                               "\"stiffnesses\": [9e4]}, \"output\": {\"channels\": "
                               "[\"storey_drift\"]}");
    assert_true(largest(&alone->response.series, 0) > 0.9 * alone->summary.peak_displacement);
    outcome_unref(alone);
}

// Modes that are left out follow the base: their mass times its acceleration acts on the base.
TEST(modes_left_out_leave_the_base_shear_nearly_alone) {
    static const char frame[] =
        "\"structure\": {\"kind\": \"frame\", \"masses\": [10, 10, 10, 10, 10, 10, 10, 10], "
        "\"stiffnesses\": [2e5, 2e5, 2e5, 2e5, 2e5, 2e5, 2e5, 2e5], \"damping_ratio\": 0.05}, "
        "\"excitation\": {\"kind\": \"random\", \"band\": [0.5, 4], \"rms\": 1, \"seed\": 2}, "
        "\"output\": {\"channels\": [\"base_shear\", \"storey_drift_1\"]}, \"accuracy\": "
        "{\"solver\": \"exact\"";
    char few[1024], all[1024];
    snprintf(all, sizeof all, "%s}", frame);
    snprintf(few, sizeof few, "%s, \"modes\": 3}", frame);
    Outcome *whole = run(all), *reduced = run(few);
    const double *a = whole->response.series.at[0].values,
                 *b = reduced->response.series.at[0].values;
    for (size_t i = 0; i < whole->response.count; i++)
        assert_true(fabs(a[i] - b[i]) < 0.01 * whole->summary.peak_base_shear);
    assert_true(fabs(reduced->summary.peak_base_shear / whole->summary.peak_base_shear - 1) < 0.01);
    assert_true(fabs(reduced->summary.peak_storey_drift / whole->summary.peak_storey_drift - 1) <
                0.05);
    outcome_unref(whole);
    outcome_unref(reduced);
}

TEST(drifts_are_of_frames_only) {
    document_refuse(
        "\"structure\": {\"mass\": 1, \"stiffness\": 100}, \"output\": {\"channels\": "
        "[\"storey_drift\"]}",
        "/output/channels/0",
        "storey_drift needs a structure of the kind frame, this one is of the kind sdof");
    document_refuse("\"structure\": {\"kind\": \"matrices\", \"mass\": [[2, 0], [0, 1]], "
                    "\"stiffness\": [[20, -10], [-10, 10]], \"influence\": [1, 1]}, \"output\": "
                    "{\"psd\": {\"channels\": [\"storey_drift_1\"]}}",
                    "/output/psd/channels/0",
                    "storey_drift_1 needs a structure of the kind frame, this one is of the kind "
                    "matrices");
    document_refuse(FRAME "\"output\": {\"channels\": [\"storey_drift\"]}", "/output/channels/0",
                    "must carry the number of a storey, from storey_drift_1 to storey_drift_3: the "
                    "scene has 3 storeys and 0 dampers");
    document_refuse(FRAME "\"output\": {\"channels\": [\"base_shear_1\"]}", "/output/channels/0",
                    "must be base_shear, without a number: there is only one");
}
