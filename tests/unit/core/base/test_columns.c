#include <string.h>

#include "core/base/columns.h"
#include "tests/support/test.h"

TEST(columns_lie_one_behind_the_other) {
    Columns columns;
    assert_int_equal(columns_allocate(&columns, 3, 5, 0, NULL), STATUS_OK);
    columns_name(&columns, 1, "velocity", "m/s");
    for (size_t i = 0; i < 15; i++)
        columns.block[i] = (double)i;
    assert_true(columns.at[2].values[4] == 14);
    const Column *found = columns_find(&columns, "velocity");
    assert_ptr_equal(found, &columns.at[1]);
    assert_string_equal(found->unit, "m/s");
    assert_null(columns_find(&columns, "force"));
    columns_clear(&columns);
    assert_int_equal(columns.count, 0);
    columns_clear(&columns);
    columns_clear(NULL);
}

TEST(no_columns_or_no_rows_are_fine) {
    Columns columns;
    assert_int_equal(columns_allocate(&columns, 0, SIZE_MAX, 0, NULL), STATUS_OK);
    columns_clear(&columns);
    assert_int_equal(columns_allocate(&columns, 2, 0, 0, NULL), STATUS_OK);
    columns_clear(&columns);
}

TEST(too_many_bytes_are_a_limit_not_an_overflow) {
    Columns columns;
    Problem problem;
    problem_clear(&problem);
    assert_int_equal(columns_allocate(&columns, 2, 8, 127, &problem), STATUS_LIMIT);
    assert_int_equal(problem.status, STATUS_LIMIT);
    assert_null(columns.block);
    assert_int_equal(columns_allocate(&columns, 2, 8, 128, NULL), STATUS_OK);
    columns_clear(&columns);
    assert_int_equal(columns_allocate(&columns, 3, SIZE_MAX / 8, 0, NULL), STATUS_LIMIT);
    assert_null(columns.at);
}

TEST(long_names_are_cut) {
    Columns columns;
    char name[200];
    memset(name, 'n', sizeof name);
    name[sizeof name - 1] = '\0';
    assert_int_equal(columns_allocate(&columns, 1, 1, 0, NULL), STATUS_OK);
    columns_name(&columns, 0, name, NULL);
    assert_int_equal(strlen(columns.at[0].name), sizeof columns.at[0].name - 1);
    assert_string_equal(columns.at[0].unit, "");
    columns_clear(&columns);
}
