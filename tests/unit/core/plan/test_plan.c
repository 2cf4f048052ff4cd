// Plans of several storeys and dampers: modes, damping, effective masses, and which engine serves.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/support/document.h"
#include "tests/support/test.h"

#define FRAME(rest) "\"structure\": {\"kind\": \"frame\", \"masses\": [3, 2, 1], " rest "}"
#define SPRINGS "\"stiffnesses\": [3000, 2000, 1000]"
#define DAMPER(rest)                                                                               \
    "{\"mass\": 0.1, \"clearance\": 0.1, \"buffer\": {\"restitution\": 0.5, \"contact_time\": "    \
    "0.01}" rest "}"

static Problem problem;

static Plan *plan_of(const char *members) {
    Simulation simulation;
    Plan *plan = NULL;
    document_pass(&simulation, members);
    problem_clear(&problem);
    const Status status = plan_new(&simulation.scene, "auto", "exact", &plan, &problem);
    if (status != STATUS_OK)
        fail_msg("%s", problem.detail);
    simulation_clear(&simulation);
    return plan;
}

static const Decision *decision(const Plan *plan, const char *about) {
    for (size_t i = 0; i < plan->report.decisions.count; i++)
        if (strcmp(plan->report.decisions.at[i].about, about) == 0)
            return &plan->report.decisions.at[i];
    fail_msg("no decision about %s", about);
    return NULL;
}

TEST(a_ratio_is_the_ratio_of_every_mode) {
    Plan *plan = plan_of(FRAME(SPRINGS ", \"damping_ratio\": 0.03"));
    assert_int_equal(plan->storeys, 3);
    assert_true(plan->modes.is_classical);
    assert_string_equal(decision(plan, "damping")->chose, "modal");
    assert_int_equal(plan->report.modes.count, 3);
    for (size_t k = 0; k < 3; k++) {
        const double omega = plan->modes.omega[k], turn = 2 * acos(-1);
        assert_true(fabs(plan->report.modes.at[k].frequency * turn / omega - 1) < 1e-15);
        assert_true(fabs(plan->report.modes.at[k].damping_ratio - 0.03) < 1e-17);
        // C phi = 2 xi omega M phi
        for (size_t i = 0; i < 3; i++) {
            double sum = 0;
            for (size_t j = 0; j < 3; j++)
                sum += plan->damping[3 * i + j] * plan->modes.shapes[3 * j + k];
            const double right = 0.06 * omega * plan->mass[4 * i] * plan->modes.shapes[3 * i + k];
            assert_true(fabs(sum - right) < 1e-14 * (1 + fabs(right)));
        }
    }
    plan_free(plan);
}

TEST(dampers_between_storeys_couple_the_modes) {
    Plan *plan = plan_of(FRAME(SPRINGS ", \"dampings\": [1, 2, 3]"));
    assert_false(plan->modes.is_classical);
    assert_string_equal(decision(plan, "damping")->chose, "coupled");
    plan_free(plan);
    plan = plan_of(FRAME(SPRINGS ", \"dampings\": [0.3, 0.2, 0.1]"));
    assert_true(plan->modes.is_classical); // C = 1e-4 K
    for (size_t k = 0; k < 3; k++)
        assert_true(fabs(plan->report.modes.at[k].damping_ratio / (0.5e-4 * plan->modes.omega[k]) -
                         1) < 1e-14);
    plan_free(plan);
}

TEST(a_free_mode_has_no_ratio) {
    Plan *plan = plan_of(FRAME("\"stiffnesses\": [0, 2000, 1000], \"damping_ratio\": 0.1"));
    assert_true(plan->report.modes.at[0].frequency == 0);
    assert_true(isnan(plan->report.modes.at[0].damping_ratio));
    plan_free(plan);
}

