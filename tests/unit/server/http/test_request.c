#include <string.h>

#include "server/http/server.h"
#include "tests/support/test.h"

static Status open_target(Request *request, const char *target) {
    Problem problem;
    problem_clear(&problem);
    memset(request, 0, sizeof *request);
    return request_open(request, target, &problem);
}

TEST(a_target_is_taken_apart_and_decoded) {
    Request request;
    assert_int_equal(open_target(&request, "/v1/a%20b?q=soft+rubber%21&empty=&bare&&x=a=b"),
                     STATUS_OK);
    assert_string_equal(request.path, "/v1/a%20b");
    assert_string_equal(request.target, "/v1/a%20b?q=soft+rubber%21&empty=&bare&&x=a=b");
    assert_int_equal(request.query_count, 4);
    assert_string_equal(request_query(&request, "q"), "soft rubber!");
    assert_string_equal(request_query(&request, "empty"), "");
    assert_string_equal(request_query(&request, "bare"), "");
    assert_string_equal(request_query(&request, "x"), "a=b");
    assert_null(request_query(&request, "y"));
    request_close(&request);
}

TEST(a_plus_is_a_blank_in_a_query_alone) {
    char path[] = "a+b%2B", query[] = "a+b%2B";
    assert_true(request_decode(path, false));
    assert_string_equal(path, "a+b+");
    assert_true(request_decode(query, true));
    assert_string_equal(query, "a b+");
}

TEST(broken_queries_are_refused) {
    static const char *const targets[] = {"/?a=%",   "/?a=%4",  "/?a=%zz",
                                          "/?a=%00", "/?%g0=1", "/?a=1&a=2"};
    for (size_t i = 0; i < COUNT(targets); i++) {
        Request request;
        assert_int_equal(open_target(&request, targets[i]), STATUS_USAGE);
        request_close(&request);
    }
}

TEST(more_queries_than_there_is_room_for_are_refused) {
    char target[512] = "/?";
    for (size_t i = 0; i <= REQUEST_QUERIES; i++) {
        const char pair[] = {(char)('A' + i), '=', '1', '&', '\0'};
        strcat(target, pair);
    }
    Request request;
    assert_int_equal(open_target(&request, target), STATUS_USAGE);
    request_close(&request);
}

TEST(numbers_in_queries_have_bounds) {
    Request request;
    Problem problem;
    problem_clear(&problem);
    double value = 0;
    assert_int_equal(
        open_target(&request, "/?a=2.5&b=nan&c=0x10&d=&e=+1&f=11&g=1e1&h=1%202&i=1e999"),
        STATUS_OK);
    assert_int_equal(request_number(&request, "a", 0, 10, 1, &value, &problem), STATUS_OK);
    assert_true(value == 2.5);
    assert_int_equal(request_number(&request, "z", 0, 10, 7, &value, &problem), STATUS_OK);
    assert_true(value == 7);
    assert_int_equal(request_number(&request, "g", 0, 10, 7, &value, &problem), STATUS_OK);
    assert_true(value == 10);
    static const char *const bad[] = {"b", "c", "d", "e", "f", "h", "i"}; // "+1" is " 1" in a query
    for (size_t i = 0; i < COUNT(bad); i++)
        assert_int_equal(request_number(&request, bad[i], 0, 10, 1, &value, &problem),
                         STATUS_USAGE);
    assert_non_null(strstr(problem.detail, "[0, 10]"));
    size_t count = 0;
    problem_clear(&problem);
    assert_int_equal(request_count(&request, "g", 1, 10, 7, &count, &problem), STATUS_OK);
    assert_int_equal(count, 10);
    assert_int_equal(request_count(&request, "z", 1, 10, 7, &count, &problem), STATUS_OK);
    assert_int_equal(count, 7);
    assert_int_equal(request_count(&request, "a", 1, 10, 7, &count, &problem), STATUS_USAGE);
    assert_non_null(strstr(problem.detail, "whole number, is \"2.5\""));
    request_close(&request);
}

static void add_header(Request *request, const char *name, const char *value) {
    request_header(request, name, strlen(name), value, strlen(value));
}

