// Values that are allowed but hardly meant get a warning each.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "core/simulation/simulation.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/verdict.h"

static Verdict told;

static Status complete(Simulation *simulation) {
    return verdict_complete(&told, simulation);
}

static Damper *damper_of(Simulation *simulation) {
    return &simulation->scene.dampers.at[0];
}

static StructureSdof *sdof_of(Simulation *simulation) {
    return (StructureSdof *)(void *)simulation->scene.structure;
}

static void implausible_values_get_a_warning_each(void **state) {
    (void)state;
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
    assert_string_equal(verdict_warning(&told, "/dampers/0/clearance"),
                        "is 15 m, more than 1 m: metres are meant, not millimetres");
    verdict_begins(verdict_warning(&told, "/dampers/0/position"), "is -2 m");
    assert_string_equal(verdict_warning(&told, "/dampers/0/mass"),
                        "is 110.7 kg, more than the structure's 1.35 kg");
    assert_string_equal(verdict_warning(&told, "/dampers/0/buffer/contact_time"),
                        "is 25 s, more than 1 s: seconds are meant, not milliseconds");
    assert_string_equal(verdict_warning(&told, "/structure/damping_ratio"),
                        "is 1.6, more than 1: a ratio is meant, not percent");
    verdict_begins(verdict_warning(&told, "/excitation/displacement"), "is -15 m, more than 1 m");
    verdict_begins(verdict_warning(&told, "/duration"), "is 0.1 s, less than one period");
    verdict_begins(verdict_warning(&told, "/sample_rate"), "is 5 Hz, fewer than two samples");
    assert_int_equal(told.warnings.count, 8);
    simulation_clear(&simulation);
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_choose(&simulation.scene.excitation, &excitation_kinds, "random");
    Variant *random = simulation.scene.excitation;
    *(Reals *)variant_member(random, "band") = reals_of(2, (const double[]){0, 15});
    *(double *)variant_member(random, "rms") = 981;
    assert_int_equal(complete(&simulation), STATUS_OK);
    verdict_begins(verdict_warning(&told, "/excitation/rms"), "is 981 m/s^2, more than 100 m/s^2");
    simulation_clear(&simulation);
}

static void what_an_excitation_doubts_of_itself_becomes_a_warning(void **state) {
    (void)state;
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_choose(&simulation.scene.excitation, &excitation_kinds, "half_sine");
    *(double *)variant_member(simulation.scene.excitation, "amplitude") = 1;
    *(double *)variant_member(simulation.scene.excitation, "length") = 1e-3;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(told.warnings.count, 1);
    verdict_begins(verdict_warning(&told, "/excitation/length"),
                   "is 0.001 s, less than two samples");
    simulation_clear(&simulation);
}

static void a_scene_in_which_nothing_moves_gets_a_warning(void **state) {
    (void)state;
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_start(&simulation, 0, 0);
    assert_int_equal(complete(&simulation), STATUS_OK);
    verdict_begins(verdict_warning(&told, "/excitation"),
                   "is free vibration from rest: nothing will move");
    assert_int_equal(told.warnings.count, 1);
    verdict_clear(&told);
    scene_start(&simulation, 0, 0.1);
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(told.warnings.count, 0);
    scene_start(&simulation, 0, 0);
    damper_of(&simulation)->velocity = 0.1;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(told.warnings.count, 0);
    simulation_clear(&simulation);
}

static void a_structure_without_a_spring_has_no_period_to_warn_of(void **state) {
    (void)state;
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    sdof_of(&simulation)->stiffness = 0;
    simulation.scene.duration = 1e-3;
    assert_int_equal(complete(&simulation), STATUS_OK);
    assert_int_equal(told.warnings.count, 0);
    simulation_clear(&simulation);
}

static int teardown(void **state) {
    (void)state;
    verdict_clear(&told);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(implausible_values_get_a_warning_each),
        cmocka_unit_test(what_an_excitation_doubts_of_itself_becomes_a_warning),
        cmocka_unit_test(a_scene_in_which_nothing_moves_gets_a_warning),
        cmocka_unit_test(a_structure_without_a_spring_has_no_period_to_warn_of),
    };
    return cmocka_run_group_tests(tests, NULL, teardown);
}
