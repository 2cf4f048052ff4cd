// The elements of a document's array, as they stand in the text.
#include <stdio.h>
#include <string.h>

#include "core/base/status.h"
#include "server/json/parse.h"
#include "tests/support/test.h"

// The elements with "|" behind each.
static const char *elements(const char *text, char *target, size_t size) {
    ScanList list;
    target[0] = '\0';
    if (!scan_list(text, strlen(text), "all", &list))
        return "none";
    while (scan_element(&list)) {
        const size_t used = strlen(target);
        snprintf(target + used, size - used, "%.*s|", (int)list.count, text + list.first);
    }
    return target;
}

TEST(elements_are_found_where_they_stand) {
    static const struct {
        const char *text, *elements;
    } cases[] = {
        {"{\"all\": [1, {\"a\": [2, 3]}, \"],[\"]}", "1|{\"a\": [2, 3]}|\"],[\"|"},
        {"{\"x\": {\"all\": [9]}, \"all\":[\n 1 \n,2 ]}", "1|2|"},
        {"{\"\\u0061ll\": [5]}", "5|"},
        {"{\"all\": []}", ""},
        {"{\"all\": [ ]}", ""},
        {"{\"all\": [1,]}", "1||"},
        {"{\"all\": [,]}", "||"},
        {"{\"all\": [{\"a\": 1}, {\"b", "{\"a\": 1}|{\"b|"},
        {"{\"all\": 5, \"b\": [1]}", "none"},
        {"[\"all\", [1]]", "none"},
        {"", "none"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char found[256];
        assert_string_equal(elements(cases[i].text, found, sizeof found), cases[i].elements);
    }
}

TEST(an_array_behind_too_many_brackets_is_none) {
    char text[128] = "{\"all\": [", found[128];
    memset(text + strlen(text), '[', JSON_DEPTH_MAX + 1);
    assert_string_equal(elements(text, found, sizeof found), "none");
}

TEST(a_part_is_read_with_its_place_in_the_whole) {
    static const char text[] = "{\"all\": [\n{\"x\": 1},\n {\"x\": tru}]}";
    typedef struct One {
        double x;
    } One;
    static const Field fields[] = {FIELD_REAL(One, x, NULL, ANY, REQUIRED, "one"), FIELD_END};
    Problem problem = {.count = 0};
    ScanList list;
    One one;
    assert_true(scan_list(text, strlen(text), "all", &list));
    assert_true(scan_element(&list));
    assert_int_equal(
        json_parse_part(text, list.first, list.count, "/all/0", fields, &one, &problem), STATUS_OK);
    assert_true(one.x == 1);
    assert_true(scan_element(&list));
    assert_int_equal(
        json_parse_part(text, list.first, list.count, "/all/1", fields, &one, &problem),
        STATUS_UNREADABLE);
    assert_string_equal(problem.faults[0].pointer, "/all/1/x");
    assert_non_null(strstr(problem.faults[0].detail, "line 3, column 10"));
}

TEST(a_value_alone_is_read_by_its_row) {
    typedef struct One {
        char *text;
        Reals numbers;
    } One;
    static const Field fields[] = {
        FIELD_TEXT(One, text, 5, PRESENCE_OPTIONAL, FIELD_NULL_IS_EMPTY, "a text"),
        FIELD_REALS(One, numbers, NULL, ANY, 10, PRESENCE_OPTIONAL, "numbers"), FIELD_END};
    Problem problem = {.count = 0};
    One one = {NULL, {NULL, 0}};
    assert_int_equal(json_parse_value("null", 4, &fields[0], &one, "/2/text", &problem), STATUS_OK);
    assert_string_equal(one.text, ""); // not absent
    assert_int_equal(json_parse_value("[1,2]", 5, &fields[1], &one, "", &problem), STATUS_OK);
    assert_int_equal(one.numbers.count, 2);
    assert_int_equal(json_parse_value("\"too long\"", 10, &fields[0], &one, "/2/text", &problem),
                     STATUS_INVALID);
    assert_int_equal(json_parse_value("[1", 2, &fields[1], &one, "/3/numbers", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.status, STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/2/text");
    assert_string_equal(problem.faults[1].pointer, "/3/numbers/0");
    fields_clear(fields, &one);
}
