// The router over a small table of its own: what fits, what does not, and what the answer is.
#include <stdio.h>
#include <string.h>

#include "server/http/reply.h"
#include "server/http/router.h"
#include "tests/support/test.h"

static char seen[256];

static Status tell(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    (void)problem;
    snprintf(seen, sizeof seen, "%s|%s|%s",
             request->parameters[0] != NULL ? request->parameters[0] : "-",
             request->parameters[1] != NULL ? request->parameters[1] : "-",
             request_query(request, "wait") != NULL ? request_query(request, "wait") : "-");
    reply_borrow(reply, 200, "text/plain", "0123456789", 10);
    reply->accepts_ranges = true;
    snprintf(reply->etag, sizeof reply->etag, "\"tag\"");
    return STATUS_OK;
}

static Status break_off(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    (void)request;
    Bytes bytes = {0};
    bytes_text(&bytes, "half an answer");
    (void)reply_bytes(reply, 200, "text/plain", &bytes, problem);
    return problem_add(problem, STATUS_INVALID, "/structure/mass", "must be above 0 kg");
}

static const char *const waits[] = {"wait", "limit", NULL};
static const Route table[] = {
    {"GET", "/v1/jobs", "read", waits, "", tell, NULL},
    {"POST", "/v1/jobs", "read", NULL, "", break_off, NULL},
    {"GET", "/v1/jobs/{id}", "read", waits, "", tell, NULL},
    {"DELETE", "/v1/jobs/{id}", "read", NULL, "", tell, NULL},
    {"GET", "/v1/results/{id}/series.{format}", "read", NULL, "", tell, NULL},
    {"GET", "/v1/results/{id}/series", "read", NULL, "", tell, NULL},
    {"GET", "/v1/materials/{slug}@{revision}", "read", NULL, "", tell, NULL},
    {"GET", "/v1/materials/{slug}", "read", NULL, "", tell, NULL},
    {"GET", "/", "read", NULL, "", tell, NULL},
    {NULL, NULL, NULL, NULL, NULL, NULL, NULL},
};

static Reply ask(const char *method, const char *target, const char *range) {
    const Router router = {NULL, table, NULL, NULL, NULL};
    Request request = {.method = method, .range = range};
    Reply reply;
    seen[0] = '\0';
    reply_default(&reply);
    assert_int_equal(request_open(&request, target, NULL), STATUS_OK);
    if (router_admit(&router, &request, &reply))
        router_answer(&router, &request, &reply);
    request_close(&request);
    return reply;
}

static void expect(const char *method, const char *target, int code, const char *what) {
    Reply reply = ask(method, target, NULL);
    if (reply.code != code || (code == 200 && strcmp(seen, what) != 0) ||
        (code != 200 && what != NULL && strstr(reply.body, what) == NULL))
        fail_msg("%s %s: %d %s %.300s", method, target, reply.code, seen, (const char *)reply.body);
    if (code >= 400)
        assert_string_equal(reply.content_type, "application/problem+json");
    reply_clear(&reply);
}

TEST(paths_find_their_route_and_parameters) {
    expect("GET", "/", 200, "-|-|-");
    expect("GET", "/v1/jobs?wait=3", 200, "-|-|3");
    expect("GET", "/v1/jobs/j-1", 200, "j-1|-|-");
    expect("GET", "/v1/jobs/j%2F1%20", 200, "j/1 |-|-");
    expect("GET", "/v1/results/r-1/series.csv", 200, "r-1|csv|-");
    expect("GET", "/v1/results/r-1/series", 200, "r-1|-|-");
    expect("GET", "/v1/materials/sponge", 200, "sponge|-|-");
    expect("GET", "/v1/materials/sponge@2", 200, "sponge|2|-");
}

TEST(what_is_not_there_is_404_with_the_nearest_path) {
    expect("GET", "/v1/job", 404, "/v1/jobs");
    expect("GET", "/v1/result/r-1/series", 404, "/v1/results/r-1/series");
    expect("GET", "/v1/jobs//", 404, NULL);
    expect("DELETE", "/v1/jobs/j-1/", 404, NULL);
    expect("GET", "//v1/jobs", 404, NULL);
    expect("GET", "/v1/results/r-1/series.", 404, NULL);
    expect("GET", "/wholly/elsewhere/and/far", 404, "/openapi.json");
}

TEST(a_slash_at_the_end_redirects) {
    Reply reply = ask("GET", "/v1/jobs/j-1/?wait=3", NULL);
    assert_int_equal(reply.code, 308);
    assert_string_equal(reply.location, "/v1/jobs/j-1?wait=3");
    reply_clear(&reply);
}

TEST(a_wrong_method_is_405_with_allow) {
    Reply reply = ask("PUT", "/v1/jobs/j-1", NULL);
    assert_int_equal(reply.code, 405);
    assert_string_equal(reply.allow, "GET, HEAD, DELETE");
    reply_clear(&reply);
    reply = ask("DELETE", "/v1/jobs", NULL);
    assert_string_equal(reply.allow, "GET, HEAD, POST");
    reply_clear(&reply);
}

TEST(unknown_queries_are_refused_with_what_was_meant) {
    expect("GET", "/v1/jobs?wai=3", 400, "did you mean \\\"wait\\\"");
    expect("GET", "/v1/jobs?zzzzz=3", 400, "wait, limit");
    expect("GET", "/?a=1", 400, "there are none here");
}

TEST(broken_escapes_in_the_path_are_refused) {
    expect("GET", "/v1/jobs/%zz", 400, NULL);
    expect("GET", "/v1/jobs/%4", 400, NULL);
}

TEST(a_handlers_fault_becomes_a_problem_and_its_half_answer_is_dropped) {
    expect("POST", "/v1/jobs", 422, "/structure/mass");
    Reply reply = ask("POST", "/v1/jobs", NULL);
    assert_null(strstr(reply.body, "half"));
    reply_clear(&reply);
}

TEST(names_longer_than_any_id_are_not_found) {
    char target[1024] = "/v1/jobs/";
    memset(target + 9, 'a', 900);
    target[909] = '\0';
    expect("GET", target, 404, NULL);
}

TEST(parts_are_206_and_parts_outside_416) {
    Reply reply = ask("GET", "/", "bytes=2-4");
    assert_int_equal(reply.code, 206);
    assert_memory_equal(reply.body, "234", 3);
    assert_int_equal(reply.body_size, 3);
    assert_string_equal(reply.content_range, "bytes 2-4/10");
    reply_clear(&reply);
    reply = ask("GET", "/", "bytes=10-");
    assert_int_equal(reply.code, 416);
    assert_string_equal(reply.content_range, "bytes */10");
    assert_string_equal(reply.content_type, "application/problem+json");
    reply_clear(&reply);
}

TEST(if_range_with_another_tag_gets_the_whole) {
    const Router router = {NULL, table, NULL, NULL, NULL};
    Request request = {.method = "GET", .range = "bytes=0-1", .if_range = "\"other\""};
    Reply reply;
    reply_default(&reply);
    assert_int_equal(request_open(&request, "/", NULL), STATUS_OK);
    assert_true(router_admit(&router, &request, &reply));
    router_answer(&router, &request, &reply);
    assert_int_equal(reply.code, 200);
    reply_clear(&reply);
    request.if_range = "\"tag\"";
    router_answer(&router, &request, &reply);
    assert_int_equal(reply.code, 206);
    reply_clear(&reply);
    request_close(&request);
}
