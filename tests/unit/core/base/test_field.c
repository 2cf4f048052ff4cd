// The walkers of Field rows on structs that have every kind of row.
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/field.h"
#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "tests/support/test.h"

typedef struct Part {
    char *material;
    double stiffness, damping;
} Part;

static const Field part_fields[] = {
    FIELD_TEXT(Part, material, 8, PRESENCE_OPTIONAL, 0, "where it comes from"),
    FIELD_REAL(Part, stiffness, "N/m", ABOVE(0), REQUIRED, "contact stiffness k_b"),
    FIELD_REAL(Part, damping, "N s/m", AT_MIN(0), OPTIONAL, "contact damping c_b"), FIELD_END};

typedef struct Common {
    double offset;
} Common;

static const Field common_fields[] = {
    FIELD_REAL(Common, offset, "m", WITHIN(-1, 1), 0.25, "where it stands"), FIELD_END};

// Two shapes under the tag "shape", both beginning with the common part.
typedef struct Round {
    Variant variant;
    Common common;
    double radius;
} Round;

typedef struct Square {
    Variant variant;
    Common common;
    Reals sides;
} Square;

static const Field round_fields[] = {FIELD_BASE(Round, common, common_fields),
                                     FIELD_REAL(Round, radius, "m", ABOVE(0), 1, "of the circle"),
                                     FIELD_END};
static const Field square_fields[] = {
    FIELD_BASE(Square, common, common_fields),
    FIELD_REALS(Square, sides, "m", AT_MIN(0), 4, PRESENCE_REQUIRED, "of the square"), FIELD_END};

static const Kind shape_round = {"round", "a circle", round_fields, sizeof(Round)};
static const Kind shape_square = {"square", "a square", square_fields, sizeof(Square)};

static const Kind *shape_at(size_t index) {
    static const Kind *const all[] = {&shape_round, &shape_square};
    return index < COUNT(all) ? all[index] : NULL;
}
static const KindTable shapes = {"shape", shape_at, false};

typedef struct Parts {
    Part *at;
    size_t count;
} Parts;

typedef struct Whole {
    double mass;
    uint64_t storey;
    bool is_open;
    char *title;
    int rule;
    Reals samples;
    Texts channels;
    Part left, right;
    Parts parts;
    Variant *shape;
    Variant *spare;
    Common common;
} Whole;

static const char *const rules[] = {"zero_penetration", "zero_force", NULL};
static const char *const allowed[] = {"displacement", "velocity", "acceleration", NULL};
static const char *const wanted[] = {"velocity", "displacement", NULL};

static const Field whole_fields[] = {
    FIELD_REAL(Whole, mass, "kg", ABOVE(0), REQUIRED, "mass of it"),
    FIELD_COUNT(Whole, storey, NULL, AT_MIN(1), 3, "where"),
    FIELD_FLAG(Whole, is_open, 1, "a fact"),
    FIELD_TEXT(Whole, title, 10, PRESENCE_OPTIONAL, FIELD_NOTE, "for people"),
    FIELD_CHOICE(Whole, rule, rules, 1, "when it ends"),
    FIELD_REALS(Whole, samples, "m/s^2", WITHIN(-10, 10), 5, PRESENCE_OPTIONAL, "measured"),
    FIELD_TEXTS(Whole, channels, allowed, wanted, 3, PRESENCE_DEFAULT, 0, "asked for"),
    FIELD_ITEM(Whole, left, part_fields, "material", PRESENCE_OPTIONAL, "one side"),
    FIELD_ITEM_OR_NULL(Whole, right, part_fields, PRESENCE_OPTIONAL, "the other side"),
    FIELD_LIST(Whole, parts, part_fields, 2, PRESENCE_OPTIONAL, "more of them"),
    FIELD_VARIANT(Whole, shape, &shapes, PRESENCE_DEFAULT, "its shape"),
    FIELD_VARIANT(Whole, spare, &shapes, PRESENCE_OPTIONAL, "another"),
    FIELD_BASE(Whole, common, common_fields),
    FIELD_END};

static Problem problem;

static const char *detail_at(const char *pointer) {
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        if (strcmp(problem.faults[i].pointer, pointer) == 0)
            return problem.faults[i].detail;
    return "(no fault there)";
}

