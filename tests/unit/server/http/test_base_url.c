// Base URLs taken apart, and those that are none.
#include <string.h>

#include "server/http/server.h"
#include "tests/support/test.h"

TEST(urls_are_taken_apart) {
    static const struct {
        const char *given, *text, *host, *path;
    } good[] = {
        {"http://a", "http://a", "a", ""},
        {"https://a.example.org/", "https://a.example.org", "a.example.org", ""},
        {"https://a:65535", "https://a:65535", "a", ""},
        {"https://a:8443/sim", "https://a:8443/sim", "a", "/sim"},
        {"https://[::1]:80/sim/x_1~/", "https://[::1]:80/sim/x_1~", "[::1]", "/sim/x_1~"},
        {"https://a/v1x", "https://a/v1x", "a", "/v1x"},
    };
    for (size_t i = 0; i < COUNT(good); i++) {
        BaseUrl url;
        assert_int_equal(base_url_read(good[i].given, &url, NULL), STATUS_OK);
        assert_string_equal(url.text, good[i].text);
        assert_string_equal(url.host, good[i].host);
        assert_string_equal(url.path, good[i].path);
    }
}

TEST(what_is_no_base_url_is_refused_with_what_would_be) {
    static const char *const bad[] = {
        "",
        "sim.example.org/impactd",
        "ftp://a",
        "http://",
        "http:///sim",
        "http://a?b",
        "http://a/b?c",
        "http://a/b#c",
        "http://a:b/",
        "http://a:/x",
        "http://a:0/x",
        "http://a:65536",
        "http://a:99999/x",
        "http://a:123456",
        "http://a b",
        "http://a/b c",
        "http://a/\"x\"",
        "http://a//b",
        "http://a/../b",
        "http://a/.",
        "http://u:p@a/",
        "http://[::1/sim",
        "http://a/v1",
        "http://a/v1/x/",
        "http://a/%2e",
        "http://a/0123456789012345678901234567890123456789012345678901234567890123",
    };
    char slashes[300] = "http://a";
    memset(slashes + 8, '/', 280); // those at the end are no part of the path
    BaseUrl with_slashes;
    Problem too_long;
    problem_clear(&too_long);
    assert_int_equal(base_url_read(slashes, &with_slashes, &too_long), STATUS_USAGE);
    assert_non_null(strstr(too_long.detail, "is too long: 255 bytes"));
    for (size_t i = 0; i < COUNT(bad); i++) {
        BaseUrl url;
        Problem problem;
        problem_clear(&problem);
        if (base_url_read(bad[i], &url, &problem) != STATUS_USAGE)
            fail_msg("\"%s\" is taken", bad[i]);
        assert_non_null(strstr(problem.detail, "https://sim.example.org/impactd"));
    }
}
