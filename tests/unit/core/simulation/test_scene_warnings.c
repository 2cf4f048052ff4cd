// Warnings of implausible values, and those that depend on the result.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/result/response.h"
#include "core/simulation/simulation.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"
#include "tests/support/verdict.h"

static Verdict seen;

static Status complete(Simulation *simulation) {
    return verdict_complete(&seen, simulation);
}

static Damper *damper_of(Simulation *simulation) {
    return &simulation->scene.dampers.at[0];
}

static SdofStructure *sdof_of(Simulation *simulation) {
    return (SdofStructure *)(void *)simulation->scene.structure;
}

TEST(implausible_values_get_a_warning_each) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 25);
    damper_of(&simulation)->clearance = 15;
    damper_of(&simulation)->position = -2;
    damper_of(&simulation)->mass = 110.7;
    sdof_of(&simulation)->damping = (double)NAN;
    sdof_of(&simulation)->structure.damping_ratio = 1.6;
    simulation.scene.duration = 0.1;
    simulation.scene.sample_rate = 5;
    scene_start(&simulation, -15, 0);
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_string_equal(verdict_warning(&seen, "/dampers/0/clearance"),
                        "is 15 m, more than 1 m: the unit is m, not mm");
    verdict_begins(verdict_warning(&seen, "/dampers/0/position"), "is -2 m");
    assert_string_equal(verdict_warning(&seen, "/dampers/0/mass"),
                        "is 110.7 kg, more than the structure's 1.35 kg");
    assert_string_equal(verdict_warning(&seen, "/dampers/0/buffer/contact_time"),
                        "is 25 s, more than 1 s: the unit is s, not ms");
    assert_string_equal(verdict_warning(&seen, "/structure/damping_ratio"),
                        "is 1.6, more than 1: it is a ratio, not a percentage");
    verdict_begins(verdict_warning(&seen, "/excitation/displacement"), "is -15 m, more than 1 m");
    verdict_begins(verdict_warning(&seen, "/duration"), "is 0.1 s, less than one period");
    verdict_begins(verdict_warning(&seen, "/sample_rate"), "is 5 Hz, fewer than two samples");
    assert_int_equal(seen.warnings.count, 8);
    simulation_clear(&simulation);
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_choose(&simulation.scene.excitation, &excitation_kinds, "random");
    Variant *random = simulation.scene.excitation;
    *(Reals *)variant_member(random, "band") = reals_of(2, (const double[]){0, 15});
    *(double *)variant_member(random, "rms") = 981;
    assert_int_equal(complete(&simulation), STATUS_OK);
    verdict_begins(verdict_warning(&seen, "/excitation/rms"), "is 981 m/s^2, more than 100 m/s^2");
    simulation_clear(&simulation);
}

TEST(what_an_excitation_doubts_of_itself_becomes_a_warning) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_choose(&simulation.scene.excitation, &excitation_kinds, "half_sine");
    *(double *)variant_member(simulation.scene.excitation, "amplitude") = 1;
    *(double *)variant_member(simulation.scene.excitation, "length") = 1e-3;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(seen.warnings.count, 1);
    verdict_begins(verdict_warning(&seen, "/excitation/length"),
                   "is 0.001 s, less than two samples");
    simulation_clear(&simulation);
}

TEST(a_scene_in_which_nothing_moves_gets_a_warning) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_start(&simulation, 0, 0);
    assert_int_equal(complete(&simulation), STATUS_OK);
    verdict_begins(verdict_warning(&seen, "/excitation"),
                   "is free vibration from rest: nothing moves");
    assert_int_equal(seen.warnings.count, 1);
    verdict_clear(&seen);
    scene_start(&simulation, 0, 0.1);
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(seen.warnings.count, 0);
    scene_start(&simulation, 0, 0);
    damper_of(&simulation)->velocity = 0.1;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(seen.warnings.count, 0);
    simulation_clear(&simulation);
}

TEST(a_structure_without_a_spring_has_no_period_to_warn_of) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    sdof_of(&simulation)->stiffness = 0;
    simulation.scene.duration = 1e-3;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(seen.warnings.count, 0);
    simulation_clear(&simulation);
}

static int teardown(void **state) {
    (void)state;
    verdict_clear(&seen);
    return 0;
}

static Problem problem;

