#include <string.h>

#include "server/http/header.h"
#include "tests/support/test.h"

static const char *const types[] = {"application/json", "text/csv; charset=utf-8",
                                    "application/x-npy", NULL};

TEST(accept_chooses_by_quality_then_by_our_order) {
    assert_int_equal(header_accept(NULL, types), 0);
    assert_int_equal(header_accept("", types), 0);
    assert_int_equal(header_accept("*/*", types), 0);
    assert_int_equal(header_accept("text/csv", types), 1);
    assert_int_equal(header_accept("TEXT/CSV;header=present", types), 1);
    assert_int_equal(header_accept("text/*", types), 1);
    assert_int_equal(header_accept("application/json;q=0.5, text/csv", types), 1);
    assert_int_equal(header_accept("application/x-npy;q=0.9,*/*;q=0.1", types), 2);
    assert_int_equal(header_accept("application/json;q=0, */*", types), 1);
    assert_int_equal(header_accept("image/png", types), -1);
    assert_int_equal(header_accept("*/*;q=0", types), -1);
    assert_int_equal(header_accept("text/csv;q=nonsense", types), -1);
    assert_int_equal(header_accept(",,;;==,", types), -1);
}

TEST(a_browser_prefers_html) {
    static const char *const pages[] = {"text/plain", "text/html", NULL};
    assert_int_equal(
        header_accept("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", pages), 1);
    assert_int_equal(header_accept("*/*", pages), 0);
}

TEST(prefer_reads_wait_and_respond_async) {
    Prefer prefer = header_prefer("respond-async, wait=5");
    assert_true(prefer.responds_async && prefer.has_wait);
    assert_true(prefer.wait == 5);
    prefer = header_prefer("wait=\"0.25\"; x=y");
    assert_true(!prefer.responds_async && prefer.has_wait && prefer.wait == 0.25);
    prefer = header_prefer("foo; wait=5");
    assert_false(prefer.has_wait); // a parameter of another preference
    assert_false(header_prefer("wait=-1").has_wait);
    assert_false(header_prefer("wait=1e9").has_wait);
    assert_false(header_prefer("wait=").has_wait);
    assert_false(header_prefer("wait").has_wait);
    assert_false(header_prefer(NULL).has_wait);
    assert_true(header_prefer("wait=1, wait=2").wait == 1);
    assert_false(header_prefer("foo=\"a, wait=3\"").has_wait);
}

TEST(gzip_is_taken_where_it_is_named_or_all_is) {
    assert_true(header_accepts_gzip("gzip"));
    assert_true(header_accepts_gzip("deflate, GZIP;q=0.5, br"));
    assert_true(header_accepts_gzip("x-gzip"));
    assert_true(header_accepts_gzip("*"));
    assert_true(header_accepts_gzip("gzip;q=1, *;q=0"));
    assert_false(header_accepts_gzip("gzip;q=0, *"));
    assert_false(header_accepts_gzip("*;q=0"));
    assert_false(header_accepts_gzip("deflate, br"));
    assert_false(header_accepts_gzip("identity"));
    assert_false(header_accepts_gzip(""));
    assert_false(header_accepts_gzip(NULL));
}

typedef struct RangeCase {
    const char *range;
    RangeKind kind;
    size_t first, last;
} RangeCase;

TEST(ranges_of_ten_bytes) {
    static const RangeCase cases[] = {
        {"bytes=0-3", RANGE_PART, 0, 3},
        {"bytes=4-", RANGE_PART, 4, 9},
        {"bytes=-3", RANGE_PART, 7, 9},
        {"bytes=-30", RANGE_PART, 0, 9},
        {"bytes=9-9", RANGE_PART, 9, 9},
        {"bytes=0-99999999999999999999999999", RANGE_PART, 0, 9},
        {"bytes=10-", RANGE_UNSATISFIABLE, 0, 0},
        {"bytes=99999999999999999999999999-", RANGE_UNSATISFIABLE, 0, 0},
        {"bytes=-0", RANGE_UNSATISFIABLE, 0, 0},
        {"bytes=3-1", RANGE_WHOLE, 0, 0},
        {"bytes=0-1,3-4", RANGE_WHOLE, 0, 0},
        {"bytes=a-b", RANGE_WHOLE, 0, 0},
        {"bytes=-", RANGE_WHOLE, 0, 0},
        {"bytes=5", RANGE_WHOLE, 0, 0},
        {"lines=0-1", RANGE_WHOLE, 0, 0},
        {"", RANGE_WHOLE, 0, 0},
        {NULL, RANGE_WHOLE, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        size_t first = 0, last = 0;
        if (header_range(cases[i].range, 10, &first, &last) != cases[i].kind)
            fail_msg("%s is taken otherwise", cases[i].range);
        assert_int_equal(first, cases[i].first);
        assert_int_equal(last, cases[i].last);
    }
    size_t first, last;
    assert_int_equal(header_range("bytes=0-", 0, &first, &last), RANGE_UNSATISFIABLE);
    assert_int_equal(header_range("bytes=-1", 0, &first, &last), RANGE_UNSATISFIABLE);
}

TEST(etags_match_in_lists_weak_or_not) {
    assert_true(header_etag_matches("\"a\"", "\"a\""));
    assert_true(header_etag_matches("\"b,\", W/\"a\"", "\"a\""));
    assert_true(header_etag_matches("*", "\"a\""));
    assert_false(header_etag_matches("\"A\"", "\"a\""));
    assert_false(header_etag_matches("a", "\"a\""));
    assert_false(header_etag_matches("\"b, \"", "\"b\""));
    assert_false(header_etag_matches(NULL, "\"a\""));
}

TEST(strong_tags_of_a_list_come_one_after_the_other) {
    static const char *const wanted[] = {"\"a\"", "*", "\"b, c\"", "\"\"", "\"*\""};
    const char *list = "\"a\" , W/\"b\",*, \"b, c\", d, \"\",, \"*\"", *tag;
    const char *rest = " ,, W/\"a\", a\"";
    size_t size;
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        assert_true(header_etag_next(&list, &tag, &size));
        assert_int_equal(size, strlen(wanted[i]));
        assert_memory_equal(tag, wanted[i], size);
    }
    assert_false(header_etag_next(&list, &tag, &size));
    assert_false(header_etag_next(&rest, &tag, &size));
    rest = "\"";
    assert_false(header_etag_next(&rest, &tag, &size));
}

TEST(content_types_are_compared_without_parameters) {
    assert_true(header_type_is("application/json", "application/json"));
    assert_true(header_type_is("Application/JSON ; charset=utf-8", "application/json"));
    assert_false(header_type_is("application/jsonx", "application/json"));
    assert_false(header_type_is("text/plain; application/json", "application/json"));
    assert_false(header_type_is(NULL, "application/json"));
}
