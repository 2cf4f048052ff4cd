// Access over a database in memory: who is admitted, as whom, and what is counted; a refusal comes
// before the body is read.
#include <stdio.h>
#include <string.h>

#include "server/http/reply.h"
#include "server/http/router.h"
#include "server/util/base_path.h"
#include "tests/support/test.h"

static Status tell(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    (void)problem;
    reply_borrow(reply, 200, "text/plain", request->client != NULL ? request->client : "nobody", 3);
    snprintf(reply->location, sizeof reply->location, "/v1/a");
    snprintf(reply->link, sizeof reply->link, "</v1/a>; rel=\"next\"");
    return STATUS_OK;
}

static const Route table[] = {
    {"GET", "/open", "open", NULL, "", tell, NULL},
    {"GET", "/v1/a", "read", NULL, "", tell, NULL},
    {"POST", "/v1/a", "submit", NULL, "", tell, NULL},
    {NULL, NULL, NULL, NULL, NULL, NULL, NULL},
};

typedef struct House {
    Db *db;
    AccessControl access;
    Router router;
    char lab[128]; // the Authorization header of a token that may read
} House;

static int open_house(void **state) {
    static House house;
    TokenRow row = {.name = "lab"};
    char token[TOKEN_SIZE];
    if (db_open(NULL, &house.db, NULL) != STATUS_OK ||
        token_make("read", 0, &row, token, NULL) != STATUS_OK ||
        db_token_add(house.db, &row, NULL) != STATUS_OK)
        return -1;
    snprintf(house.lab, sizeof house.lab, "Bearer %s", token);
    house.access.request_metrics = request_metrics_new(table);
    house.router = (Router){NULL, table, NULL, &house.access, NULL};
    *state = &house;
    return tokens_open(house.db, false, &house.access.tokens, NULL) == STATUS_OK ? 0 : -1;
}

static int close_house(void **state) {
    House *house = *state;
    tokens_close(house->access.tokens);
    request_metrics_free(house->access.request_metrics);
    db_close(house->db);
    return 0;
}

static int ask(House *house, const char *method, const char *target, const char *authorization,
               Reply *reply) {
    Request request = {
        .method = method, .authorization = authorization, .id = "q-1", .received = 5};
    reply_default(reply);
    assert_int_equal(request_open(&request, target, NULL), STATUS_OK);
    if (router_admit(&house->router, &request, reply))
        router_answer(&house->router, &request, reply);
    request_close(&request);
    return reply->code;
}

TEST(scopes_of_routes_are_asked_for) {
    House *house = *state;
    Reply reply;
    assert_int_equal(ask(house, "GET", "/open", NULL, &reply), 200);
    assert_memory_equal(reply.body, "nobody", 3);
    assert_int_equal(ask(house, "GET", "/v1/a", house->lab, &reply), 200);
    assert_memory_equal(reply.body, "lab", 3);
    assert_int_equal(ask(house, "GET", "/v1/a", NULL, &reply), 401);
    assert_non_null(strstr(reply.authenticate, "Bearer"));
    assert_non_null(strstr(reply.body, "\"request_id\": \"q-1\""));
    reply_clear(&reply);
    assert_int_equal(ask(house, "POST", "/v1/a", house->lab, &reply), 403);
    assert_null(reply.authenticate);
    reply_clear(&reply);
    // Which paths there are is no secret.
    assert_int_equal(ask(house, "GET", "/v1/b", NULL, &reply), 404);
    reply_clear(&reply);
}

TEST(a_body_is_not_taken_for_whom_may_not_send_it) {
    House *house = *state;
    Request request = {.method = "POST", .authorization = house->lab};
    Reply reply;
    reply_default(&reply);
    assert_int_equal(request_open(&request, "/v1/a", NULL), STATUS_OK);
    assert_false(router_admit(&house->router, &request, &reply));
    assert_int_equal(reply.code, 403);
    reply_clear(&reply);
    request.method = "GET";
    assert_true(router_admit(&house->router, &request, &reply));
    assert_int_equal(reply.code, 0);
    assert_string_equal(request.client, "lab");
    request_close(&request);
}

TEST(answers_are_counted_where_they_belong) {
    House *house = *state;
    Reply reply;
    Bytes before = {0}, after = {0};
    request_metrics_write(house->access.request_metrics, &before);
    for (int i = 0; i < 3; i++)
        ask(house, "GET", "/open", NULL, &reply);
    ask(house, "PUT", "/open", NULL, &reply);
    reply_clear(&reply);
    request_metrics_write(house->access.request_metrics, &after);
    assert_non_null(strstr(before.at, "{route=\"/open\",method=\"GET\",code=\"2xx\"} 1\n"));
    assert_non_null(strstr(after.at, "{route=\"/open\",method=\"GET\",code=\"2xx\"} 4\n"));
    assert_non_null(strstr(after.at, "{route=\"none\",method=\"any\",code=\"4xx\"} 2\n"));
    assert_non_null(strstr(after.at, "_count{route=\"/open\",method=\"GET\"} 4\n"));
    bytes_clear(&before);
    bytes_clear(&after);
}

TEST(links_in_headers_begin_with_the_base) {
    House *house = *state;
    Reply reply;
    base_path_set("/sim");
    assert_int_equal(ask(house, "GET", "/sim/v1/a", house->lab, &reply), 200);
    assert_string_equal(reply.location, "/sim/v1/a");
    assert_string_equal(reply.link, "</sim/v1/a>; rel=\"next\"");
    assert_int_equal(ask(house, "GET", "/v1/a", house->lab, &reply), 200);
    assert_string_equal(reply.location, "/sim/v1/a");
    base_path_set("");
}

TEST(without_a_doorman_everyone_comes_in) {
    House house = {.router = {NULL, table, NULL, NULL, NULL}};
    Reply reply;
    assert_int_equal(ask(&house, "POST", "/v1/a", NULL, &reply), 200);
}

TEST_GROUP(open_house, close_house)
