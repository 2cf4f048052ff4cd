// What a result warns of once it is known.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/side.h"
#include "core/math/fourier.h"
#include "core/simulation/simulation.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"

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

static const char *warning_of(const Outcome *outcome, size_t damper, Side side) {
    static char wanted[64];
    snprintf(wanted, sizeof wanted, "impacts at the %s stop of damper %zu met", side_names[side],
             damper);
    const char *found = "(none)";
    for (size_t i = 0; i < outcome->warnings.count; i++)
        if (strstr(outcome->warnings.at[i].detail, wanted) != NULL) {
            assert_string_equal(found, "(none)"); // one for each stop
            found = outcome->warnings.at[i].detail;
        }
    return found;
}

// What the warning of a stop must say of the outcome's own ledger.
static void expect(char *target, size_t size, const Outcome *outcome, size_t damper, Side side,
                   double from, double to) {
    size_t count = 0, outside = 0;
    double least = INFINITY, most = 0;
    for (size_t i = 0; i < outcome->response.impacts.count; i++) {
        const Impact *impact = &outcome->response.impacts.at[i];
        if (impact->kind != IMPACT_IMPACT || impact->damper != damper || impact->side != (int)side)
            continue;
        count++;
        outside += impact->approach_speed < from || impact->approach_speed > to;
        least = fmin(least, impact->approach_speed);
        most = fmax(most, impact->approach_speed);
    }
    assert_true(count > 2 && outside > 0 && outside < count);
    snprintf(target, size,
             "%zu of %zu impacts at the %s stop of damper %zu met it at approach speeds outside "
             "the table's, %g to %g m/s, where the nearest row holds: their speeds were %.6g to "
             "%.6g m/s",
             outside, count, side_names[side], damper, from, to, least, most);
}

static void impacts_outside_a_table_are_told_under_every_form_of_law(void **state) {
    (void)state;
    static const char *const laws[] = {"spring_damper", "impulse", "flores"};
    for (size_t i = 0; i < COUNT(laws); i++) {
        Simulation simulation;
        scene_with_table(&simulation, 0.1, 0.35);
        scene_choose(&simulation.scene.contact, &contact_kinds, laws[i]);
        Outcome *outcome = run(&simulation);
        assert_int_equal(outcome->warnings.count, 2);
        for (int side = 0; side < 2; side++) {
            char wanted[512];
            expect(wanted, sizeof wanted, outcome, 1, (Side)side, 0.1, 0.35);
            assert_string_equal(warning_of(outcome, 1, (Side)side), wanted);
            assert_string_equal(outcome->warnings.at[side].pointer, "/dampers/0/buffer/table");
        }
        outcome_drop(outcome);
        simulation_clear(&simulation);
    }
}

static void speeds_between_the_first_row_and_the_last_are_not_told(void **state) {
    (void)state;
    Simulation simulation;
    scene_with_table(&simulation, 0, 1);
    Outcome *outcome = run(&simulation);
    assert_true(outcome->summary.impacts > 5);
    assert_int_equal(outcome->warnings.count, 0);
    outcome_drop(outcome);
    simulation_clear(&simulation);
}

static void each_stop_of_each_damper_has_its_own_table(void **state) {
    (void)state;
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
    expect(wanted, sizeof wanted, outcome, 1, SIDE_LEFT, 0.1, 0.35);
    assert_string_equal(warning_of(outcome, 1, SIDE_LEFT), wanted);
    expect(wanted, sizeof wanted, outcome, 2, SIDE_RIGHT, 0.05, 1);
    assert_string_equal(warning_of(outcome, 2, SIDE_RIGHT), wanted);
    assert_int_equal(outcome->warnings.count, 2);
    assert_string_equal(outcome->warnings.at[0].pointer, "/dampers/0/left_buffer/table");
    assert_string_equal(outcome->warnings.at[1].pointer, "/dampers/1/right_buffer/table");
    outcome_drop(outcome);
    simulation_clear(&simulation);
}

// A heavy mass leaves a slow buffer without a force and is caught up with before it is out of it:
// another row of the ledger, under the parameters of the first.
static void contacts_that_resume_inside_a_buffer_are_of_the_impact_before(void **state) {
    (void)state;
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
    size_t resumed = 0, told = 0;
    for (size_t i = 0; i < outcome->response.impacts.count; i++)
        resumed += outcome->response.impacts.at[i].is_resumed;
    for (int side = 0; side < 2; side++) {
        size_t outside, count;
        assert_int_equal(sscanf(warning_of(outcome, 1, (Side)side), "%zu of %zu", &outside, &count),
                         2);
        assert_int_equal(outside, count); // nothing moves at 100 m/s
        told += count;
    }
    assert_true(resumed > 0);
    assert_int_equal(told + resumed, outcome->summary.impacts);
    outcome_drop(outcome);
    simulation_clear(&simulation);
}

// The ledger is never cut short: at its limit all are counted, beyond it there is no result.
static void a_full_ledger_counts_all_and_a_fuller_one_gives_no_result(void **state) {
    (void)state;
    Simulation simulation;
    scene_with_table(&simulation, 0.1, 0.35);
    Outcome *outcome = run(&simulation), *limited;
    const SimulationLimits enough = {.impacts = outcome->response.impacts.count},
                           few = {.impacts = outcome->response.impacts.count - 1};
    assert_int_equal(simulation_run(&simulation, &enough, NULL, NULL, &limited, &problem),
                     STATUS_OK);
    for (int side = 0; side < 2; side++) {
        char wanted[512];
        snprintf(wanted, sizeof wanted, "%s", warning_of(outcome, 1, (Side)side));
        assert_string_equal(warning_of(limited, 1, (Side)side), wanted);
    }
    outcome_drop(limited);
    assert_int_equal(simulation_run(&simulation, &few, NULL, NULL, &limited, &problem),
                     STATUS_LIMIT);
    outcome_drop(outcome);
    simulation_clear(&simulation);
}

int main(void) {
    fourier_start();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(impacts_outside_a_table_are_told_under_every_form_of_law),
        cmocka_unit_test(speeds_between_the_first_row_and_the_last_are_not_told),
        cmocka_unit_test(each_stop_of_each_damper_has_its_own_table),
        cmocka_unit_test(contacts_that_resume_inside_a_buffer_are_of_the_impact_before),
        cmocka_unit_test(a_full_ledger_counts_all_and_a_fuller_one_gives_no_result),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