TEST(headers_are_kept_once_and_preferences_joined) {
    Request request = {0};
    add_header(&request, "accept", "text/csv");
    add_header(&request, "Accept", "text/html");
    add_header(&request, "PREFER", "respond-async");
    add_header(&request, "Prefer", "wait=3");
    add_header(&request, "X-Other", "x");
    assert_string_equal(request.accept, "text/csv");
    assert_string_equal(request.prefer, "respond-async, wait=3");
    assert_null(request.range);
    char text[300];
    memset(text, 'a', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    add_header(&request, "Prefer", text); // cut, not overrun
    assert_int_equal(strlen(request.prefer), sizeof request.prefers - 1);
}

TEST(addresses_on_loopback_are_read) {
    static const struct {
        const char *text, *host;
        uint16_t port;
    } good[] = {{"127.0.0.1:8080", "127.0.0.1", 8080},
                {"localhost:0", "127.0.0.1", 0},
                {"[::1]:65535", "::1", 65535},
                {":9", "127.0.0.1", 9},
                {"8081", "127.0.0.1", 8081}};
    for (size_t i = 0; i < COUNT(good); i++) {
        Address address;
        assert_int_equal(address_read(good[i].text, &address, NULL), STATUS_OK);
        assert_string_equal(address.host, good[i].host);
        assert_int_equal(address.port, good[i].port);
    }
}

TEST(addresses_beyond_loopback_are_read_and_told_apart) {
    static const struct {
        const char *text, *host;
        bool is_loopback, is_any;
    } good[] = {{"0.0.0.0:8080", "0.0.0.0", false, true},
                {"192.168.1.2:80", "192.168.1.2", false, false},
                {"[::]:80", "::", false, true},
                {"[0:0::0]:80", "0:0::0", false, true},
                {"[fe80::1]:80", "fe80::1", false, false},
                {"127.8.0.1:80", "127.8.0.1", true, false},
                {"[::1]:80", "::1", true, false}};
    for (size_t i = 0; i < COUNT(good); i++) {
        Address address;
        assert_int_equal(address_read(good[i].text, &address, NULL), STATUS_OK);
        assert_string_equal(address.host, good[i].host);
        assert_int_equal(address_is_loopback(&address), good[i].is_loopback);
        assert_int_equal(address_is_any(&address), good[i].is_any);
    }
}

TEST(request_ids_are_taken_if_they_are_plain) {
    static const struct {
        const char *sent, *kept;
    } ids[] = {{"a-B.3_z", "a-B.3_z"},
               {"", ""},
               {"a b", ""},
               {"a\"b", ""},
               {"a\nb", ""},
               {"\xc3\xa9", ""},
               {"0123456789012345678901234567890123456789012345678901234567890123",
                "0123456789012345678901234567890123456789012345678901234567890123"},
               {"01234567890123456789012345678901234567890123456789012345678901234", ""}};
    for (size_t i = 0; i < COUNT(ids); i++) {
        Request request = {0};
        add_header(&request, "x-request-id", ids[i].sent);
        assert_string_equal(request.id, ids[i].kept);
    }
}

TEST(what_is_no_address_is_refused_with_the_reason) {
    static const struct {
        const char *text;
        Status status;
    } bad[] = {
        {"example.org:80", STATUS_USAGE},
        {"1.2.3:80", STATUS_USAGE},
        {"[127.0.0.1]:80", STATUS_USAGE},
        {"127.0.0.1", STATUS_USAGE},
        {"127.0.0.1:65536", STATUS_USAGE},
        {"::1:80", STATUS_USAGE},
        {"localhost:http", STATUS_USAGE},
        {"", STATUS_USAGE},
        {"127.0.0.1:", STATUS_USAGE},
        {"127.0.0.1:-1", STATUS_USAGE},
        {"[::1:80", STATUS_USAGE},
        {"[]:80", STATUS_USAGE},
        {"1234567890123456789012345678901234567890123456789012345678901234:80", STATUS_USAGE}};
    for (size_t i = 0; i < COUNT(bad); i++) {
        Address address;
        Problem problem;
        problem_clear(&problem);
        if (address_read(bad[i].text, &address, &problem) != bad[i].status)
            fail_msg("\"%s\" is taken otherwise: %s", bad[i].text, problem.detail);
        assert_true(problem.detail[0] != '\0');
    }
}
