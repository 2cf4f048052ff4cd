// Buffers in all their combinations, under each law.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/damper.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem problem;

static Damper damper_new(void) {
    Damper damper;
    assert_int_equal(fields_default(damper_fields, &damper), STATUS_OK);
    damper.mass = 0.1;
    damper.clearance = 0.015;
    return damper;
}

static void set_measured(Buffer *buffer, double e, double T_c) {
    buffer->restitution = e;
    buffer->contact_time = T_c;
}

static void set_known(Buffer *buffer, double k, double c) {
    buffer->stiffness = k;
    buffer->damping = c;
}

static Status complete(Damper *damper, const ContactLaw *law) {
    problem_clear(&problem);
    return damper_complete(damper, law, 1, "/dampers/0", &problem);
}

static const ContactLaw *law_of(const Damper *damper, const ContactLaw *asked) {
    Damper copy = *damper;
    const Dampers dampers = {&copy, 1};
    const Contact contact = {{&asked->kind}, 0};
    return dampers_contact_law(&dampers, &contact);
}

TEST(a_damper_stands_on_the_top_storey) {
    Damper damper = damper_new();
    set_measured(&damper.buffer, 0.6, 0.02);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_int_equal(damper.storey, 1);
    damper.storey = 2;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/dampers/0/storey"),
                        "must be at most 1, the number of storeys, is 2");
    fields_clear(damper_fields, &damper);
}

TEST(the_free_mass_starts_between_its_stops) {
    Damper damper = damper_new();
    set_measured(&damper.buffer, 0.6, 0.02);
    damper.position = -0.0075;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    damper.position = -0.0076;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(detail_at(&problem, "/dampers/0/position"),
                        "must be between the stops, within [-0.0075, 0.0075] m, is -0.0076");
    assert_string_equal(problem.faults[0].unit, "m");
    damper.clearance = 0;
    damper.position = 0;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    // A clearance that is a fault itself says nothing of the position.
    damper.clearance = -1;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    damper.clearance = 1e308;
    damper.offset = 1.7e308;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/dampers/0/offset");
    fields_clear(damper_fields, &damper);
}

TEST(auto_takes_spring_and_damper_wherever_a_contact_is_known) {
    Damper damper = damper_new();
    damper.buffer.restitution = 0.6;
    assert_ptr_equal(law_of(&damper, &contact_auto), &contact_impulse);
    damper.buffer.contact_time = 0.02;
    assert_ptr_equal(law_of(&damper, &contact_auto), &contact_spring_damper);
    assert_ptr_equal(law_of(&damper, &contact_impulse), &contact_impulse);
    damper.buffer.contact_time = (double)NAN;
    set_known(&damper.right_buffer, 1000, 1);
    assert_ptr_equal(law_of(&damper, &contact_auto), &contact_spring_damper);
    assert_ptr_equal(damper_buffer(&damper, SIDE_LEFT), &damper.buffer);
    assert_ptr_equal(damper_buffer(&damper, SIDE_RIGHT), &damper.right_buffer);
    fields_clear(damper_fields, &damper);
}

typedef struct Case {
    const char *text;
    double e, T_c, k, c;
    const ContactLaw *law;
    const char *pointer; // NULL: sound
    const char *detail;  // its beginning
} Case;

#define NO ((double)NAN)

static const Case cases[] = {
    {"e and T_c", 0.6, 0.02, NO, NO, &contact_spring_damper, NULL, NULL},
    {"k and c", NO, NO, 1000, 0, &contact_spring_damper, NULL, NULL},
    {"e alone, impulse", 0.6, NO, NO, NO, &contact_impulse, NULL, NULL},
    {"e = 0, impulse", 0, NO, NO, NO, &contact_impulse, NULL, NULL},
    {"e and T_c, impulse", 0.6, 0.02, NO, NO, &contact_impulse, NULL, NULL},
    {"e = 0 and T_c, impulse", 0, 0.02, NO, NO, &contact_impulse, NULL, NULL},
    {"e = 0", 0, 0.02, NO, NO, &contact_spring_damper, "/dampers/0/buffer/restitution",
     "must be above 0 for the contact model spring_damper, is 0"},
    {"e = 0 without T_c", 0, NO, NO, NO, &contact_spring_damper, "/dampers/0/buffer/restitution",
     "must be above 0"},
    {"e alone", 0.6, NO, NO, NO, &contact_spring_damper, "/dampers/0/buffer/contact_time",
     "is required by the contact model spring_damper"},
    {"k and c, impulse", NO, NO, 1000, 1, &contact_impulse, "/dampers/0/buffer/restitution",
     "is required by the contact model impulse"},
    {"T_c alone", NO, 0.02, NO, NO, &contact_spring_damper, "/dampers/0/buffer/restitution",
     "is required with contact_time"},
    {"k alone", NO, NO, 1000, NO, &contact_spring_damper, "/dampers/0/buffer/damping",
     "is required with stiffness"},
    {"c alone", NO, NO, NO, 1, &contact_spring_damper, "/dampers/0/buffer/stiffness",
     "is required with damping"},
    {"e and k", 0.6, NO, 1000, NO, &contact_spring_damper, "/dampers/0/buffer",
     "must be given in one way"},
    {"all four", 0.6, 0.02, 1000, 1, &contact_impulse, "/dampers/0/buffer",
     "must be given in one way"},
};

