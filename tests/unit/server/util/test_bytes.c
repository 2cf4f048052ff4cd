// The growing buffer: its limit, its failed state, and the JSON pieces built in it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <math.h>

#include "core/base/status.h"
#include "server/util/bytes.h"
#include "tests/support/test.h"

TEST(what_is_put_stands_there_with_a_nul) {
    Bytes bytes = {0};
    char expected[40001] = "";
    for (int i = 0; i < 10000; i++) {
        bytes_format(&bytes, "%04d", i);
        snprintf(expected + 4 * i, sizeof expected - 4 * (size_t)i, "%04d", i);
    }
    assert_int_equal(bytes.count, 40000);
    assert_string_equal(bytes.at, expected);
    bytes_clear(&bytes);
    assert_null(bytes.at);
    bytes_put(&bytes, "", 0);
    assert_string_equal(bytes.at, "");
    bytes_clear(&bytes);
}

TEST(long_formats_are_whole) {
    char text[3000];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    Bytes bytes = {0};
    bytes_format(&bytes, "<%s>", text);
    assert_int_equal(bytes.count, sizeof text + 1);
    assert_int_equal(bytes.at[bytes.count - 1], '>');
    bytes_clear(&bytes);
}

TEST(the_limit_is_exact_and_failure_stays) {
    Bytes bytes = {.most = 1000};
    for (int i = 0; i < 1000; i++)
        bytes_text(&bytes, "x");
    assert_false(bytes.is_failed);
    assert_int_equal(bytes.count, 1000);
    assert_true(bytes.room <= 1001);
    bytes_text(&bytes, "x");
    assert_true(bytes.is_failed);
    assert_null(bytes.at);
    assert_int_equal(bytes.count, 0);
    bytes_text(&bytes, "x");
    bytes_format(&bytes, "%d", 1);
    bytes_real(&bytes, 1);
    bytes_json_string(&bytes, "x");
    assert_false(bytes_reserve(&bytes, 0));
    assert_null(bytes.at);
    size_t size = 7;
    assert_null(bytes_take(&bytes, &size));
    assert_int_equal(size, 0);
    bytes_clear(&bytes);
    bytes_text(&bytes, "again");
    assert_string_equal(bytes.at, "again");
    assert_int_equal(bytes.most, 1000);
    bytes_clear(&bytes);
    // A caller says that another text of it failed: what there is of this one is freed.
    Bytes part = {0};
    bytes_text(&part, "abc");
    part.is_failed = true;
    assert_null(bytes_take(&part, &size));
    assert_null(part.at);
}

TEST(sizes_that_overflow_fail) {
    Bytes bytes = {0};
    bytes_text(&bytes, "x");
    assert_false(bytes_reserve(&bytes, SIZE_MAX));
    assert_true(bytes.is_failed);
    bytes_clear(&bytes);
}

TEST(taking_leaves_an_empty_buffer) {
    Bytes bytes = {.most = 50};
    size_t size = 7;
    char *text = bytes_take(&bytes, &size);
    assert_string_equal(text, "");
    assert_int_equal(size, 0);
    free(text);
    bytes_text(&bytes, "abc");
    text = bytes_take(&bytes, &size);
    assert_string_equal(text, "abc");
    assert_int_equal(size, 3);
    assert_null(bytes.at);
    assert_int_equal(bytes.most, 50);
    free(text);
}

TEST(numbers_that_are_none_are_null) {
    Bytes bytes = {0};
    const double values[] = {0.5, NAN, INFINITY, -INFINITY, -0.0};
    for (size_t i = 0; i < COUNT(values); i++) {
        bytes_real(&bytes, values[i]);
        bytes_text(&bytes, " ");
    }
    assert_string_equal(bytes.at, "0.5 null null null -0.0 ");
    bytes_clear(&bytes);
}

TEST(strings_are_escaped_and_always_utf8) {
    static const struct {
        const char *text, *json;
    } cases[] = {
        {NULL, "null"},
        {"", "\"\""},
        {"a\"b\\c/d", "\"a\\\"b\\\\c/d\""},
        {"\b\f\n\r\t\x01\x1f\x7f", "\"\\b\\f\\n\\r\\t\\u0001\\u001f\\u007f\""},
        {"\xC3\xBC \xE2\x82\xAC \xF0\x9D\x84\x9E", "\"\xC3\xBC \xE2\x82\xAC \xF0\x9D\x84\x9E\""},
        {"\xFF", "\"\xEF\xBF\xBD\""},
        {"\xC3", "\"\xEF\xBF\xBD\""},
        {"\xC0\xAF", "\"\xEF\xBF\xBD\xEF\xBF\xBD\""},
        {"\xED\xA0\x80", "\"\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\""},
        {"\xF4\x90\x80\x80", "\"\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\""},
        {"\xE2\x82", "\"\xEF\xBF\xBD\xEF\xBF\xBD\""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Bytes bytes = {0};
        bytes_json_string(&bytes, cases[i].text);
        assert_string_equal(bytes.at, cases[i].json);
        bytes_clear(&bytes);
    }
}

TEST(json_is_written_by_a_format) {
    Bytes bytes = {0};
    const char *volatile none = NULL;
    bytes_json(&bytes, "{\"a\": %s, \"b\": %s, \"c\": \"/%s/%llu\", \"d\": %g, \"e\": %g",
               "say \"x\"", none, "v1", 18446744073709551615ULL, 0.1, (double)NAN);
    bytes_json(&bytes, ", \"f\": %p, \"g\": %p, \"h\": %d, \"i\": %zu, \"j\": %p}\n", "[1, 2]",
               none, -1, (size_t)7, json_flag(true));
    assert_string_equal(bytes.at,
                        "{\"a\": \"say \\\"x\\\"\", \"b\": null, \"c\": "
                        "\"/v1/18446744073709551615\", \"d\": 0.1, \"e\": null, \"f\": [1, 2], "
                        "\"g\": null, \"h\": -1, \"i\": 7, \"j\": true}\n");
    bytes_clear(&bytes);
}

TEST(wide_characters_take_two_columns) {
    static const struct {
        const char *text;
        size_t width;
    } cases[] = {{"", 0},
                 {"a\xC3\xBC", 2},
                 {"\xE5\xBB\xBA\xE7\x89\xA9", 4},
                 {"\xEA\xB0\x80", 2},
                 {"\xE2\x82\xAC", 1},
                 {"\xEF\xBD\xB1", 1},
                 {"\xF0\x9F\x8F\xA2", 2}};
    for (size_t i = 0; i < COUNT(cases); i++)
        assert_int_equal(text_width(cases[i].text), cases[i].width);
}
