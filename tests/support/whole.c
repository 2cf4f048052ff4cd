#include "tests/support/whole.h"

// clang-format off
static const Field common_fields[] = {
    FIELD_REAL(Common, offset, "m", WITHIN(-1, 1), 0.25, "where it stands"),
    FIELD_END
};

static const Field part_fields[] = {
    FIELD_TEXT(Part, material, 12, PRESENCE_OPTIONAL, 0, "where it comes from"),
    FIELD_REAL(Part, stiffness, "N/m", ABOVE(0), OPTIONAL, "of the spring"),
    FIELD_REAL(Part, damping, "N s/m", AT_MIN(0), 0.5, "of the damper"),
    FIELD_END
};

static const Field round_fields[] = {
    FIELD_BASE(Round, common, common_fields),
    FIELD_REAL(Round, radius, "m", WITHIN(0, 2), REQUIRED, "of the circle"),
    FIELD_END
};

static const Field square_fields[] = {
    FIELD_BASE(Square, common, common_fields),
    FIELD_REALS(Square, sides, "m", AT_MIN(0), 4, PRESENCE_OPTIONAL, "of the square"),
    FIELD_END
};

const Kind shape_round = {"round", "a circle", round_fields, sizeof(Round)};
const Kind shape_square = {"square", "a square", square_fields, sizeof(Square)};

static const Kind *shape_at(size_t index) {
    static const Kind *const all[] = {&shape_round, &shape_square};
    return index < COUNT(all) ? all[index] : NULL;
}
static const KindTable shapes = {"shape", shape_at, false};

static const char *const rules[] = {"zero_penetration", "zero_force", NULL};
static const char *const channels[] = {"displacement", "velocity", "acceleration", NULL};
static const char *const usual[] = {"velocity", "displacement", NULL};
static const char *const one[] = {"one", NULL};

static const Field extra_fields[] = {
    FIELD_TEXTS(Extra, names, NULL, one, 0, PRESENCE_DEFAULT, 0, "names"),
    FIELD_CHOICE(Extra, rule, rules, 1, "when it ends"),
    FIELD_END
};

const Field whole_fields[] = {
    FIELD_BASE(Whole, common, common_fields),
    FIELD_REAL(Whole, mass, "kg", ABOVE(0), REQUIRED, "mass of it"),
    FIELD_REAL(Whole, slope, NULL, ANY, OPTIONAL, "any number"),
    FIELD_COUNT(Whole, steps, "steps", WITHIN(1, 1000000), 7, "how many"),
    FIELD_COUNT(Whole, storey, NULL, AT_MIN(1), OPTIONAL, "where"),
    FIELD_FLAG(Whole, is_open, 1, "a fact"),
    FIELD_TEXT(Whole, title, 20, PRESENCE_OPTIONAL, FIELD_NOTE, "for people"),
    FIELD_CHOICE(Whole, rule, rules, 0, "when it ends"),
    FIELD_REALS(Whole, samples, "m/s^2", WITHIN(-10, 10), 50, PRESENCE_OPTIONAL, "measured"),
    FIELD_TEXTS(Whole, channels, channels, usual, 3, PRESENCE_DEFAULT, 0, "asked for"),
    FIELD_TEXTS(Whole, labels, NULL, NULL, 4, PRESENCE_OPTIONAL, FIELD_NOTE | FIELD_PAIRS, "for people"),
    FIELD_ITEM(Whole, left, part_fields, "material", PRESENCE_OPTIONAL, "one side"),
    FIELD_ITEM(Whole, right, part_fields, "material", PRESENCE_OPTIONAL, "the other side"),
    FIELD_ITEM_OR_NULL(Whole, extra, extra_fields, PRESENCE_DEFAULT, "null: none"),
    FIELD_LIST(Whole, parts, part_fields, 3, PRESENCE_DEFAULT, "more of them"),
    FIELD_VARIANT(Whole, shape, &shapes, PRESENCE_DEFAULT, "its shape"),
    FIELD_VARIANT(Whole, spare, &shapes, PRESENCE_OPTIONAL, "another"),
    FIELD_END
};
// clang-format on
