#include "tests/support/scenes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/fields.h"

void scene_without_damper(Simulation *simulation) {
    assert_int_equal(fields_default(simulation_fields, simulation), STATUS_OK);
    Scene *scene = &simulation->scene;
    scene_choose(&scene->structure, &structure_kinds, "sdof");
    SdofStructure *sdof = (SdofStructure *)(void *)scene->structure;
    sdof->mass = 1.35;
    sdof->stiffness = 865;
    sdof->damping = 1.092;
    scene_start(simulation, 0.015, 0);
    scene->duration = 10;
    scene->sample_rate = 1000;
}

void scene_with_damper(Simulation *simulation, double restitution, double contact_time) {
    scene_without_damper(simulation);
    Damper *damper = calloc(1, sizeof *damper);
    assert_non_null(damper);
    assert_int_equal(fields_default(damper_fields, damper), STATUS_OK);
    damper->mass = 0.1107;
    damper->clearance = 0.015;
    damper->buffer.restitution = restitution;
    damper->buffer.contact_time = contact_time;
    simulation->scene.dampers = (Dampers){damper, 1};
}

void scene_start(Simulation *simulation, double displacement, double velocity) {
    Excitation *excitation = (Excitation *)(void *)simulation->scene.excitation;
    free(excitation->displacement.at);
    free(excitation->velocity.at);
    excitation->displacement = reals_of(1, &displacement);
    excitation->velocity = reals_of(1, &velocity);
}

void scene_choose(Variant **variant, const KindTable *kinds, const char *name) {
    const Kind *kind = kind_find(kinds, name);
    assert_non_null(kind);
    variant_free(*variant);
    *variant = variant_new(kind);
    assert_non_null(*variant);
}
