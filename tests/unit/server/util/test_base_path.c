// The base path before links, and off paths that come in.
#include <stdio.h>
#include <string.h>

#include "server/util/base_path.h"
#include "tests/support/test.h"

static void expect_applied(const char *text, const char *wanted, size_t size) {
    char target[64];
    snprintf(target, sizeof target, "%s", text);
    base_path_apply(target, size);
    assert_string_equal(target, wanted);
}

TEST(without_a_base_all_stays) {
    base_path_set("");
    expect_applied("/v1/jobs", "/v1/jobs", 64);
    assert_string_equal(base_path_strip("/v1/jobs"), "/v1/jobs");
}

TEST(a_base_stands_before_each_path) {
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

TEST(paths_come_in_with_and_without_it) {
    base_path_set("/sim");
    assert_string_equal(base_path_strip("/sim/v1/jobs"), "/v1/jobs");
    assert_string_equal(base_path_strip("/v1/jobs"), "/v1/jobs");
    assert_string_equal(base_path_strip("/sim"), "/");
    assert_string_equal(base_path_strip("/sim/"), "/");
    assert_string_equal(base_path_strip("/simulation"), "/simulation");
    base_path_set("");
}
