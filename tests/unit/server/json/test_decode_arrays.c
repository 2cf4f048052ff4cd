// Arrays of numbers, rows of them and texts: read, written back and described.
#include <stdlib.h>
#include <string.h>

#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/json/schema.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

typedef struct Item {
    Rows matrix;
    Reals start;
    Texts names;
} Item;

static const char *const stems[] = {"velocity", NULL};

static const Field fields[] = {
    FIELD_ROWS(Item, matrix, "kg", ANY, 3, PRESENCE_OPTIONAL, "a matrix"),
    FIELD_LONE_REALS(Item, start, "m", ANY, 3, PRESENCE_OPTIONAL, "a start"),
    FIELD_TEXTS(Item, names, stems, NULL, 3, PRESENCE_OPTIONAL, FIELD_NUMBERED, "names"),
    FIELD_END};

static Problem problem;

static Status read(Item *item, const char *text) {
    problem_clear(&problem);
    return json_parse(text, strlen(text), fields, item, &problem);
}

static void assert_written(const char *text, const char *expected) {
    Item item;
    Bytes bytes = {0};
    assert_int_equal(read(&item, text), STATUS_OK);
    encode_item(&bytes, fields, &item, WRITE_SCENE);
    bytes_put(&bytes, "", 1);
    assert_string_equal(bytes.at, expected);
    bytes_clear(&bytes);
    fields_clear(fields, &item);
}

TEST(matrices_come_back_as_they_went) {
    assert_written("{\"matrix\": [[1, -2.5], [ 1e3 ], []]}",
                   "{\"matrix\": [[1,-2.5], [1000], []]}");
    assert_written("{\"matrix\": []}", "{}");
}

TEST(a_lone_number_is_a_list_of_one) {
    assert_written("{\"start\": 0.5}", "{\"start\": 0.5}");
    assert_written("{\"start\": [0.5]}", "{\"start\": 0.5}");
    assert_written("{\"start\": [1, 2]}", "{\"start\": [1,2]}");
}

TEST(what_is_no_matrix_is_told_where_it_is_none) {
    Item item;
    assert_int_equal(read(&item, "{\"matrix\": [[1, \"2\"], 3, [4, null]], \"start\": \"0\"}"),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 4);
    assert_string_equal(detail_at(&problem, "/matrix/0/1"),
                        "must be a number [kg], is a string: write 2");
    assert_string_equal(detail_at(&problem, "/matrix/1"),
                        "must be an array of numbers [kg], is a number");
    assert_string_equal(detail_at(&problem, "/matrix/2/1"), "must be a number [kg], is null");
    assert_string_equal(detail_at(&problem, "/start"),
                        "must be a number or an array of numbers [m], is a string: write 0");
    fields_clear(fields, &item);
    assert_int_equal(read(&item, "{\"matrix\": {}}"), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/matrix"),
                        "must be an array of rows of numbers [kg], is an object");
    fields_clear(fields, &item);
    assert_int_equal(read(&item, "{\"matrix\": [[], [], [], []]}"), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/matrix"), "must have at most 3 rows, has 4");
    fields_clear(fields, &item);
    assert_int_equal(read(&item, "{\"matrix\": [[], [1, 2, 3, 4]]}"), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/matrix/1"), "must have at most 3 numbers, has 4");
    fields_clear(fields, &item);
}
