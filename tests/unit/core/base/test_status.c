// Faults gathered, dropped and counted; texts cut and quoted.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/status.h"
#include "tests/support/test.h"

static Problem problem;

TEST(every_status_has_a_slug_and_a_title) {
    for (int i = 0; i < STATUS_COUNT; i++) {
        assert_true(strlen(status_slug((Status)i)) > 0);
        assert_true(strlen(status_title((Status)i)) > 0);
    }
    assert_string_equal(status_slug(STATUS_INVALID), "invalid-scene");
    assert_string_equal(status_slug((Status)999), "internal");
}

TEST(the_first_fault_sets_the_status_and_the_sentence) {
    problem_clear(&problem);
    assert_int_equal(problem_add(&problem, STATUS_INVALID, "/a", "is %d", 7), STATUS_INVALID);
    assert_int_equal(problem_add(&problem, STATUS_LIMIT, "/b", "too much"), STATUS_LIMIT);
    assert_int_equal(problem_set(&problem, STATUS_IO, "later"), STATUS_IO);
    assert_int_equal(problem.status, STATUS_INVALID);
    assert_string_equal(problem.detail, "/a: is 7");
    assert_int_equal(problem.count, 2);
    assert_string_equal(problem.faults[1].detail, "too much");
    problem_clear(&problem);
    assert_int_equal(problem.status, STATUS_OK);
    assert_int_equal(problem.count, 0);
    assert_string_equal(problem.detail, "");
}

TEST(one_place_has_one_fault) {
    problem_clear(&problem);
    problem_add(&problem, STATUS_INVALID, "/a", "must be a number");
    problem_add(&problem, STATUS_INVALID, "/a", "is required");
    problem_add_real(&problem, STATUS_INVALID, "/a", 1, "m", "is far");
    problem_add(&problem, STATUS_INVALID, "/a/b", "is another place");
    assert_int_equal(problem.count, 2);
    assert_string_equal(problem.faults[0].detail, "must be a number");
}

TEST(faults_beyond_a_hundred_are_counted) {
    problem_clear(&problem);
    for (int i = 0; i < 250; i++) {
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/%d", i);
        problem_add_real(&problem, STATUS_INVALID, pointer, i, NULL, "is wrong");
    }
    assert_int_equal(problem.count, 250);
    assert_string_equal(problem.faults[PROBLEM_FAULTS - 1].pointer, "/99");
}

TEST(nobody_needs_to_listen) {
    problem_clear(NULL);
    assert_int_equal(problem_set(NULL, STATUS_IO, "x"), STATUS_IO);
    assert_int_equal(problem_add(NULL, STATUS_INVALID, "/a", "x"), STATUS_INVALID);
    assert_int_equal(problem_add_real(NULL, STATUS_INVALID, "/a", 1, "m", "x"), STATUS_INVALID);
    assert_false(problem_concerns(NULL, ""));
}

TEST(a_problem_concerns_what_lies_at_or_below_a_place) {
    problem_clear(&problem);
    problem_add(&problem, STATUS_INVALID, "/dampers/0/buffer/restitution", "x");
    assert_true(problem_concerns(&problem, ""));
    assert_true(problem_concerns(&problem, "/dampers/0"));
    assert_true(problem_concerns(&problem, "/dampers/0/buffer/restitution"));
    assert_false(problem_concerns(&problem, "/dampers/0/buf"));
    assert_false(problem_concerns(&problem, "/dampers/0/buffer/restitution/x"));
}

TEST(numbers_are_json_and_what_is_not_finite_is_left_out) {
    problem_clear(&problem);
    problem_add_real(&problem, STATUS_INVALID, "/a", 0.1, "kg", "x");
    problem_add_real(&problem, STATUS_INVALID, "/b", -1e300, NULL, "x");
    problem_add_real(&problem, STATUS_INVALID, "/c", (double)NAN, "m", "x");
    problem_add_real(&problem, STATUS_INVALID, "/d", (double)INFINITY, "m", "x");
    assert_string_equal(problem.faults[0].value, "0.1");
    assert_string_equal(problem.faults[0].unit, "kg");
    assert_string_equal(problem.faults[1].value, "-1e+300");
    assert_string_equal(problem.faults[1].unit, "");
    assert_string_equal(problem.faults[2].value, "");
    assert_string_equal(problem.faults[3].value, "");
}

TEST(texts_are_cut_at_a_character) {
    char text[10];
    text_fit(text, sizeof text, "123456789");
    assert_string_equal(text, "123456789");
    text_fit(text, sizeof text, "1234567890");
    assert_string_equal(text, "123456...");
    text_fit(text, sizeof text, "12345\xC3\xA4\xC3\xB6\xC3\xBC");
    assert_string_equal(text, "12345...");
    text_fit(text, 3, "\xC3\xA4\xC3\xA4");
    assert_string_equal(text, "\xC3\xA4");
    assert_true(text_same(NULL, NULL) && text_same("a", "a"));
    assert_false(text_same("a", "b") || text_same(NULL, "") || text_same("", NULL));
    text_fit(text, 1, "a");
    assert_string_equal(text, "");
}

TEST(quoted_texts_stay_json_when_cut) {
    char text[16];
    text_quote(text, sizeof text, "a\"b\\\n");
    assert_string_equal(text, "\"a\\\"b\\\\...\"");
    text_quote(text, sizeof text, "short");
    assert_string_equal(text, "\"short\"");
    text_quote(text, sizeof text, "123456789\xC3\xA4xyz");
    assert_string_equal(text, "\"123456789...\"");
    char wide[64];
    text_quote(wide, sizeof wide, "\x01");
    assert_string_equal(wide, "\"\\u0001\"");
    text_quote(wide, 4, "abc");
    assert_string_equal(wide, "");
}

TEST(quoted_texts_are_utf_8_whatever_they_were) {
    char text[40];
    text_quote(text, sizeof text, "a\xFF\xC3\xA4\xC3");
    assert_string_equal(text, "\"a\xEF\xBF\xBD\xC3\xA4\xEF\xBF\xBD\"");
}

TEST(the_digits_of_a_message_read_back) {
    char text[32];
    assert_string_equal(text_real(text, 0.1), "0.1");
    assert_string_equal(text_real(text, 1.0 / 3), "0.3333333333333333");
    assert_string_equal(text_real(text, 0.1 + 0.2), "0.30000000000000004");
    assert_string_equal(text_real(text, 1e300), "1e+300");
}

TEST(a_list_has_commas_between_its_items_and_is_cut_where_it_ends) {
    char list[20] = "";
    text_list(list, sizeof list, "json");
    assert_string_equal(list, "json");
    text_list(list, sizeof list, "csv");
    assert_string_equal(list, "json, csv");
    text_list(list, sizeof list, "acceleration");
    assert_string_equal(list, "json, csv, accel...");
    text_list(list, sizeof list, "more");
    assert_string_equal(list, "json, csv, accel...");
    char small[8] = "json";
    text_list(small, sizeof small, "csv");
    assert_string_equal(small, "json, c");
}
