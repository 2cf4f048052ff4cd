// Rows of numbers, lone numbers and numbered names, under every walker of Field rows.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/field.h"
#include "core/base/json_pointer.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

typedef struct Matrix {
    Rows entries;
    Reals start;
    Texts names;
} Matrix;

static const char *const stems[] = {"displacement", "contact_force", NULL};

static const Field fields[] = {
    FIELD_ROWS(Matrix, entries, "N/m", WITHIN(-9, 9), 3, PRESENCE_REQUIRED, "all entries"),
    FIELD_LONE_REALS(Matrix, start, "m", ANY, 3, PRESENCE_OPTIONAL, "where it begins"),
    FIELD_TEXTS(Matrix, names, stems, NULL, 9, PRESENCE_DEFAULT, FIELD_NUMBERED, "what is wanted"),
    FIELD_END};

static Problem problem;

static Matrix matrix_of(size_t count, const Reals *rows) {
    Matrix matrix;
    assert_int_equal(fields_default(fields, &matrix), STATUS_OK);
    matrix.entries = (Rows){calloc(count, sizeof *rows), count};
    for (size_t i = 0; i < count; i++)
        matrix.entries.at[i] = reals_of(rows[i].count, rows[i].at);
    return matrix;
}

static Status check(const Matrix *matrix) {
    problem_clear(&problem);
    return fields_validate(fields, matrix, "", &problem);
}

TEST(rows_are_copied_deeply_and_cleared) {
    double first[] = {1, 2}, second[] = {3};
    Matrix copy, matrix = matrix_of(3, (Reals[]){{first, 2}, {first, 0}, {second, 1}});
    assert_int_equal(fields_copy(fields, &matrix, &copy), STATUS_OK);
    matrix.entries.at[0].at[1] = 5;
    assert_true(copy.entries.count == 3 && copy.entries.at[0].at[1] == 2);
    assert_true(copy.entries.at[1].count == 0 && copy.entries.at[2].at[0] == 3);
    fields_clear(fields, &matrix);
    assert_true(matrix.entries.at == NULL && matrix.entries.count == 0);
    assert_true(field_is_absent(&fields[0], &matrix) && !field_is_absent(&fields[0], &copy));
    fields_clear(fields, &copy);
}

TEST(every_number_of_every_row_is_judged) {
    double first[] = {1, 10}, second[] = {(double)NAN}, third[] = {1, 2, 3, 4};
    Matrix matrix = matrix_of(3, (Reals[]){{first, 2}, {second, 1}, {third, 4}});
    assert_int_equal(check(&matrix), STATUS_INVALID);
    assert_int_equal(problem.count, 3);
    assert_string_equal(detail_at(&problem, "/entries/0/1"), "must be within [-9, 9] N/m, is 10");
    assert_string_equal(detail_at(&problem, "/entries/1/0"), "must be finite");
    assert_string_equal(detail_at(&problem, "/entries/2"), "must have at most 3, has 4 numbers");
    fields_clear(fields, &matrix);
    matrix = matrix_of(4, (Reals[]){{first, 1}, {first, 1}, {first, 1}, {first, 1}});
    assert_int_equal(check(&matrix), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/entries"), "must have at most 3, has 4 rows");
    fields_clear(fields, &matrix);
    assert_int_equal(check(&matrix), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/entries"),
                        "is required, with at least one: all entries [N/m]");
}

typedef struct Gathered {
    unsigned char at[512];
    size_t length;
} Gathered;

static void gather(void *context, const void *bytes, size_t size) {
    Gathered *all = context;
    assert_true(all->length + size <= sizeof all->at);
    memcpy(all->at + all->length, bytes, size);
    all->length += size;
}

TEST(the_canonical_form_tells_rows_apart) {
    double numbers[] = {1, 2, 3};
    const Reals shapes[3][3] = {{{numbers, 2}, {numbers + 2, 1}},
                                {{numbers, 1}, {numbers + 1, 2}},
                                {{numbers, 3}, {numbers, 0}}};
    Gathered forms[3] = {0};
    for (size_t i = 0; i < 3; i++) {
        Matrix matrix = matrix_of(2, shapes[i]);
        canonical_write(fields, &matrix, gather, &forms[i]);
        fields_clear(fields, &matrix);
        for (size_t j = 0; j < i; j++)
            assert_true(forms[i].length != forms[j].length ||
                        memcmp(forms[i].at, forms[j].at, forms[i].length) != 0);
    }
}

TEST(a_name_may_carry_a_number) {
    size_t length;
    assert_true(field_name_number("displacement_12", &length) == 12 && length == 12);
    assert_true(field_name_number("contact_force", &length) == 0 && length == 13);
    assert_true(field_name_number("x_0", &length) == 0 && length == 3);
    assert_true(field_name_number("x_01", &length) == 0 && length == 4);
    assert_true(field_name_number("x_1y", &length) == 0 && length == 4);
    assert_true(field_name_number("x_", &length) == 0 && length == 2);
    assert_true(field_name_number("x_99999999999999999999", &length) == 0);
    assert_true(field_name_number("", &length) == 0 && length == 0);
}

TEST(pointers_are_cut_at_their_room_and_escaped) {
    char target[16], name[2000];
    json_pointer_join(target, sizeof target, "/a", "b/c~d");
    assert_string_equal(target, "/a/b~1c~0d");
    json_pointer_index(target, sizeof target, "/a", 0);
    assert_string_equal(target, "/a/0");
    json_pointer_index(target, sizeof target, "", 1234567890);
    assert_string_equal(target, "/1234567890");
    memset(name, '~', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    json_pointer_join(target, sizeof target, name, name);
    assert_int_equal(strlen(target), sizeof target - 1);
    json_pointer_join(target, sizeof target, "/x", name);
    assert_string_equal(target, "/x/~0~0~0~0~...");
}
