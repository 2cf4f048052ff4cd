

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
