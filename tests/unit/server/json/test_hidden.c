// Members that stay inside: there for the program, and for no walker but copy and clear.
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/json/schema.h"
#include "tests/support/test.h"

typedef struct Part {
    double stiffness;
    char *origin; // stays inside
    double least; // stays inside
} Part;

static const Field part_fields[] = {
    FIELD_REAL(Part, stiffness, "N/m", ABOVE(0), OPTIONAL, "of the spring"),
    FIELD_TEXT(Part, origin, 4, PRESENCE_OPTIONAL, FIELD_HIDDEN, NULL),
    FIELD_HIDDEN_REAL(Part, least),
    FIELD_END,
};

typedef struct Whole {
    Part part;
} Whole;

static const Field whole_fields[] = {
    FIELD_ITEM(Whole, part, part_fields, NULL, PRESENCE_OPTIONAL, "a part"),
    FIELD_END,
};

static Problem problem;

static Part make(double stiffness) {
    Part part;
    memset(&part, 0xA5, sizeof part);
    assert_int_equal(fields_default(part_fields, &part), STATUS_OK);
    assert_true(isnan(part.least));
    assert_null(part.origin);
    part.stiffness = stiffness;
    part.origin = strdup("longer than its row would allow");
    part.least = 0.15;
    return part;
}

static void count_bytes(void *context, const void *bytes, size_t size) {
    (void)bytes;
    *(size_t *)context += size;
}

TEST(they_are_copied_and_cleared_with_the_struct) {
    Part part = make(3), copy;
    assert_int_equal(fields_copy(part_fields, &part, &copy), STATUS_OK);
    assert_true(copy.least == 0.15);
    assert_string_equal(copy.origin, part.origin);
    assert_ptr_not_equal(copy.origin, part.origin);
    fields_clear(part_fields, &part);
    assert_null(part.origin);
    assert_true(isnan(part.least));
    fields_clear(part_fields, &copy);
}

TEST(they_are_no_part_of_what_is_written_or_stands_for_it) {
    Part with = make(3), without;
    size_t bytes_with = 0, bytes_without = 0;
    assert_int_equal(fields_default(part_fields, &without), STATUS_OK);
    without.stiffness = 3;
    canonical_write(part_fields, &with, count_bytes, &bytes_with);
    canonical_write(part_fields, &without, count_bytes, &bytes_without);
    assert_int_equal(bytes_with, bytes_without);
    const EncodeStyle styles[] = {WRITE_SCENE, WRITE_REPORT};
    for (size_t i = 0; i < COUNT(styles); i++) {
        Bytes bytes = {0};
        encode_item(&bytes, part_fields, &with, styles[i]);
        char *text = bytes_take(&bytes, NULL);
        assert_string_equal(text, "{\"stiffness\": 3}");
        free(text);
    }
    fields_clear(part_fields, &with);
}

TEST(an_item_with_nothing_else_is_absent) {
    Whole whole = {make((double)NAN)};
    assert_true(field_is_absent(&whole_fields[0], &whole));
    fields_clear(whole_fields, &whole);
}

TEST(they_are_judged_by_nobody) {
    Part part = make(3);
    part.least = (double)INFINITY;
    problem_clear(&problem);
    assert_int_equal(fields_validate(part_fields, &part, "", &problem), STATUS_OK);
    fields_clear(part_fields, &part);
}

TEST(they_can_be_neither_read_nor_guessed) {
    static const char text[] = "{\"least\": 1, \"origin\": \"x\", \"lest\": 2}";
    Part part;
    problem_clear(&problem);
    assert_int_equal(json_parse(text, strlen(text), part_fields, &part, &problem), STATUS_INVALID);
    assert_int_equal(problem.count, 3);
    for (size_t i = 0; i < problem.count; i++) {
        assert_string_equal(problem.faults[i].detail, "unknown key");
        assert_string_equal(problem.faults[i].did_you_mean, "");
    }
    assert_null(part.origin);
    assert_true(isnan(part.least));
    fields_clear(part_fields, &part);
}