TEST(a_buffer_is_given_in_one_way_that_its_law_takes) {
    for (size_t i = 0; i < COUNT(cases); i++) {
        const Case *one = &cases[i];
        Damper damper = damper_new();
        set_measured(&damper.buffer, one->e, one->T_c);
        set_known(&damper.buffer, one->k, one->c);
        const Status status = complete(&damper, one->law);
        if (one->pointer == NULL) {
            if (status != STATUS_OK)
                fail_msg("%s: %s", one->text, problem.detail);
        } else {
            const char *detail = detail_at(&problem, one->pointer);
            if (status != STATUS_INVALID || problem.count != 1 ||
                strncmp(detail, one->detail, strlen(one->detail)) != 0)
                fail_msg("%s: %zu faults, %s", one->text, problem.count, problem.detail);
        }
        fields_clear(damper_fields, &damper);
    }
}

TEST(what_impulse_does_not_use_is_erased) {
    Damper damper = damper_new();
    set_measured(&damper.left_buffer, 0.6, 0.02);
    set_measured(&damper.right_buffer, 0.5, 0.01);
    assert_int_equal(complete(&damper, &contact_impulse), STATUS_OK);
    assert_true(isnan(damper.left_buffer.contact_time));
    assert_true(isnan(damper.right_buffer.contact_time));
    assert_true(damper.right_buffer.restitution == 0.5);
    fields_clear(damper_fields, &damper);
}

TEST(a_material_without_numbers_is_not_resolved) {
    Damper damper = damper_new();
    damper.buffer.material = strdup("sponge");
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(detail_at(&problem, "/dampers/0/buffer"),
                        "material \"sponge\" is not resolved to its numbers");
    set_measured(&damper.buffer, 0.61, 0.025);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_string_equal(damper.buffer.material, "sponge");
    fields_clear(damper_fields, &damper);
}

