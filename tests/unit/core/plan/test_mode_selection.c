// Modes left out of a plan: those beyond a number, and those that nothing sets moving.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/plan/plan.h"
#include "core/solve/solver.h"
#include "tests/support/document.h"
#include "tests/support/test.h"

static Problem problem;

#define FOUR                                                                                       \
    "\"structure\": {\"kind\": \"frame\", \"masses\": [1, 2, 3, 4], \"stiffnesses\": [900, 800, "  \
    "700, 600], \"damping_ratio\": 0.02}, "
// Two equal masses between three equal springs: the modes are (1, 1) and (1, -1).
#define TWINS                                                                                      \
    "\"structure\": {\"kind\": \"matrices\", \"mass\": [[2, 0], [0, 2]], \"stiffness\": [[800, "   \
    "-400], [-400, 800]]"
#define SINE "\"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 1}"

#define CHIRP                                                                                      \
    "\"excitation\": {\"kind\": \"chirp\", \"start_frequency\": 1, \"end_frequency\": 9, "         \
    "\"amplitude\": 1}"

static Plan *plan_of(const Simulation *simulation) {
    Plan *plan;
    problem_clear(&problem);
    assert_int_equal(plan_new(&simulation->scene, "exact", "exact", &plan, &problem), STATUS_OK);
    return plan;
}

static const Decision *find(const PlanReport *report, const char *about) {
    for (size_t i = 0; i < report->decisions.count; i++)
        if (strcmp(report->decisions.at[i].about, about) == 0)
            return &report->decisions.at[i];
    return NULL;
}

TEST(the_lowest_modes_are_kept_as_they_were) {
    Simulation simulation;
    document_pass(&simulation, FOUR SINE);
    Plan *all = plan_of(&simulation), *some = plan_of(&simulation);
    assert_int_equal(plan_keep(some, &simulation.scene, 2, NULL, &problem), STATUS_OK);
    assert_int_equal(some->modes.count, 2);
    assert_int_equal(some->storeys, 4);
    assert_true(some->is_truncated);
    for (size_t i = 0; i < 2; i++) {
        assert_true(some->modes.omega[i] == all->modes.omega[i]);
        assert_true(some->modes.participation[i] == all->modes.participation[i]);
        assert_true(some->modes.damping[3 * i] == all->modes.damping[5 * i]);
        for (size_t j = 0; j < 4; j++)
            assert_true(some->modes.shapes[j * 2 + i] == all->modes.shapes[j * 4 + i]);
    }
    assert_int_equal(some->report.modes.count, 4); // the structure's
    const Decision *decision = find(&some->report, "modes");
    assert_non_null(decision);
    assert_true(decision->value == 2);
    assert_true(some->given_up > 0 && some->given_up < 1);
    plan_free(all);
    plan_free(some);
    simulation_clear(&simulation);
}

TEST(all_modes_asked_for_are_no_decision) {
    Simulation simulation;
    document_pass(&simulation, FOUR SINE);
    Plan *plan = plan_of(&simulation);
    const size_t before = plan->report.decisions.count;
    assert_int_equal(plan_keep(plan, &simulation.scene, 4, NULL, &problem), STATUS_OK);
    assert_int_equal(plan->modes.count, 4);
    assert_false(plan->is_truncated);
    assert_int_equal(plan->report.decisions.count, before);
    plan_free(plan);
    simulation_clear(&simulation);
}

static size_t left(const char *members, double *value) {
    Simulation simulation;
    document_pass(&simulation, members);
    Plan *plan = plan_of(&simulation);
    assert_int_equal(plan_keep(plan, &simulation.scene, 0, NULL, &problem), STATUS_OK);
    const size_t count = plan->modes.count;
    const Decision *decision = find(&plan->report, "unseen_modes");
    *value = decision == NULL ? 0 : decision->value;
    if (decision != NULL)
        assert_string_equal(decision->chose, "left_out");
    assert_false(plan->is_truncated);
    plan_free(plan);
    simulation_clear(&simulation);
    return count;
}

