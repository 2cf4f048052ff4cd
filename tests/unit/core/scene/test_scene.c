#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/scene.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static Status complete(Simulation *simulation, size_t most) {
    problem_clear(&problem);
    return scene_complete(&simulation->scene, most, &problem);
}

TEST(the_end_is_a_sample_too) {
    static const struct {
        double duration, rate;
        size_t count;
    } table[] = {
        {10, 1000, 10001},
        {0.3, 10, 4},
        {0.1, 30, 4},
        {0.05, 10, 1},
        {1e-9, 1e-9, 1},
        {0.9999, 10, 10},
        {1e300, 1e300, SIZE_MAX},
    };
    for (size_t i = 0; i < COUNT(table); i++) {
        const Scene scene = {.duration = table[i].duration, .sample_rate = table[i].rate};
        assert_int_equal(scene_sample_count(&scene), table[i].count);
    }
    const Scene none = {.duration = (double)NAN, .sample_rate = 1};
    assert_int_equal(scene_sample_count(&none), 0);
}

TEST(too_many_samples_are_a_fault_of_the_duration) {
    Simulation simulation;
    scene_without_damper(&simulation);
    assert_int_equal(complete(&simulation, 10001), STATUS_OK);
    assert_int_equal(complete(&simulation, 10000), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(
        detail_at(&problem, "/duration"),
        "10 s at a sample_rate of 1000 Hz are 10001 samples, must be at most 10000");
    simulation.scene.duration = 1e300;
    assert_int_equal(complete(&simulation, 1 << 25), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/duration"),
                        "1e+300 s at a sample_rate of 1000 Hz are 1e+303 samples, must be at most "
                        "33554432");
    simulation.scene.duration = 1e308;
    simulation.scene.sample_rate = 1e308;
    assert_int_equal(complete(&simulation, 1 << 25), STATUS_INVALID);
    simulation_clear(&simulation);
}

TEST(a_scene_without_dampers_has_the_usual_contact) {
    Simulation simulation;
    scene_without_damper(&simulation);
    scene_choose(&simulation.scene.contact, &contact_kinds, "impulse");
    ((Contact *)(void *)simulation.scene.contact)->separation = CHOICE_ABSENT;
    assert_int_equal(complete(&simulation, 0), STATUS_OK);
    assert_ptr_equal(contact_law(scene_contact(&simulation.scene)), &contact_auto);
    assert_int_equal(scene_contact(&simulation.scene)->separation, SEPARATION_ZERO_PENETRATION);
    simulation_clear(&simulation);
}

TEST(auto_stays_auto_and_loses_what_its_law_does_not_use) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.5, NAN);
    assert_int_equal(complete(&simulation, 0), STATUS_OK);
    assert_ptr_equal(contact_law(scene_contact(&simulation.scene)), &contact_auto);
    assert_int_equal(scene_contact(&simulation.scene)->separation, CHOICE_ABSENT);
    simulation_clear(&simulation);
    scene_with_damper(&simulation, 0.61, 0.025);
    ((Contact *)(void *)simulation.scene.contact)->separation = CHOICE_ABSENT;
    assert_int_equal(complete(&simulation, 0), STATUS_OK);
    assert_ptr_equal(contact_law(scene_contact(&simulation.scene)), &contact_auto);
    assert_int_equal(scene_contact(&simulation.scene)->separation, SEPARATION_ZERO_PENETRATION);
    assert_true(simulation.scene.dampers.at[0].buffer.contact_time == 0.025);
    simulation_clear(&simulation);
}

TEST(a_contact_time_beyond_numbers_is_refused) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 1e-200);
    assert_int_equal(complete(&simulation, 0), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/dampers/0/buffer/contact_time");
    simulation.scene.dampers.at[0].buffer.contact_time = 1e200;
    assert_int_equal(complete(&simulation, 0), STATUS_INVALID);
    simulation_clear(&simulation);
}

TEST(parts_that_are_missing_are_passed_over) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    variant_free(simulation.scene.structure);
    variant_free(simulation.scene.contact);
    variant_free(simulation.scene.excitation);
    simulation.scene.structure = simulation.scene.contact = simulation.scene.excitation = NULL;
    simulation.scene.duration = (double)NAN;
    assert_int_equal(complete(&simulation, 100), STATUS_OK);
    simulation_clear(&simulation);
}