static const Fault *fault_at(const char *pointer) {
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        if (strcmp(problem.faults[i].pointer, pointer) == 0)
            return &problem.faults[i];
    fail_msg("no fault at %s", pointer);
    return NULL;
}

// A sound whole with something in every member.
static void make_whole(Whole *whole) {
    memset(whole, 0xA5, sizeof *whole);
    assert_int_equal(fields_default(whole_fields, whole), STATUS_OK);
    whole->mass = 2;
    whole->title = strdup("a title");
    whole->samples.at = calloc(3, sizeof(double));
    whole->samples.count = 3;
    whole->samples.at[1] = -1.5;
    whole->left.material = strdup("sponge");
    whole->left.stiffness = 1650;
    whole->parts.at = calloc(2, sizeof *whole->parts.at);
    whole->parts.count = 2;
    for (size_t i = 0; i < 2; i++) {
        assert_int_equal(fields_default(part_fields, &whole->parts.at[i]), STATUS_OK);
        whole->parts.at[i].stiffness = 1 + (double)i;
    }
    whole->parts.at[1].material = strdup("rubber");
    whole->spare = variant_new(&shape_square);
    Square *square = (Square *)whole->spare;
    square->sides.at = calloc(2, sizeof(double));
    square->sides.count = 2;
}

typedef struct Text {
    unsigned char at[2048];
    size_t length;
    size_t pieces;
} Text;

static void take(void *context, const void *bytes, size_t size) {
    Text *text = context;
    assert_true(size <= sizeof text->at - text->length);
    memcpy(text->at + text->length, bytes, size);
    text->length += size;
    text->pieces++;
}

static Text canonical(const Whole *whole) {
    Text text = {.length = 0};
    canonical_write(whole_fields, whole, take, &text);
    return text;
}

static bool same(const Text *a, const Text *b) {
    return a->length == b->length && memcmp(a->at, b->at, a->length) == 0;
}

TEST(defaults_are_those_of_the_rows) {
    Whole whole;
    memset(&whole, 0xA5, sizeof whole);
    assert_int_equal(fields_default(whole_fields, &whole), STATUS_OK);
    assert_true(isnan(whole.mass));
    assert_int_equal(whole.storey, 3);
    assert_true(whole.is_open);
    assert_null(whole.title);
    assert_int_equal(whole.rule, 1);
    assert_int_equal(whole.samples.count, 0);
    assert_int_equal(whole.channels.count, 2);
    assert_string_equal(whole.channels.at[0], "velocity");
    assert_string_equal(whole.channels.at[1], "displacement");
    assert_null(whole.left.material);
    assert_true(isnan(whole.right.stiffness));
    assert_int_equal(whole.parts.count, 0);
    assert_ptr_equal(whole.shape->kind, &shape_round);
    assert_true(((const Round *)whole.shape)->radius == 1);
    assert_true(((const Round *)whole.shape)->common.offset == 0.25);
    assert_null(whole.spare);
    assert_true(whole.common.offset == 0.25);
    fields_clear(whole_fields, &whole);
    assert_null(whole.shape);
    assert_int_equal(whole.storey, COUNT_ABSENT);
    assert_int_equal(whole.rule, CHOICE_ABSENT);
    fields_clear(whole_fields, &whole);
}

TEST(an_all_zero_struct_can_be_cleared) {
    Whole whole;
    memset(&whole, 0, sizeof whole);
    fields_clear(whole_fields, &whole);
    assert_true(isnan(whole.mass));
    fields_clear(whole_fields, NULL);
}

TEST(a_sound_struct_has_no_fault) {
    Whole whole;
    make_whole(&whole);
    problem_clear(&problem);
    assert_int_equal(fields_validate(whole_fields, &whole, "", &problem), STATUS_OK);
    assert_int_equal(problem.count, 0);
    assert_int_equal(problem.status, STATUS_OK);
    fields_clear(whole_fields, &whole);
}

