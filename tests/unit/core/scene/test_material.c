// What a revision of a material may say, and what it may not.
#include "core/scene/material.h"
#include "tests/support/test.h"

#include <math.h>
#include <string.h>

static Material sponge(void) {
    Material material;
    assert_int_equal(fields_default(material_fields, &material), STATUS_OK);
    material.name = "Sponge";
    material.source = "a test";
    material.restitution = 0.61;
    material.contact_time = 0.025;
    return material;
}

// Its only fault stands at `pointer` and says `words`; NULL: there is none.
static void expect(const Material *material, const char *pointer, const char *words) {
    static Problem problem;
    problem_clear(&problem);
    const Status status = material_validate(material, "", &problem);
    if (pointer == NULL) {
        if (status != STATUS_OK)
            fail_msg("%s: %s", problem.faults[0].pointer, problem.faults[0].detail);
        return;
    }
    assert_int_equal(status, STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, pointer);
    if (strstr(problem.faults[0].detail, words) == NULL)
        fail_msg("%s", problem.faults[0].detail);
}

TEST(what_is_not_known_is_left_out) {
    Material material = sponge();
    expect(&material, NULL, NULL);
    material.contact_time = (double)NAN;
    expect(&material, NULL, NULL);
    material.restitution = (double)NAN;
    expect(&material, "/restitution", "is required, or a table");
    material = sponge();
    material.name = NULL;
    expect(&material, "/name", "is required");
    material = sponge();
    material.source = " \n";
    expect(&material, "/source", "must not be empty");
}

TEST(a_deviation_belongs_to_its_value) {
    Material material = sponge();
    material.restitution_deviation = 0.01;
    material.contact_time_deviation = 0.001;
    expect(&material, NULL, NULL);
    material.contact_time = (double)NAN;
    expect(&material, "/contact_time_deviation", "needs a contact_time");
    material = sponge();
    material.restitution_deviation = -0.01;
    expect(&material, "/restitution_deviation", "at least 0");
}

TEST(a_table_stands_in_place_of_numbers) {
    const double nan = (double)NAN;
    MaterialRow rows[] = {{0.1, 0.7, 0.02, nan, nan}, {0.5, 0.6, 0.018, 0.01, 0.001}};
    Material material = sponge();
    material.table = (MaterialRows){rows, 2};
    expect(&material, "/table", "leave one of the two out");
    material.restitution = material.contact_time = nan;
    expect(&material, NULL, NULL);
    rows[1].approach_speed = 0.1;
    expect(&material, "/table/1/approach_speed", "above the row before, 0.1 m/s, is 0.1");
    rows[1].approach_speed = 0.5;
    rows[1].contact_time = nan;
    rows[1].contact_time_deviation = nan;
    expect(&material, "/table/1/contact_time", "in every row of the table or in none");
    rows[1].contact_time = 0.018;
    material.table.count = 1;
    expect(&material, "/table", "at least two rows");
}

TEST(ranges_have_their_ends_in_order) {
    Material material = sponge();
    material.least_speed = 0.15;
    expect(&material, NULL, NULL);
    material.most_speed = 0.1;
    expect(&material, "/most_speed", "at least 0.15 m/s");
    material.most_speed = 1;
    material.least_temperature = -10;
    material.most_temperature = -20;
    expect(&material, "/most_temperature", "at least -10 degC");
}

TEST(measurements_are_numbers_each_once) {
    double numbers[] = {1, 2, 1};
    Material material = sponge();
    material.measurements = (Reals){numbers, 2};
    expect(&material, NULL, NULL);
    material.measurements.count = 3;
    expect(&material, "/measurements/2", "twice");
    numbers[2] = 2.5;
    expect(&material, "/measurements/2", "must be the number of a measurement");
}

TEST(the_speeds_measured_are_stated_or_the_tables) {
    const double nan = (double)NAN;
    MaterialRow rows[] = {{0.1, 0.7, 0.02, nan, nan}, {0.5, 0.6, 0.018, nan, nan}};
    Material material = sponge();
    double least, most;
    material_speed_range(&material, &least, &most);
    assert_true(isnan(least) && isnan(most));
    material.table = (MaterialRows){rows, 2};
    material_speed_range(&material, &least, &most);
    assert_true(least == 0.1 && most == 0.5);
    material.most_speed = 0.7;
    material_speed_range(&material, &least, &most);
    assert_true(least == 0.1 && most == 0.7);
}

TEST(the_tests_pair_has_an_effective_mass_where_it_is_known) {
    Material material = sponge();
    assert_true(isnan(material_test_mass(&material)));
    material.impactor_mass = 0.5;
    assert_true(isnan(material_test_mass(&material))); // on what?
    material.base = MATERIAL_BASE_FIXED;
    assert_true(material_test_mass(&material) == 0.5);
    material.base_mass = 0.5;
    expect(&material, "/base_mass", "is the mass of a free base");
    material.base = MATERIAL_BASE_FREE;
    expect(&material, NULL, NULL);
    assert_true(material_test_mass(&material) == 0.25);
}

TEST(slugs_are_plain) {
    char longest[MATERIAL_SLUG_MAX + 2];
    memset(longest, 'a', sizeof longest);
    longest[MATERIAL_SLUG_MAX] = '\0';
    assert_true(material_slug_is_valid("soft_rubber-2"));
    assert_true(material_slug_is_valid(longest));
    longest[MATERIAL_SLUG_MAX] = 'a';
    longest[MATERIAL_SLUG_MAX + 1] = '\0';
    const char *const bad[] = {"", "Sponge", "a b", "a@1", "a/b", "\xc3\xa4", longest};
    for (size_t i = 0; i < COUNT(bad); i++)
        assert_false(material_slug_is_valid(bad[i]));
}
