// The base path before links, and off paths that come in.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/util/base_path.h"

static void expect_applied(const char *text, const char *wanted, size_t size) {
    char target[64];
    snprintf(target, sizeof target, "%s", text);
    base_path_apply(target, size);
    assert_string_equal(target, wanted);
}

static void without_a_base_all_stays(void **state) {
    (void)state;
    base_path_set("");
    expect_applied("/v1/jobs", "/v1/jobs", 64);
    assert_string_equal(base_path_strip("/v1/jobs"), "/v1/jobs");
}

static void a_base_stands_before_each_path(void **state) {
    (void)state;
    base_path_set("/sim");
    assert_string_equal(base_path(), "/sim");
    expect_applied("", "", 64);
    expect_applied("/v1/jobs/j-1", "/sim/v1/jobs/j-1", 64);
    expect_applied("</v1/jobs>; rel=\"next\", </a>; rel=\"b\"",
                   "</sim/v1/jobs>; rel=\"next\", </sim/a>; rel=\"b\"", 64);
    expect_applied("https://example.org/v1", "https://example.org/v1", 64);
    expect_applied("/v1/jobs", "/v1/jobs", 12); // no room: as it was, not cut
    expect_applied("/v1/jobs", "/sim/v1/jobs", 13);
    base_path_set("");
}

static void paths_come_in_with_and_without_it(void **state) {
    (void)state;
    base_path_set("/sim");
    assert_string_equal(base_path_strip("/sim/v1/jobs"), "/v1/jobs");
    assert_string_equal(base_path_strip("/v1/jobs"), "/v1/jobs");
    assert_string_equal(base_path_strip("/sim"), "/");
    assert_string_equal(base_path_strip("/sim/"), "/");
    assert_string_equal(base_path_strip("/simulation"), "/simulation");
    base_path_set("");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_base_all_stays),
        cmocka_unit_test(a_base_stands_before_each_path),
        cmocka_unit_test(paths_come_in_with_and_without_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