TEST(all_faults_are_told_at_once_each_at_its_place) {
    Whole whole;
    make_whole(&whole);
    whole.mass = -1;
    whole.storey = 0;
    whole.rule = 2;
    free(whole.title);
    whole.title = strdup("eleven long");
    whole.samples.at[2] = 10.5;
    whole.samples.at[0] = (double)INFINITY;
    free(whole.channels.at[1]);
    whole.channels.at[1] = strdup("acceleratoin");
    whole.left.stiffness = (double)NAN;
    whole.parts.at[0].damping = -0.5;
    whole.parts.at[1].stiffness = 0;
    ((Round *)whole.shape)->radius = 0;
    ((Square *)whole.spare)->sides.at[1] = -1;
    whole.common.offset = 1.5;
    problem_clear(&problem);
    assert_int_equal(fields_validate(whole_fields, &whole, "/in", &problem), STATUS_INVALID);
    assert_int_equal(problem.status, STATUS_INVALID);
    assert_int_equal(problem.count, 13);
    assert_string_equal(detail_at("/in/mass"), "must be above 0 kg, is -1");
    assert_string_equal(fault_at("/in/mass")->value, "-1");
    assert_string_equal(fault_at("/in/mass")->unit, "kg");
    assert_string_equal(detail_at("/in/storey"), "must be at least 1, is 0");
    assert_string_equal(detail_at("/in/rule"), "is none of the choices");
    assert_string_equal(detail_at("/in/title"), "must have at most 10, has 11 bytes");
    assert_string_equal(detail_at("/in/samples/2"), "must be within [-10, 10] m/s^2, is 10.5");
    assert_string_equal(detail_at("/in/samples/0"), "must be finite");
    assert_string_equal(fault_at("/in/samples/0")->value, "");
    assert_string_equal(detail_at("/in/channels/1"),
                        "must be one of displacement, velocity, acceleration");
    assert_string_equal(fault_at("/in/channels/1")->value, "\"acceleratoin\"");
    assert_string_equal(fault_at("/in/channels/1")->did_you_mean, "acceleration");
    assert_string_equal(detail_at("/in/left/stiffness"),
                        "is required: contact stiffness k_b [N/m]");
    assert_string_equal(detail_at("/in/parts/0/damping"), "must be at least 0 N s/m, is -0.5");
    assert_string_equal(detail_at("/in/parts/1/stiffness"), "must be above 0 N/m, is 0");
    assert_string_equal(detail_at("/in/shape/radius"), "must be above 0 m, is 0");
    assert_string_equal(detail_at("/in/spare/sides/1"), "must be at least 0 m, is -1");
    assert_string_equal(detail_at("/in/offset"), "must be within [-1, 1] m, is 1.5");
    assert_string_equal(problem.detail, "/in/mass: must be above 0 kg, is -1");
    fields_clear(whole_fields, &whole);
}

TEST(what_is_required_is_told_by_its_meaning_and_unit) {
    Whole whole;
    assert_int_equal(fields_default(whole_fields, &whole), STATUS_OK);
    whole.spare = variant_new(&shape_square);
    problem_clear(&problem);
    assert_int_equal(fields_validate(whole_fields, &whole, "", &problem), STATUS_INVALID);
    // Neither of the absent optional items says that its stiffness is missing.
    assert_int_equal(problem.count, 2);
    assert_string_equal(detail_at("/mass"), "is required: mass of it [kg]");
    assert_string_equal(detail_at("/spare/sides"),
                        "is required, with at least one: of the square [m]");
    fields_clear(whole_fields, &whole);
}

TEST(a_default_made_absent_is_a_fault_where_a_number_is_needed) {
    Whole whole;
    make_whole(&whole);
    whole.common.offset = (double)NAN;
    whole.storey = COUNT_ABSENT;
    whole.rule = CHOICE_ABSENT;
    variant_free(whole.shape);
    whole.shape = NULL;
    problem_clear(&problem);
    fields_validate(whole_fields, &whole, "", &problem);
    assert_int_equal(problem.count, 3);
    assert_string_equal(detail_at("/offset"), "is required: where it stands [m]");
    assert_string_equal(detail_at("/storey"), "is required: where");
    assert_string_equal(detail_at("/shape"), "is required: its shape");
    fields_clear(whole_fields, &whole);
}