TEST(a_damper_meets_what_its_storey_moves_at_once) {
    Plan *plan =
        plan_of(FRAME(SPRINGS) ", \"dampers\": [" DAMPER(", \"storey\": 2") ", " DAMPER("") "]");
    assert_true(plan->dampers[0].storey == 1 && plan->dampers[1].storey == 2);
    assert_true(fabs(plan->dampers[0].effective_mass - 0.2 / 2.1) < 1e-16);
    assert_true(fabs(plan->dampers[1].effective_mass - 0.1 / 1.1) < 1e-16);
    assert_int_equal(plan->report.derived.count, 4);
    assert_int_equal(plan->report.derived.at[3].damper, 2);
    plan_free(plan);
    plan =
        plan_of("\"structure\": {\"kind\": \"matrices\", \"mass\": [[2, 0.5], [0.5, 1]], "
                "\"stiffness\": [[5, 0], [0, 4]]}, \"dampers\": [" DAMPER(", \"storey\": 1") "]");
    // (M^-1)_11 = 1 / 1.75
    assert_true(fabs(plan->dampers[0].effective_mass - 1 / (10 + 1 / 1.75)) < 1e-16);
    double sum = 0;
    for (size_t k = 0; k < 2; k++)
        sum += plan->modes.shapes[k] * plan->modes.shapes[k];
    assert_true(fabs(sum * 1.75 - 1) < 1e-15);
    plan_free(plan);
}

TEST(the_initial_state_is_each_storeys) {
    Plan *plan = plan_of(FRAME(SPRINGS) ", \"excitation\": {\"displacement\": [1, 2, 3]}");
    assert_true(plan->displacement[0] == 1 && plan->displacement[2] == 3);
    assert_true(plan->velocity[0] == 0 && plan->velocity[2] == 0);
    plan_free(plan);
}

TEST(one_mass_and_one_damper_have_an_engine_of_their_own) {
#define ONE "\"structure\": {\"mass\": 4, \"stiffness\": 100, \"damping\": 2}"
#define MATRIX(r)                                                                                  \
    "\"structure\": {\"kind\": \"matrices\", \"mass\": [[4]], \"stiffness\": [[100]], "            \
    "\"damping_ratio\": 0.05, \"influence\": [" r "]}"
    static const struct {
        const char *members;
        bool is_single;
    } cases[] = {
        {ONE, true},
        {ONE ", \"dampers\": [" DAMPER("") "]", true},
        {ONE ", \"contact\": {\"model\": \"impulse\"}, \"dampers\": [" DAMPER("") "]", true},
        {ONE ", \"dampers\": [" DAMPER("") ", " DAMPER("") "]", false},
        {MATRIX("1"), true},
        {MATRIX("0.5"), false},
        {FRAME(SPRINGS), false},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Plan *plan = plan_of(cases[i].members);
        assert_true(plan_is_single(plan) == cases[i].is_single);
        assert_true((plan->modes.count == 0) == cases[i].is_single);
        if (plan->storeys == 1) {
            assert_true(fabs(plan->report.modes.at[0].frequency * 2 * acos(-1) - 5) < 1e-14);
            assert_true(fabs(plan->report.modes.at[0].damping_ratio - 0.05) < 1e-16);
            assert_true(fabs(plan->damping[0] - 2) < 1e-15);
        }
        plan_free(plan);
    }
}

TEST(numbers_too_far_apart_have_no_plan) {
    static const char *const members[] = {
        FRAME(SPRINGS ", \"damping_ratio\": 1e308"),
        "\"structure\": {\"kind\": \"frame\", \"masses\": [1e-308, 1], \"stiffnesses\": [1e300, "
        "1]}",
    };
    for (size_t i = 0; i < COUNT(members); i++) {
        Simulation simulation;
        Plan *plan = NULL;
        (void)document_complete(&simulation, members[i], &problem);
        problem_clear(&problem);
        assert_int_equal(plan_new(&simulation.scene, "auto", "exact", &plan, &problem),
                         STATUS_UNSTABLE);
        assert_null(plan);
        assert_true(strlen(problem.detail) > 20);
        simulation_clear(&simulation);
    }
}