TEST(where_a_fault_is_told_already_nothing_more_is_said) {
    Damper damper = damper_new();
    damper.buffer.material = strdup("spunge");
    problem_clear(&problem);
    problem_add(&problem, STATUS_INVALID, "/dampers/0/buffer/material", "no such material");
    assert_int_equal(damper_complete(&damper, &contact_spring_damper, 1, "/dampers/0", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    fields_clear(damper_fields, &damper);
    // The right one could not be read.
    damper = damper_new();
    set_measured(&damper.left_buffer, 0.5, 0.02);
    problem_clear(&problem);
    problem_add(&problem, STATUS_INVALID, "/dampers/0/right_buffer", "must be an object");
    assert_int_equal(damper_complete(&damper, &contact_spring_damper, 1, "/dampers/0", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    fields_clear(damper_fields, &damper);
}

TEST(each_side_has_one_buffer) {
    Damper damper = damper_new();
    assert_int_equal(complete(&damper, &contact_impulse), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_memory_equal(detail_at(&problem, "/dampers/0/buffer"),
                        "is required: there is no buffer at the stops", 44);
    set_measured(&damper.left_buffer, 0.5, 0.02);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_memory_equal(detail_at(&problem, "/dampers/0/buffer"),
                        "is required: there is no buffer at the right stop", 49);
    set_measured(&damper.right_buffer, 0.6, 0.02);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    set_measured(&damper.buffer, 0.7, 0.02);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_memory_equal(detail_at(&problem, "/dampers/0/buffer"), "is used by neither side", 23);
    fields_clear(damper_fields, &damper);
}

TEST(faults_of_both_sides_are_told_at_once) {
    Damper damper = damper_new();
    damper.left_buffer.restitution = 0.5;
    damper.right_buffer.contact_time = 0.5;
    damper.position = 1;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_int_equal(problem.count, 3);
    assert_memory_equal(detail_at(&problem, "/dampers/0/left_buffer/contact_time"), "is required",
                        11);
    assert_memory_equal(detail_at(&problem, "/dampers/0/right_buffer/restitution"), "is required",
                        11);
    fields_clear(damper_fields, &damper);
}

TEST(equal_dampers_have_one_form) {
    // A common buffer and one of its own become two.
    Damper damper = damper_new();
    damper.buffer.material = strdup("sponge@1");
    set_measured(&damper.buffer, 0.61, 0.025);
    set_known(&damper.left_buffer, 1000, 2);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_false(buffer_is_given(&damper.buffer));
    assert_string_equal(damper.right_buffer.material, "sponge@1");
    assert_true(damper.right_buffer.contact_time == 0.025);
    assert_true(damper.left_buffer.stiffness == 1000);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    fields_clear(damper_fields, &damper);
    // Two equal ones become one.
    damper = damper_new();
    damper.left_buffer.material = strdup("sponge@1");
    damper.right_buffer.material = strdup("sponge@1");
    set_measured(&damper.left_buffer, 0.61, 0.025);
    set_measured(&damper.right_buffer, 0.61, 0.025);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_false(buffer_is_given(&damper.left_buffer));
    assert_false(buffer_is_given(&damper.right_buffer));
    assert_string_equal(damper.buffer.material, "sponge@1");
    assert_true(damper.buffer.restitution == 0.61);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_string_equal(damper.buffer.material, "sponge@1");
    fields_clear(damper_fields, &damper);
}

TEST(a_rig_is_given_where_it_is_used) {
    Damper damper = damper_new();
    set_measured(&damper.buffer, 0.6, 0.02);
    damper.identified_for = IDENTIFIED_FOR_RIG;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/dampers/0/rig"), "is required by"));
    damper.rig.impactor_mass = 0.3;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_true(damper_identified_mass(&damper, 0.1) == 0.3);
    damper.rig.base_mass = 0.3;
    assert_true(damper_identified_mass(&damper, 0.1) == 0.15);
    damper.identified_for = IDENTIFIED_FOR_SCENE;
    assert_true(damper_identified_mass(&damper, 0.1) == 0.1);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/dampers/0/rig"), "only with"));
    // Restitution alone, and stiffness with damping, hold for any masses.
    damper.identified_for = IDENTIFIED_FOR_RIG;
    assert_int_equal(complete(&damper, &contact_impulse), STATUS_OK);
    assert_int_equal(damper.identified_for, IDENTIFIED_FOR_SCENE);
    assert_true(isnan(damper.rig.impactor_mass) && isnan(damper.rig.base_mass));
    fields_clear(damper_fields, &damper);
}

TEST(a_power_law_fills_its_exponent_and_others_drop_it) {
    Damper damper = damper_new();
    set_measured(&damper.buffer, 0.6, 0.02);
    assert_int_equal(complete(&damper, &contact_flores), STATUS_OK);
    assert_true(damper.buffer.exponent == 1.5);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_true(isnan(damper.buffer.exponent));
    damper.buffer.restitution = NAN;
    assert_int_equal(complete(&damper, &contact_hertz), STATUS_OK);
    assert_true(damper.buffer.restitution == 1);
    damper.clearance = 0;
    assert_int_equal(complete(&damper, &contact_hertz), STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/dampers/0/clearance");
    fields_clear(damper_fields, &damper);
}

static void set_table(Buffer *buffer, size_t count) {
    buffer->table.at = calloc(count, sizeof *buffer->table.at);
    assert_non_null(buffer->table.at);
    buffer->table.count = count;
    for (size_t i = 0; i < count; i++)
        buffer->table.at[i] = (ContactRow){0.1 * (double)(i + 1), 0.6, 0.02};
}

TEST(equal_tables_become_one_buffer) {
    Damper damper = damper_new();
    set_table(&damper.left_buffer, 3);
    set_table(&damper.right_buffer, 3);
    assert_ptr_equal(law_of(&damper, &contact_auto), &contact_spring_damper);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_OK);
    assert_int_equal(damper.buffer.table.count, 3);
    assert_false(buffer_is_given(&damper.left_buffer) || buffer_is_given(&damper.right_buffer));
    damper.buffer.table.at[2].approach_speed = 0.2;
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/dampers/0/buffer/table/2/approach_speed"),
                        "must be above the row before, 0.2 m/s, is 0.2");
    damper.buffer.table.at[2].approach_speed = 0.3;
    // Under impulse contact times are left out, and without them a table asks for impulse.
    assert_int_equal(complete(&damper, &contact_impulse), STATUS_OK);
    assert_true(isnan(damper.buffer.table.at[1].contact_time));
    assert_ptr_equal(law_of(&damper, &contact_auto), &contact_impulse);
    assert_int_equal(complete(&damper, &contact_spring_damper), STATUS_INVALID);
    assert_int_equal(problem.count, 3);
    fields_clear(damper_fields, &damper);
}
