// Addresses that a client accepts, and problem documents; exchanges are in contract/test_client.py.
#include <stdlib.h>
#include <string.h>

#include "server/cli/client.h"
#include "tests/support/test.h"

static Status opened(const char *url, const char *token, bool *exposes) {
    char address[100];
    ApiClient client;
    snprintf(address, sizeof address, "%s", url);
    if (token != NULL)
        setenv("IMPACTD_TOKEN", token, 1);
    else
        unsetenv("IMPACTD_TOKEN");
    const Status status = api_client_open(&(ClientSettings){.server = address}, &client, NULL);
    *exposes = status == STATUS_OK && api_client_exposes_token(&client);
    api_client_close(&client);
    return status;
}

TEST(only_plain_http_addresses_are_taken) {
    bool exposes;
    static const char *const right[] = {"http://127.0.0.1:8080", "https://h.example/base/",
                                        "http://[::1]:1", "http://localhost"};
    static const char *const wrong[] = {
        "ftp://h",    "file:///etc/passwd", "gopher://h", "http://u:p@h",
        "http://u@h", "http://h?q",         "http://h#f", "http://h\r\nX: y",
        "http://h x", "http://h:99999",     "http://"};
    for (size_t i = 0; i < COUNT(right); i++)
        assert_int_equal(opened(right[i], NULL, &exposes), STATUS_OK);
    for (size_t i = 0; i < COUNT(wrong); i++)
        assert_int_equal(opened(wrong[i], NULL, &exposes), STATUS_USAGE);
}

TEST(a_token_is_exposed_by_plain_http_to_others) {
    static const struct {
        const char *url, *token;
        bool exposes;
    } rows[] = {{"http://h.example", "t", true},      {"http://h.example", NULL, false},
                {"https://h.example", "t", false},    {"http://127.0.0.1:1", "t", false},
                {"http://localhost:1", "t", false},   {"http://[::1]:1", "t", false},
                {"http://127.example.org", "t", true}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        bool exposes;
        assert_int_equal(opened(rows[i].url, rows[i].token, &exposes), STATUS_OK);
        assert_int_equal(exposes, rows[i].exposes);
    }
}

static ApiAnswer answer_of(int code, const char *text) {
    ApiAnswer answer = {.code = code};
    bytes_text(&answer.body, text);
    return answer;
}

TEST(a_problem_document_becomes_a_problem) {
    Problem *problem = calloc(1, sizeof *problem);
    ApiAnswer answer = answer_of(
        422,
        "{\"type\": \"/problems/invalid-scene\", \"detail\": \"two\", \"errors\": ["
        "{\"pointer\": \"/a\", \"detail\": \"bad \\u001b[31m\", \"value\": {\"x\": 1}, "
        "\"did_you_mean\": \"b\"}, {\"pointer\": \"/c\", \"detail\": \"worse\"}], \"more\": 7}");
    assert_int_equal(problem_reply_read(&answer, problem), STATUS_INVALID);
    assert_int_equal(problem->count, 9);
    assert_string_equal(problem->faults[0].pointer, "/a");
    assert_string_equal(problem->faults[0].detail, "bad ?[31m");
    assert_string_equal(problem->faults[0].did_you_mean, "b");
    assert_string_equal(problem->faults[1].detail, "worse");
    api_answer_clear(&answer);
    free(problem);
}

TEST(every_code_has_a_status) {
    static const struct {
        int code;
        Status status;
    } rows[] = {{400, STATUS_USAGE},       {401, STATUS_FORBIDDEN}, {404, STATUS_NOT_FOUND},
                {410, STATUS_NOT_FOUND},   {409, STATUS_CONFLICT},  {422, STATUS_INVALID},
                {429, STATUS_UNREACHABLE}, {500, STATUS_INTERNAL},  {503, STATUS_UNREACHABLE},
                {299, STATUS_INTERNAL}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        ApiAnswer answer = answer_of(rows[i].code, "<html>");
        assert_int_equal(problem_reply_read(&answer, NULL), rows[i].status);
        api_answer_clear(&answer);
    }
}