TEST(what_nothing_sets_moving_is_left_out) {
    static const struct {
        const char *members;
        size_t kept;
    } cases[] = {
        {TWINS "}, " SINE, 1},
        {TWINS ", \"influence\": [1, 0]}, " SINE, 2},
        {TWINS "}, \"excitation\": {\"displacement\": [0.1, 0.1]}", 1},
        {TWINS "}, \"excitation\": {\"velocity\": [0.1, -0.1]}", 1},
        {TWINS "}, \"excitation\": {\"displacement\": [0.1, 0.1], \"velocity\": [0.1, -0.1]}", 2},
        {TWINS "}, \"excitation\": {\"displacement\": [0.1, 0]}", 2},
        {TWINS "}, \"excitation\": {\"displacement\": [0, 0]}", 1}, // nothing at all: one
        {TWINS "}, \"excitation\": {\"kind\": \"sine\", \"frequency\": 1, \"amplitude\": 0}", 1},
        // Damping of one storey ties the modes, that of both does not.
        {TWINS ", \"damping\": [[0.1, 0], [0, 0]]}, " SINE, 2},
        {TWINS ", \"damping\": [[0.1, 0], [0, 0.1]]}, " SINE, 1},
        {TWINS "}, \"dampers\": [{\"storey\": 1, \"mass\": 0.1, \"clearance\": 0.01, \"buffer\": "
               "{\"restitution\": 0.5}}], " SINE,
         2},
        {FOUR SINE, 4},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        double value;
        const size_t kept = left(cases[i].members, &value);
        if (kept != cases[i].kept || value != (i + 1 < COUNT(cases) ? 2 : 4) - (double)kept)
            fail_msg("%s: %zu kept, %g told", cases[i].members, kept, value);
    }
}

// Three equal masses on a line: the second mode, (1, 0, -1), has its node in the middle.
TEST(a_damper_at_a_node_sees_nothing_of_a_mode) {
    static const char line[] =
        "\"structure\": {\"kind\": \"matrices\", \"mass\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "
        "\"stiffness\": [[200, -100, 0], [-100, 200, -100], [0, -100, 200]]}, " SINE
        ", \"dampers\": [{\"storey\": %d, \"mass\": 0.1, \"clearance\": 0.01, \"buffer\": "
        "{\"restitution\": 0.5}}]";
    char members[640];
    double value;
    snprintf(members, sizeof members, line, 2);
    assert_int_equal(left(members, &value), 2);
    snprintf(members, sizeof members, line, 1);
    assert_int_equal(left(members, &value), 3);
}

TEST(a_predicted_error_falls_with_the_modes_kept_to_nothing) {
    static const char *const excitations_of[] = {
        SINE,
        "\"excitation\": {\"displacement\": [0.1, 0, 0, -0.1]}",
        "\"excitation\": {\"kind\": \"random\", \"band\": [1, 9], \"rms\": 1, \"rate\": 100}",
        "\"excitation\": {\"kind\": \"half_sine\", \"amplitude\": 1, \"length\": 0.1}",
        "\"excitation\": {\"kind\": \"triangular\", \"amplitude\": 1, \"length\": 0.1}",
        CHIRP,
        "\"excitation\": {\"kind\": \"record\", \"samples\": [0, 1, -1, 0.5], \"interval\": 0.1}",
        "\"excitation\": {\"displacement\": [0, 0, 0, 0]}",
    };
    for (size_t i = 0; i < COUNT(excitations_of); i++) {
        Simulation simulation;
        char members[512];
        TruncationError errors[4];
        snprintf(members, sizeof members, "%s%s", FOUR, excitations_of[i]);
        document_pass(&simulation, members);
        Plan *plan = plan_of(&simulation);
        assert_int_equal(truncation_predict(plan, &simulation.scene, NULL, errors), STATUS_OK);
        for (size_t k = 0; k < 4; k++) {
            const double all[] = {errors[k].displacement, errors[k].mean_acceleration,
                                  errors[k].rms_displacement};
            for (size_t j = 0; j < COUNT(all); j++)
                assert_true(k == 3 ? all[j] == 0 : all[j] >= 0 && all[j] <= 1);
            if (k > 0) {
                assert_true(errors[k].displacement <= errors[k - 1].displacement);
                assert_true(errors[k].mean_acceleration <= errors[k - 1].mean_acceleration);
            }
            assert_true(k == 3 || i == 7 || errors[k].displacement > 0);
        }
        plan_free(plan);
        simulation_clear(&simulation);
    }
}

static TruncationError predicted(const char *members, size_t kept) {
    Simulation simulation;
    TruncationError errors[20];
    document_pass(&simulation, members);
    Plan *plan = plan_of(&simulation);
    assert_in_range(plan->storeys, kept, COUNT(errors));
    assert_int_equal(truncation_predict(plan, &simulation.scene, NULL, errors), STATUS_OK);
    plan_free(plan);
    simulation_clear(&simulation);
    return errors[kept - 1];
}

