

#include <stdio.h>
#include <string.h>

#include "server/json/document.h"
#include "tests/support/test.h"

static void assert_differs(const char *a, const char *b, const char *ignored, const char *wanted) {
    static const DiffFormat format = {"a", "b", true};
    Bytes bytes = {0};
    size_t count;
    assert_int_equal(json_diff(a, b, ignored, &format, &bytes, &count, NULL), STATUS_OK);
    assert_string_equal(bytes.at, wanted);
    bytes_clear(&bytes);
}

TEST(each_difference_has_its_pointer) {
    assert_differs("{\"a\": 1, \"b\": {\"c\": [1, {\"d\": 0.1}]}}",
                   "{\"b\": {\"c\": [1, {\"d\": 0.2}]}, \"a\": 1.0}", NULL,
                   "[{\"pointer\": \"/b/c/1/d\", \"a\": 0.1, \"b\": 0.2, \"detail\": null}]");
    assert_differs("{\"x\": 1}", "{\"x\": 1}", NULL, "[]");
}

TEST(missing_values_are_null) {
    assert_differs("{\"a\": \"t\", \"l\": [1, 2]}", "{\"b/~\": {\"q\": true}, \"l\": [1]}", NULL,
                   "[{\"pointer\": \"/a\", \"a\": \"t\", \"b\": null, \"detail\": null}, "
                   "{\"pointer\": \"/l/1\", \"a\": 2, \"b\": null, \"detail\": null}, "
                   "{\"pointer\": \"/b~1~0\", \"a\": null, \"b\": {\"q\": true}, "
                   "\"detail\": null}]");
}

TEST(a_member_may_be_left_out) {
    assert_differs("{\"study\": 1, \"x\": 2}", "{\"x\": 2}", "study", "[]");
}

TEST(long_numbers_are_one_difference) {
    char a[2048] = "{\"s\": [", b[2048] = "{\"s\": [";
    for (int i = 0; i < 300; i++) {
        snprintf(a + strlen(a), sizeof a - strlen(a), "%s%d", i > 0 ? "," : "", i);
        snprintf(b + strlen(b), sizeof b - strlen(b), "%s%d", i > 0 ? "," : "", i == 250 ? 0 : i);
    }
    strcat(a, "]}");
    strcat(b, ", 7]}");
    assert_differs(a, b, NULL,
                   "[{\"pointer\": \"/s\", \"a\": null, \"b\": null, \"detail\": \"300 and 301 "
                   "items, the first that differs is number 251\"}]");
}

TEST(differences_beyond_the_limit_are_counted) {
    Bytes texts[2] = {{0}, {0}};
    for (int t = 0; t < 2; t++) {
        bytes_text(&texts[t], "{");
        for (int i = 0; i < DIFF_MAX + 5; i++)
            bytes_format(&texts[t], "%s\"m%d\": %d", i > 0 ? ", " : "", i, t);
        bytes_text(&texts[t], "}");
    }
    static const DiffFormat format = {"here", "there", false};
    Bytes bytes = {0};
    size_t count, shown = 0;
    assert_int_equal(json_diff(texts[0].at, texts[1].at, NULL, &format, &bytes, &count, NULL),
                     STATUS_OK);
    for (const char *at = bytes.at; (at = strstr(at, "\"here\": 0, \"there\": 1}")) != NULL; at++)
        shown++;
    assert_true(count == DIFF_MAX + 5 && shown == DIFF_MAX);
    bytes_clear(&bytes);
    bytes_clear(&texts[0]);
    bytes_clear(&texts[1]);
    assert_int_equal(json_diff("{\"x\": 1}", "{}", NULL, &format, &bytes, &count, NULL), STATUS_OK);
    assert_string_equal(bytes.at, "[{\"pointer\": \"/x\", \"here\": 1}]");
    bytes_clear(&bytes);
    assert_int_equal(json_diff("{", "{}", NULL, &format, &bytes, &count, NULL), STATUS_INTERNAL);
}