static Outcome *run(Simulation *simulation) {
    Outcome *outcome;
    problem_clear(&problem);
    simulation->scene.duration = 5;
    assert_int_equal(simulation_complete(simulation, NULL, NULL, &problem), STATUS_OK);
    assert_int_equal(simulation_run(simulation, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
    return outcome;
}

// Values that do not change with speed, so that only the rows' speeds tell tables apart.
static ContactRows table(double from, double to) {
    ContactRow *rows = malloc(2 * sizeof *rows);
    assert_non_null(rows);
    rows[0] = (ContactRow){from, 0.61, 0.025};
    rows[1] = (ContactRow){to, 0.61, 0.025};
    return (ContactRows){rows, 2};
}

static void scene_with_table(Simulation *simulation, double from, double to) {
    scene_with_damper(simulation, NAN, NAN);
    simulation->scene.dampers.at[0].buffer.table = table(from, to);
}

// Which of a damper's stops have the buffer that a warning is about.
enum { LEFT = 1, RIGHT = 2 };
static const char *const wheres[] = {"", "left stop", "right stop", "stops"};

static const char *warning_of(const Outcome *outcome, size_t damper, int sides) {
    static char wanted[64];
    snprintf(wanted, sizeof wanted, "impacts at the %s of damper %zu were ", wheres[sides], damper);
    const char *found = "(none)";
    for (size_t i = 0; i < outcome->warnings.count; i++)
        if (strstr(outcome->warnings.at[i].detail, wanted) != NULL) {
            assert_string_equal(found, "(none)"); // one for each buffer
            found = outcome->warnings.at[i].detail;
        }
    return found;
}

// What the warning of a buffer must say of the outcome's own ledger.
static void expect(char *target, size_t size, const Outcome *outcome, size_t damper, int sides,
                   double from, double to, const char *whose, const char *end) {
    size_t count = 0, below = 0, above = 0;
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < outcome->response.impacts.count; i++) {
        const Impact *impact = &outcome->response.impacts.at[i];
        if (impact->kind != IMPACT_IMPACT || impact->damper != damper ||
            (1 << impact->side & sides) == 0)
            continue;
        count++;
        below += impact->approach_speed < from;
        above += impact->approach_speed > to;
        least = fmin(least, impact->approach_speed);
        most = fmax(most, impact->approach_speed);
    }
    assert_true(count > 2 && below + above > 0 && below + above < count);
    snprintf(target, size,
             "%zu of %zu impacts at the %s of damper %zu were outside the speeds of %s: all had "
             "%.3g to %.3g m/s; %s",
             below + above, count, wheres[sides], damper, whose, least, most, end);
}

static void expect_table(char *target, size_t size, const Outcome *outcome, size_t damper,
                         int sides, double from, double to) {
    char whose[96];
    snprintf(whose, sizeof whose, "the table, %g to %g m/s", from, to);
    expect(target, size, outcome, damper, sides, from, to, whose, "the nearest row is used there");
}

TEST(impacts_outside_a_table_are_told_under_every_form_of_law) {
    static const char *const laws[] = {"spring_damper", "impulse", "flores"};
    for (size_t i = 0; i < COUNT(laws); i++) {
        Simulation simulation;
        scene_with_table(&simulation, 0.1, 0.35);
        scene_choose(&simulation.scene.contact, &contact_kinds, laws[i]);
        Outcome *outcome = run(&simulation);
        assert_int_equal(outcome->warnings.count, 1);
        char wanted[512];
        expect_table(wanted, sizeof wanted, outcome, 1, LEFT | RIGHT, 0.1, 0.35);
        assert_string_equal(warning_of(outcome, 1, LEFT | RIGHT), wanted);
        assert_string_equal(outcome->warnings.at[0].pointer, "/dampers/0/buffer/table");
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

TEST(speeds_between_the_first_row_and_the_last_are_not_told) {
    Simulation simulation;
    scene_with_table(&simulation, 0, 1);
    Outcome *outcome = run(&simulation);
    assert_true(outcome->summary.impacts > 5);
    assert_int_equal(outcome->warnings.count, 0);
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

TEST(each_stop_of_each_damper_has_its_own_table) {
    Simulation simulation;
    scene_with_damper(&simulation, NAN, NAN);
    Scene *scene = &simulation.scene;
    Damper *dampers = calloc(2, sizeof *dampers);
    assert_non_null(dampers);
    dampers[0] = scene->dampers.at[0];
    assert_int_equal(fields_copy(damper_fields, &dampers[0], &dampers[1]), STATUS_OK);
    free(scene->dampers.at);
    scene->dampers = (Dampers){dampers, 2};
    dampers[0].left_buffer.table = table(0.1, 0.35);
    dampers[0].right_buffer.table = table(0, 1);
    dampers[1].mass = 0.05;
    dampers[1].left_buffer.restitution = 0.61;
    dampers[1].left_buffer.contact_time = 0.025;
    dampers[1].right_buffer.table = table(0.05, 1);
    Outcome *outcome = run(&simulation);
    char wanted[512];
    expect_table(wanted, sizeof wanted, outcome, 1, LEFT, 0.1, 0.35);
    assert_string_equal(warning_of(outcome, 1, LEFT), wanted);
    expect_table(wanted, sizeof wanted, outcome, 2, RIGHT, 0.05, 1);
    assert_string_equal(warning_of(outcome, 2, RIGHT), wanted);
    assert_int_equal(outcome->warnings.count, 2);
    assert_string_equal(outcome->warnings.at[0].pointer, "/dampers/0/left_buffer/table");
    assert_string_equal(outcome->warnings.at[1].pointer, "/dampers/1/right_buffer/table");
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

// A heavy mass leaves a slow buffer without a force and is caught up with before it is out of it:
// another row of the ledger, under the parameters of the first.
TEST(contacts_that_resume_inside_a_buffer_are_of_the_impact_before) {
    Simulation simulation;
    scene_with_table(&simulation, 100, 200);
    Damper *damper = &simulation.scene.dampers.at[0];
    damper->mass = 3;
    damper->clearance = 0.005;
    for (size_t i = 0; i < 2; i++)
        damper->buffer.table.at[i].contact_time = 0.5;
    scene_choose(&simulation.scene.contact, &contact_kinds, "spring_damper");
    ((Contact *)(void *)simulation.scene.contact)->separation = SEPARATION_ZERO_FORCE;
    Outcome *outcome = run(&simulation);
    size_t resumed = 0, told = 0, slower = 0;
    for (size_t i = 0; i < outcome->response.impacts.count; i++)
        resumed += outcome->response.impacts.at[i].is_resumed;
    assert_int_equal(
        sscanf(warning_of(outcome, 1, LEFT | RIGHT), "%zu of %zu impacts", &slower, &told), 2);
    assert_int_equal(slower, told); // nothing moves at 100 m/s
    assert_true(resumed > 0);
    assert_int_equal(told + resumed, outcome->summary.impacts);
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

// The ledger is never cut short: at its limit all are counted, beyond it there is no result.
TEST(a_full_ledger_counts_all_and_a_fuller_one_gives_no_result) {
    Simulation simulation;
    scene_with_table(&simulation, 0.1, 0.35);
    Outcome *outcome = run(&simulation), *limited;
    const SimulationLimits enough = {.impacts = outcome->response.impacts.count},
                           few = {.impacts = outcome->response.impacts.count - 1};
    assert_int_equal(simulation_run(&simulation, &enough, NULL, NULL, &limited, &problem),
                     STATUS_OK);
    char wanted[512];
    snprintf(wanted, sizeof wanted, "%s", warning_of(outcome, 1, LEFT | RIGHT));
    assert_string_not_equal(wanted, "(none)");
    assert_string_equal(warning_of(limited, 1, LEFT | RIGHT), wanted);
    outcome_unref(limited);
    assert_int_equal(simulation_run(&simulation, &few, NULL, NULL, &limited, &problem),
                     STATUS_LIMIT);
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

// A buffer whose material says where it was measured.
static void scene_with_material(Simulation *simulation, double least, double most) {
    scene_with_damper(simulation, 0.61, 0.025);
    Buffer *buffer = &simulation->scene.dampers.at[0].buffer;
    buffer->material = strdup("foam@2");
    buffer->test.least_speed = least;
    buffer->test.most_speed = most;
}

TEST(impacts_outside_what_a_material_was_measured_at_are_told_with_its_name) {
    static const struct {
        double least, most;
        const char *range;
    } ranges[] = {{0.1, 0.3, "0.1 to 0.3 m/s"},
                  {0.1, NAN, "0.1 m/s and more"},
                  {0.1, 50, "0.1 to 50 m/s"},
                  {NAN, 0.3, "0.3 m/s and less"}};
    static const char end[] = "its numbers are used there without a measurement";
    for (size_t i = 0; i < COUNT(ranges); i++) {
        Simulation simulation;
        char wanted[512], whose[96];
        scene_with_material(&simulation, ranges[i].least, ranges[i].most);
        Outcome *outcome = run(&simulation);
        assert_int_equal(outcome->warnings.count, 1);
        snprintf(whose, sizeof whose, "foam@2, %s", ranges[i].range);
        expect(wanted, sizeof wanted, outcome, 1, LEFT | RIGHT, ranges[i].least, ranges[i].most,
               whose, end);
        assert_string_equal(outcome->warnings.at[0].detail, wanted);
        assert_string_equal(outcome->warnings.at[0].pointer, "/dampers/0/buffer");
        outcome_unref(outcome);
        simulation_clear(&simulation);
    }
}

TEST(a_material_of_unknown_range_is_not_warned_of) {
    Simulation simulation;
    scene_with_material(&simulation, NAN, NAN);
    Outcome *outcome = run(&simulation);
    assert_int_equal(outcome->warnings.count, 0);
    assert_null(outcome->response.approaches);
    outcome_unref(outcome);
    simulation_clear(&simulation);
}

// What a material says of its test is no part of what a scene is.
TEST(a_range_moves_no_bit_of_the_run) {
    Simulation with, without;
    scene_with_material(&with, 0.1, 0.3);
    scene_with_material(&without, NAN, NAN);
    Outcome *first = run(&with), *second = run(&without);
    assert_memory_equal(&first->summary, &second->summary, sizeof first->summary);
    outcome_unref(first);
    outcome_unref(second);
    simulation_clear(&with);
    simulation_clear(&without);
}

static const char *pair_warning(const Outcome *outcome) {
    for (size_t i = 0; i < outcome->warnings.count; i++)
        if (strcmp(outcome->warnings.at[i].pointer, "/dampers/0/identified_for") == 0)
            return outcome->warnings.at[i].detail;
    return NULL;
}

static Outcome *run_tested_with(double impactor, double base, int identified_for, const char *law) {
    Simulation simulation;
    scene_with_material(&simulation, NAN, NAN);
    Damper *damper = &simulation.scene.dampers.at[0];
    damper->buffer.test.impactor_mass = impactor;
    damper->buffer.test.base_mass = base;
    damper->identified_for = identified_for;
    scene_choose(&simulation.scene.contact, &contact_kinds, law);
    Outcome *outcome = run(&simulation);
    simulation_clear(&simulation);
    return outcome;
}

TEST(a_test_with_other_masses_is_told_where_its_numbers_are_taken_for_the_scene) {
    // The scene's own effective mass is 0.1023 kg.
    static const struct {
        double impactor, base;
        int identified_for;
        const char *law;
        bool is_told;
    } cases[] = {
        {0.11, NAN, IDENTIFIED_FOR_SCENE, "spring_damper", false}, // nobody says of what base
        {0.11, INFINITY, IDENTIFIED_FOR_SCENE, "spring_damper", false},
        {0.5, INFINITY, IDENTIFIED_FOR_SCENE, "spring_damper", true},
        {0.5, 0.5, IDENTIFIED_FOR_SCENE, "flores", true},
        {0.05, INFINITY, IDENTIFIED_FOR_SCENE, "spring_damper", true},
        {0.2, 0.2, IDENTIFIED_FOR_SCENE, "spring_damper", false},
        {0.5, INFINITY, IDENTIFIED_FOR_RIG, "spring_damper", false},
        {0.5, INFINITY, IDENTIFIED_FOR_SCENE, "impulse", false}, // knows no contact time
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Outcome *outcome = run_tested_with(cases[i].impactor, cases[i].base,
                                           cases[i].identified_for, cases[i].law);
        const char *told = pair_warning(outcome);
        assert_int_equal(told != NULL, cases[i].is_told);
        if (i == 2)
            assert_string_equal(
                told, "foam@2 was measured with an effective mass of 0.5 kg, that of this pair is "
                      "0.102 kg: restitution and contact time belong to a pair of masses; \"rig\" "
                      "carries over the stiffness and damping instead");
        outcome_unref(outcome);
    }
}

TEST_GROUP(NULL, teardown)