// The storey that starts with a speed lends it to its mass, which meets a stop in the end.
TEST(a_mass_that_is_thrown_with_its_storey_meets_its_stops) {
#define THROWN(velocity)                                                                           \
    FOUR "\"dampers\": [{\"mass\": 1, \"clearance\": 0.01, \"velocity\": " velocity                \
         ", \"buffer\": {\"restitution\": 0.6, \"contact_time\": 0.01}}], \"excitation\": "        \
         "{\"kind\": \"free\", \"velocity\": [0.0025, 0.005, 0.0075, 0.01]}"
    // Over 1 s as much as its room; at rest itself it stays where it is.
    const TruncationError carried = predicted(THROWN("0"), 1);
    const TruncationError held = predicted(THROWN("-0.01"), 1);
    assert_true(carried.rms_displacement > 2 * held.rms_displacement);
}

// A base that is slower than none of the modes kept: they have little to show for it, and what
// follows it in those left out is no small part.
TEST(modes_below_a_random_bases_band_take_little_of_it) {
    char members[2000];
    size_t used = (size_t)snprintf(members, sizeof members,
                                   "\"structure\": {\"kind\": \"frame\", \"masses\": [");
    for (int i = 0; i < 20; i++)
        used += (size_t)snprintf(members + used, sizeof members - used, "%s1.5", i > 0 ? ", " : "");
    used += (size_t)snprintf(members + used, sizeof members - used, "], \"stiffnesses\": [");
    for (int i = 0; i < 20; i++)
        used +=
            (size_t)snprintf(members + used, sizeof members - used, "%s94095", i > 0 ? ", " : "");
    snprintf(members + used, sizeof members - used,
             "], \"damping_ratio\": 0.03}, \"excitation\": {\"kind\": \"random\", \"band\": "
             "[20, 45], \"rms\": 4, \"seed\": 64}");
    // About 0.2 of the rms in most runs.
    assert_true(predicted(members, 3).rms_displacement > 0.2);
}

TEST(the_moved_mass_is_shared_out_among_the_modes) {
    Simulation simulation;
    document_pass(&simulation, FOUR SINE);
    Plan *plan = plan_of(&simulation);
    double last = 0;
    for (size_t k = 1; k <= 4; k++) {
        const double now = truncation_moved_mass(plan, k);
        assert_true(now > last);
        last = now;
    }
    assert_true(fabs(last - 1) < 1e-12);
    plan_free(plan);
    simulation_clear(&simulation);
}

TEST(more_modes_than_storeys_are_a_fault) {
    document_refuse(FOUR SINE ", \"accuracy\": {\"modes\": 5}", "/accuracy/modes",
                    "must be at most 4, the structure has one mode per storey, is 5");
    document_refuse(FOUR SINE ", \"accuracy\": {\"solver\": \"rk4\", \"modes\": 0}",
                    "/accuracy/modes", "must be at least 1, is 0");
}

typedef struct Bytes {
    unsigned char at[8192];
    size_t length;
} Bytes;

static void take(void *context, const void *bytes, size_t size) {
    Bytes *all = context;
    assert_true(size <= sizeof all->at - all->length);
    memcpy(all->at + all->length, bytes, size);
    all->length += size;
}

static void canonical(const char *members, Bytes *bytes) {
    Simulation simulation;
    document_pass(&simulation, members);
    bytes->length = 0;
    canonical_write(simulation_fields, &simulation, take, bytes);
    simulation_clear(&simulation);
}

TEST(all_modes_and_none_asked_for_are_the_same_scene) {
    static Bytes none, all, fewer;
    canonical(FOUR SINE, &none);
    canonical(FOUR SINE ", \"accuracy\": {\"modes\": 4}", &all);
    canonical(FOUR SINE ", \"accuracy\": {\"modes\": 3}", &fewer);
    assert_true(none.length == all.length && memcmp(none.at, all.at, all.length) == 0);
    assert_true(none.length != fewer.length);
    canonical("\"structure\": {\"mass\": 1, \"stiffness\": 9}", &none);
    canonical("\"structure\": {\"mass\": 1, \"stiffness\": 9}, \"accuracy\": {\"modes\": 1}", &all);
    assert_true(none.length == all.length && memcmp(none.at, all.at, all.length) == 0);
}
