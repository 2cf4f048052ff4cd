// The gate: every head it must refuse, and those it must let through.
#include <string.h>

#include "server/http/request.h"
#include "tests/support/test.h"

// One request head: up to four headers.
typedef struct ResultSummary {
    const char *method, *target, *version;
    const char *headers[4][2];
    int code;
} ResultSummary;

static void add_header(Request *request, const char *name, const char *value) {
    request_header(request, name, strlen(name), value, strlen(value));
}

static int judge(const ResultSummary *head) {
    Request request = {.method = head->method};
    Problem problem;
    problem_clear(&problem);
    for (size_t i = 0; i < 4 && head->headers[i][0] != NULL; i++)
        add_header(&request, head->headers[i][0], head->headers[i][1]);
    const int code =
        request_validate(&request, &loopback_hosts, head->target, head->version, &problem);
    assert_int_equal(code != 0, problem.status != STATUS_OK);
    return code;
}

TEST(ordinary_requests_pass) {
    static const ResultSummary heads[] = {
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}}, 0},
        {"GET", "/", "HTTP/1.0", {{NULL, NULL}}, 0},
        {"POST",
         "/v1/jobs?dry_run=1",
         "HTTP/1.1",
         {{"host", "127.0.0.1:8080"}, {"content-length", "12"}},
         0},
        {"POST",
         "/v1/jobs",
         "HTTP/1.1",
         {{"Host", "[::1]:1"}, {"Transfer-Encoding", "Chunked"}},
         0},
        {"GET", "/v1/materials/a.b..c", "HTTP/1.1", {{"Host", "LOCALHOST:65535"}}, 0},
        {"GET",
         "/v1/jobs?next=..",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"X-A", "a\tb \xc3\xa9"}},
         0},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost:80"}, {"Origin", "http://LOCALHOST:80"}}, 0},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Sec-Fetch-Site", "same-origin"}}, 0},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Sec-Fetch-Site", "none"}}, 0},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Sec-Fetch-Site", "cross-site"}}, 0},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Origin", "http://evil.org"}}, 0},
        {"GET", "/", "HTTP/1.0", {{"Origin", "http://localhost"}}, 0},
    };
    for (size_t i = 0; i < COUNT(heads); i++)
        assert_int_equal(judge(&heads[i]), 0);
}

TEST(ambiguous_or_foreign_heads_are_refused) {
    static const ResultSummary heads[] = {
        {"GET", "/", "HTTP/1.2", {{"Host", "localhost"}}, 505},
        {"GET", "/", "HTTP/2.0", {{"Host", "localhost"}}, 505},
        {"BREW", "/", "HTTP/1.1", {{"Host", "localhost"}}, 501},
        {"get", "/", "HTTP/1.1", {{"Host", "localhost"}}, 501},
        {"GET", "http://localhost/", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"OPTIONS", "*", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/a\x01", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/a%00b", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/a?b=%00", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/v1/%2e%2E/x", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/v1/.%2e", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/v1/%2e/x", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/v1/../x", "HTTP/1.1", {{"Host", "localhost"}}, 400},
        {"GET", "/", "HTTP/1.1", {{NULL, NULL}}, 400},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Host", "localhost"}}, 400},
        {"GET", "/", "HTTP/1.1", {{"Host", "example.org"}}, 421},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost.example.org"}}, 421},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost:80a"}}, 421},
        {"GET", "/", "HTTP/1.1", {{"Host", "127.0.0.1:123456"}}, 421},
        {"GET", "/", "HTTP/1.1", {{"Host", ""}}, 421},
        {"GET", "/", "HTTP/1.1", {{"Host ", "localhost"}}, 400},
        {"POST",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"Content-Length", "1"}, {"Content-Length", "1"}},
         400},
        {"GET",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"Authorization", "Bearer a"}, {"authorization", "Bearer b"}},
         400},
        {"POST",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"Idempotency-Key", "a"}, {"idempotency-key", "b"}},
         400},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Content-Length", "+1"}}, 400},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Content-Length", "1, 1"}}, 400},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Content-Length", ""}}, 400},
        {"POST",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"Content-Length", "1"}, {"Transfer-Encoding", "chunked"}},
         400},
        {"POST",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"}, {"Transfer-Encoding", "gzip, chunked"}},
         501},
        {"POST",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost"},
          {"Transfer-Encoding", "chunked"},
          {"Transfer-Encoding", "chunked"}},
         501},
        {"POST", "/", "HTTP/1.0", {{"Transfer-Encoding", "chunked"}}, 400},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"X-A", "a\rX-B: b"}}, 400},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"X-A", "a\x7f"}}, 400},
        {"GET", "/", "HTTP/1.1", {{"Host", "localhost"}, {"X A", "a"}}, 400},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Sec-Fetch-Site", "cross-site"}}, 403},
        {"DELETE", "/", "HTTP/1.1", {{"Host", "localhost"}, {"Sec-Fetch-Site", "same-site"}}, 403},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost:80"}, {"Origin", "null"}}, 403},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost:80"}, {"Origin", ""}}, 403},
        {"POST", "/", "HTTP/1.1", {{"Host", "localhost:80"}, {"Origin", "http://evil.org"}}, 403},
        {"PATCH",
         "/",
         "HTTP/1.1",
         {{"Host", "localhost:80"}, {"Origin", "http://localhost:81"}},
         403},
    };
    for (size_t i = 0; i < COUNT(heads); i++)
        if (judge(&heads[i]) != heads[i].code)
            fail_msg("row %zu: %s %s is judged %d, not %d", i, heads[i].method, heads[i].target,
                     judge(&heads[i]), heads[i].code);
}

