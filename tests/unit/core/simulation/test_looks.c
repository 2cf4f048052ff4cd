#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "core/simulation/simulation.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"

static Problem problem;

typedef struct Looks {
    int count, most;
    double furthest;
} Looks;

static bool look(void *context, double fraction) {
    Looks *looks = context;
    looks->furthest = fraction > looks->furthest ? fraction : looks->furthest;
    return ++looks->count < looks->most;
}

// How far a run of four million samples has come when it is stopped at its so many-th look.
static double stopped_at(double displacement, const char *channel, int most) {
    Simulation simulation = {0};
    scene_with_damper(&simulation, 0.61, 0.025);
    scene_start(&simulation, displacement, 0);
    simulation.scene.duration = 4194;
    simulation.scene.sample_rate = 1000;
    Texts *wanted = &simulation.output.channels;
    for (size_t i = 0; i < wanted->count; i++)
        free(wanted->at[i]);
    free(wanted->at);
    *wanted = texts_of(1, &channel);
    assert_int_equal(simulation_complete(&simulation, NULL, NULL, &problem), STATUS_OK);
    Outcome *outcome = NULL;
    Looks looks = {.most = most};
    const Progress progress = {&looks, look};
    assert_int_equal(simulation_run(&simulation, NULL, &progress, NULL, &outcome, &problem),
                     STATUS_CANCELLED);
    assert_int_equal(looks.count, most);
    simulation_clear(&simulation);
    return looks.furthest;
}

// Millions of values take long to write, before the first step of all.
static void a_run_looks_many_times_while_its_columns_are_made_ready(void **state) {
    (void)state;
    assert_true(stopped_at(0.015, "contact_force", 60) < 0.21);
    assert_true(stopped_at(0.015, "base_acceleration", 60) < 0.21);
}

static void a_run_at_rest_can_be_stopped(void **state) {
    (void)state;
    (void)stopped_at(0, "displacement", 60);
    (void)stopped_at(0, "damper_displacement", 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_run_looks_many_times_while_its_columns_are_made_ready),
        cmocka_unit_test(a_run_at_rest_can_be_stopped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
