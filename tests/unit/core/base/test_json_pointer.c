

#include <string.h>

#include "core/base/json_pointer.h"
#include "core/simulation/simulation.h"
#include "core/solve/solver.h"
#include "tests/support/fields.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static char why[JSON_POINTER_MESSAGE_MAX];

static Status set(Simulation *simulation, const char *pointer, const char *json) {
    char room[256];
    JsonScalar value;
    assert_true(json_scalar_read(json, &value, room));
    return json_pointer_set(simulation_fields, simulation, pointer, &value, why);
}

TEST(scalars_are_read_as_they_were_written) {
    char room[64];
    JsonScalar value;
    assert_true(json_scalar_read("0.015", &value, room));
    assert_true(value.kind == JSON_SCALAR_NUMBER && value.number == 0.015);
    assert_true(value.whole == COUNT_ABSENT);
    assert_true(json_scalar_read("9007199254740993", &value, room));
    assert_true(value.whole == 9007199254740993U);
    assert_true(json_scalar_read("\"a \\\"b\\\" \\u0007\\n\"", &value, room));
    assert_string_equal(value.text, "a \"b\" \a\n");
    assert_true(json_scalar_read("true", &value, room) && value.kind == JSON_SCALAR_FLAG &&
                value.flag);
    const char *const bad[] = {"", "x", "1x", "\"open", "\"\\q\"", "\"\\u12\"", "tru", "1e999"};
    for (size_t i = 0; i < COUNT(bad); i++)
        assert_false(json_scalar_read(bad[i], &value, room));
}

TEST(numbers_texts_and_elements_are_set) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    assert_int_equal(set(&simulation, "/dampers/0/clearance", "0.02"), STATUS_OK);
    assert_true(simulation.scene.dampers.at[0].clearance == 0.02);
    assert_int_equal(set(&simulation, "/dampers/0/storey", "1"), STATUS_OK);
    assert_int_equal(simulation.scene.dampers.at[0].storey, 1);
    assert_int_equal(set(&simulation, "/output/impacts", "false"), STATUS_OK);
    assert_false(simulation.output.impacts);
    assert_int_equal(set(&simulation, "/excitation/displacement", "0.01"), STATUS_OK);
    assert_int_equal(set(&simulation, "/excitation/displacement/0", "0.02"), STATUS_OK);
    const Reals *start = variant_member(simulation.scene.excitation, "displacement");
    assert_true(start->count == 1 && start->at[0] == 0.02);
    assert_int_equal(set(&simulation, "/dampers/0/identified_for", "\"rig\""), STATUS_OK);
    assert_int_equal(simulation.scene.dampers.at[0].identified_for, IDENTIFIED_FOR_RIG);
    simulation_clear(&simulation);
}

TEST(another_kind_keeps_what_both_have) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    assert_int_equal(set(&simulation, "/accuracy/solver", "\"rk4\""), STATUS_OK);
    assert_string_equal(simulation.accuracy->kind->name, "rk4");
    assert_int_equal(set(&simulation, "/accuracy/step", "0.001"), STATUS_OK);
    assert_int_equal(set(&simulation, "/accuracy/solver", "\"newmark\""), STATUS_OK);
    assert_true(*(double *)variant_member(simulation.accuracy, "step") == 0.001);
    assert_int_equal(set(&simulation, "/accuracy/solver", "\"exact\""), STATUS_OK);
    assert_int_equal(set(&simulation, "/accuracy/step", "0.001"), STATUS_INVALID);
    scene_start(&simulation, 0.01, 0.2);
    assert_int_equal(set(&simulation, "/excitation/kind", "\"sine\""), STATUS_OK);
    const Reals *start = variant_member(simulation.scene.excitation, "velocity");
    assert_true(start->count == 1 && start->at[0] == 0.2);
    simulation_clear(&simulation);
}

TEST(a_name_replaces_an_item_and_a_member_takes_the_name_away) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    Buffer *buffer = &simulation.scene.dampers.at[0].buffer;
    const char *const pointers[] = {"/dampers/0/buffer", "/dampers/0/buffer/material"};
    for (size_t i = 0; i < COUNT(pointers); i++) {
        buffer->restitution = 0.5;
        assert_int_equal(set(&simulation, pointers[i], "\"sponge@1\""), STATUS_OK);
        assert_string_equal(buffer->material, "sponge@1");
        assert_true(isnan(buffer->restitution) && isnan(buffer->contact_time));
    }
    assert_int_equal(set(&simulation, "/dampers/0/buffer/restitution", "0.7"), STATUS_OK);
    assert_null(buffer->material);
    assert_true(buffer->restitution == 0.7);
    simulation_clear(&simulation);
}

TEST(what_cannot_be_there_is_told_and_changes_nothing) {
    Simulation simulation;
    scene_with_damper(&simulation, 0.61, 0.025);
    static const struct {
        const char *pointer, *json, *said;
    } cases[] = {
        {"/dampers/0/clearance", "\"wide\"", "must be a number [m], is a text"},
        {"/dampers/0/storey", "1.5", "must be a whole number of at least 0, is 1.5"},
        {"/dampers/0/storey", "-1", "must be a whole number of at least 0, is -1"},
        {"/output/impacts", "1", "must be true or false, is a number"},
        {"/dampers/0/identified_for", "\"me\"", "must be one of scene, rig, is \"me\""},
        {"/dampers/0/buffer", "3", "must be a name, is a number"},
        {"/accuracy/solver", "\"euler\"", "must be one of auto"},
        {"/dampers/0/clearence", "1", "did you mean clearance?"},
        {"/dampers/1/mass", "1", "the scene has 1 dampers"},
        {"/dampers/-1/mass", "1", "the scene has 1 dampers"},
        {"/dampers/0", "1", "name a member of it"},
        {"/dampers", "1", "name a member of it"},
        {"/structure", "1", "name a member of it"},
        {"/title", "\"a\"", "name a member of it"},
        {"/structure/mass/0", "1", "there is nothing below mass"},
        {"/contact/model/x", "1", "there is nothing below it"},
        {"/excitation/displacement/1", "1", "elements 0 to 0"},
        {"mass", "1", "must begin with a slash"},
        {"", "1", "must begin with a slash"},
        {"/a~", "1", "~ is not followed"},
    };
    scene_start(&simulation, 0.01, 0);
    for (size_t i = 0; i < COUNT(cases); i++) {
        assert_int_equal(set(&simulation, cases[i].pointer, cases[i].json), STATUS_INVALID);
        if (strstr(why, cases[i].said) == NULL)
            fail_msg("%s: %s", cases[i].pointer, why);
    }
    assert_true(simulation.scene.dampers.at[0].clearance == 0.015);
    simulation_clear(&simulation);
}