TEST(too_long_lists_are_one_fault_each) {
    Whole whole;
    make_whole(&whole);
    free(whole.samples.at);
    whole.samples = (Reals){calloc(6, sizeof(double)), 6};
    whole.samples.at[5] = 99;
    Part *more = realloc(whole.parts.at, 3 * sizeof *more);
    assert_non_null(more);
    whole.parts.at = more;
    whole.parts.count = 3;
    fields_default(part_fields, &more[2]);
    problem_clear(&problem);
    assert_int_equal(fields_validate(whole_fields, &whole, "", &problem), STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    assert_string_equal(detail_at("/samples"), "must have at most 5, has 6 numbers");
    assert_string_equal(detail_at("/parts"), "must have at most 2, has 3 elements");
    fields_clear(whole_fields, &whole);
}

TEST(a_copy_is_equal_and_shares_nothing) {
    Whole whole, copy;
    make_whole(&whole);
    memset(&copy, 0x5A, sizeof copy);
    assert_int_equal(fields_copy(whole_fields, &whole, &copy), STATUS_OK);
    const Text before = canonical(&whole), after = canonical(&copy);
    assert_true(same(&before, &after));
    assert_string_equal(copy.title, "a title");
    assert_ptr_not_equal(copy.title, whole.title);
    assert_ptr_not_equal(copy.parts.at[1].material, whole.parts.at[1].material);
    assert_ptr_equal(copy.spare->kind, &shape_square);
    fields_clear(whole_fields, &whole);
    // The copy outlives its source.
    assert_string_equal(copy.parts.at[1].material, "rubber");
    assert_true(copy.samples.at[1] == -1.5);
    const Text alone = canonical(&copy);
    assert_true(same(&before, &alone));
    fields_clear(whole_fields, &copy);
}

TEST(the_canonical_form_changes_with_each_member_but_not_with_notes) {
    Whole whole;
    make_whole(&whole);
    const Text first = canonical(&whole);
    free(whole.title);
    whole.title = NULL;
    Text now = canonical(&whole);
    assert_true(same(&first, &now));
    whole.samples.at[0] = -0.0;
    now = canonical(&whole);
    assert_true(same(&first, &now));
#define CHANGE(member, value)                                                                      \
    do {                                                                                           \
        const Whole kept = whole;                                                                  \
        whole.member = value;                                                                      \
        now = canonical(&whole);                                                                   \
        assert_false(same(&first, &now));                                                          \
        whole = kept;                                                                              \
    } while (0)
    CHANGE(mass, 3);
    CHANGE(storey, 4);
    CHANGE(is_open, false);
    CHANGE(rule, 0);
    CHANGE(rule, CHOICE_ABSENT);
    CHANGE(samples.count, 2);
    CHANGE(channels.count, 1);
    CHANGE(left.stiffness, 2);
    CHANGE(right.damping, 2);
    CHANGE(parts.count, 1);
    CHANGE(spare, NULL);
    CHANGE(common.offset, 0);
    ((Round *)whole.shape)->common.offset = 0;
    now = canonical(&whole);
    assert_false(same(&first, &now));
#undef CHANGE
    fields_clear(whole_fields, &whole);
}

TEST(the_canonical_bytes_are_these) {
    Part part = {.material = (char[]){"ab"}, .stiffness = 2, .damping = (double)NAN};
    Text text = {.length = 0};
    canonical_write(part_fields, &part, take, &text);
    const char expected[] = "material\0\2\0\0\0\0\0\0\0ab"
                            "stiffness\0\0\0\0\0\0\0\0\x40";
    assert_int_equal(text.length, sizeof expected - 1);
    assert_memory_equal(text.at, expected, text.length);
}

TEST(a_choice_is_written_by_its_name) {
    Whole whole;
    make_whole(&whole);
    const Text text = canonical(&whole);
    const char expected[] = "rule\0\12\0\0\0\0\0\0\0zero_force";
    bool is_found = false;
    for (size_t i = 0; i + sizeof expected - 1 <= text.length; i++)
        is_found = is_found || memcmp(text.at + i, expected, sizeof expected - 1) == 0;
    assert_true(is_found);
    fields_clear(whole_fields, &whole);
}

static size_t bytes_taken;
static void count_bytes(void *context, const void *bytes, size_t size) {
    (void)context;
    (void)bytes;
    bytes_taken += size;
}

TEST(long_values_pass_through_the_canonical_writer) {
    Whole whole;
    make_whole(&whole);
    const size_t before = canonical(&whole).length;
    free(whole.left.material);
    whole.left.material = malloc(10001);
    memset(whole.left.material, 'x', 10000);
    whole.left.material[10000] = '\0';
    bytes_taken = 0;
    canonical_write(whole_fields, &whole, count_bytes, NULL);
    assert_int_equal(bytes_taken, before + 10000 - strlen("sponge"));
    fields_clear(whole_fields, &whole);
}

TEST(an_optional_item_is_absent_when_its_members_are) {
    Whole whole;
    make_whole(&whole);
    const Field *left = fields_find(whole_fields, "left", NULL);
    const Field *right = fields_find(whole_fields, "right", NULL);
    assert_false(field_is_absent(left, &whole));
    assert_true(field_is_absent(right, &whole));
    whole.right.damping = 0;
    assert_false(field_is_absent(right, &whole));
    fields_clear(whole_fields, &whole);
}

TEST(an_empty_list_is_not_the_same_as_a_default) {
    Whole whole;
    make_whole(&whole);
    const Field *field = fields_find(whole_fields, "channels", NULL);
    for (size_t i = 0; i < whole.channels.count; i++)
        free(whole.channels.at[i]);
    whole.channels.count = 0;
    assert_false(field_is_absent(field, &whole));
    problem_clear(&problem);
    assert_int_equal(fields_validate(whole_fields, &whole, "", &problem), STATUS_OK);
    whole.samples.count = 0;
    assert_true(field_is_absent(fields_find(whole_fields, "samples", NULL), &whole));
    fields_clear(whole_fields, &whole);
}

TEST(rows_are_found_also_inside_a_base) {
    size_t offset = 0;
    const Field *found = fields_find(whole_fields, "offset", &offset);
    assert_ptr_equal(found, &common_fields[0]);
    assert_int_equal(offset, offsetof(Whole, common));
    assert_null(fields_find(whole_fields, "common", NULL));
    assert_null(fields_find(whole_fields, "nothing", &offset));
    assert_ptr_equal(kind_find(&shapes, "square"), &shape_square);
    assert_null(kind_find(&shapes, "oval"));
}

TEST(a_slip_of_the_pen_finds_the_name_that_was_meant) {
    assert_string_equal(spelling_nearest_field(whole_fields, "mas"), "mass");
    assert_string_equal(spelling_nearest_field(whole_fields, "Storey"), "storey");
    assert_string_equal(spelling_nearest_field(whole_fields, "sotrey"), "storey");
    assert_string_equal(spelling_nearest_field(whole_fields, "ofset"), "offset");
    assert_null(spelling_nearest_field(whole_fields, "common_"));
    assert_null(spelling_nearest_field(whole_fields, "gravity"));
    assert_null(spelling_nearest_field(whole_fields, ""));
    char *monster = malloc(1000001);
    memset(monster, 'm', 1000000);
    monster[1000000] = '\0';
    assert_null(spelling_nearest_field(whole_fields, monster));
    free(monster);
    assert_string_equal(spelling_nearest(rules, "zero-force"), "zero_force");
    assert_null(spelling_nearest(rules, "none"));
}

TEST(pointers_are_escaped_and_cut) {
    char pointer[256];
    json_pointer_join(pointer, sizeof pointer, "/a", "b/c~d");
    assert_string_equal(pointer, "/a/b~1c~0d");
    json_pointer_index(pointer, sizeof pointer, "", 12);
    assert_string_equal(pointer, "/12");
    char name[1000];
    memset(name, '/', sizeof name);
    name[sizeof name - 1] = '\0';
    json_pointer_join(pointer, sizeof pointer, "/a", name);
    assert_int_equal(strlen(pointer), sizeof pointer - 1);
    char small[6];
    json_pointer_join(small, sizeof small, "/a", "long");
    assert_int_equal(strlen(small), sizeof small - 1);
    assert_string_equal(small, "/a...");
}
