// Replies that are packed, known already, or asked for in part.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/reply.h"
#include "tests/support/test.h"

static Reply text_of(size_t size) {
    Reply reply;
    Bytes bytes = {0};
    reply_default(&reply);
    while (bytes.count < size)
        bytes_text(&bytes, "0.015,0.0149,");
    assert_int_equal(reply_bytes(&reply, 200, "text/csv; charset=utf-8", &bytes, NULL), STATUS_OK);
    snprintf(reply.etag, sizeof reply.etag, "\"r-1-series.csv\"");
    return reply;
}

TEST(a_text_is_packed_where_it_is_taken_and_pays) {
    Reply reply = text_of(5000);
    const size_t size = reply.body_size;
    assert_true(reply_pack(&reply, &(Request){.accept_encoding = "gzip, br"}));
    assert_true(reply.body_size < size / 4);
    assert_string_equal(reply.content_encoding, "gzip");
    assert_string_equal(reply.etag, "\"r-1-series.csv-gz\"");
    assert_memory_equal(reply.body, "\x1f\x8b", 2);
    assert_false(reply_pack(&reply, &(Request){.accept_encoding = "gzip"}));
    reply_clear(&reply);
}

TEST(whoever_does_not_take_it_gets_it_plain_and_caches_are_told) {
    Reply reply = text_of(5000);
    assert_false(reply_pack(&reply, &(Request){.accept_encoding = NULL}));
    assert_true(reply.varies_by_encoding);
    assert_null(reply.content_encoding);
    assert_memory_equal(reply.body, "0.015", 5);
    reply_clear(&reply);
    reply = text_of(100);
    assert_false(reply_pack(&reply, &(Request){.accept_encoding = "gzip"}));
    assert_false(reply.varies_by_encoding);
    reply_clear(&reply);
    reply = text_of(5000);
    reply.content_type = "application/x-npy";
    assert_false(reply_pack(&reply, &(Request){.accept_encoding = "gzip"}));
    assert_false(reply.varies_by_encoding);
    reply_clear(&reply);
}

TEST(the_tag_of_either_form_is_known) {
    const char *const tags[] = {"\"r-1-series.csv\"", "\"x\", \"r-1-series.csv-gz\"", "*"};
    const char *const told[] = {"\"r-1-series.csv\"", "\"r-1-series.csv-gz\"",
                                "\"r-1-series.csv\""};
    for (size_t i = 0; i < COUNT(tags); i++) {
        Reply reply = text_of(5000);
        assert_true(reply_is_known(
            &reply, &(Request){.method = "GET", .path = "/v1/x", .if_none_match = tags[i]}));
        assert_int_equal(reply.code, 304);
        assert_int_equal(reply.body_size, 0);
        assert_string_equal(reply.etag, told[i]);
        assert_true(reply.varies_by_encoding);
        reply_clear(&reply);
    }
    Reply reply = text_of(5000);
    assert_false(reply_is_known(
        &reply, &(Request){.method = "GET", .path = "/v1/x", .if_none_match = "\"r-1-series\""}));
    assert_false(reply_is_known(
        &reply, &(Request){.method = "GET", .path = "/v1/x", .if_none_match = NULL}));
    assert_int_equal(reply.code, 200);
    reply_clear(&reply);
}