TEST(hosts_are_those_that_were_named) {
    static const char *const names[] = {"sim.example.org", "192.168.1.5", NULL};
    const AcceptedHosts named = {names, false, NULL}, any = {names, true, NULL};
    static const struct {
        const char *host;
        bool is_named, is_any;
    } hosts[] = {
        {"sim.example.org", true, true},
        {"SIM.example.org:8080", true, true},
        {"192.168.1.5:1", true, true},
        {"sim.example.org.", false, false},
        {"xsim.example.org", false, false},
        {"localhost", false, false},
        {"10.0.0.1:80", false, true},
        {"[fe80::1]:80", false, true},
        {"[fe80::1", false, false},
        {"fe80::1", false, false},
        {"10.0.0.1.example.org", false, false},
        {"10.0.0.1:80:80", false, false},
        {"[sim.example.org]", false, false},
        {"10.0.0", false, false},
        {":80", false, false},
        {"", false, false},
    };
    for (size_t i = 0; i < COUNT(hosts); i++) {
        if (host_is_ours(&named, hosts[i].host) != hosts[i].is_named ||
            host_is_ours(&any, hosts[i].host) != hosts[i].is_any)
            fail_msg("\"%s\" is judged otherwise", hosts[i].host);
    }
}

TEST(a_foreign_host_is_told_the_names_that_are_right) {
    static const char *const names[] = {"sim.example.org", "localhost", NULL};
    const AcceptedHosts named = {names, true, NULL};
    Request request = {.method = "GET"};
    Problem problem;
    problem_clear(&problem);
    add_header(&request, "Host", "evil");
    assert_int_equal(request_validate(&request, &named, "/", "HTTP/1.1", &problem), 421);
    assert_non_null(strstr(problem.detail, "sim.example.org or localhost, or an address"));
    assert_non_null(strstr(problem.detail, "\"evil\""));
}

TEST(a_name_given_for_a_proxy_is_no_foreign_origin) {
    static const char *const names[] = {"localhost", "sim.example.org", NULL};
    const AcceptedHosts named = {names, false, NULL};
    static const struct {
        const char *origin;
        int code;
    } cases[] = {{"https://sim.example.org", 0},
                 {"https://sim.example.org:8443", 0},
                 {"https://sim.example.org.evil.org", 403},
                 {"https://example.org", 403},
                 {"http://localhost:3000", 403}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        Request request = {.method = "POST"};
        Problem problem;
        problem_clear(&problem);
        add_header(&request, "Host", "localhost:8080");
        add_header(&request, "Origin", cases[i].origin);
        assert_int_equal(request_validate(&request, &named, "/", "HTTP/1.1", &problem),
                         cases[i].code);
    }
}

// Without a Host header it is not known whether a page of this server asks.
TEST(an_origin_without_a_host_is_foreign) {
    const ResultSummary head = {"POST", "/", "HTTP/1.0", {{"Origin", "http://localhost"}}, 403};
    assert_int_equal(judge(&head), 403);
}

TEST(a_nul_inside_a_value_is_seen_by_its_size) {
    Request request = {.method = "GET"};
    Problem problem;
    problem_clear(&problem);
    add_header(&request, "Host", "localhost");
    request_header(&request, "X-A", 3, "a\0b", 3);
    assert_int_equal(request_validate(&request, &loopback_hosts, "/", "HTTP/1.1", &problem), 400);
    assert_non_null(strstr(problem.detail, "X-A"));
}

TEST(a_target_of_4097_bytes_is_too_long) {
    char target[4098];
    memset(target, 'a', sizeof target - 1);
    target[0] = '/';
    target[4097] = '\0';
    ResultSummary head = {"GET", target, "HTTP/1.1", {{"Host", "localhost"}}, 414};
    assert_int_equal(judge(&head), 414);
    target[4096] = '\0';
    assert_int_equal(judge(&head), 0);
}
