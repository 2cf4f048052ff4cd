// What a daemon tells, read by somebody who trusts nothing of it.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/cli/reply.h"

static HttpAnswer answer_of(int code, const char *text) {
    HttpAnswer answer = {.code = code};
    bytes_text(&answer.body, text);
    return answer;
}

static void a_job_is_read_and_what_is_not_known_skipped(void **state) {
    (void)state;
    HttpAnswer answer = answer_of(
        200, "{\"id\": \"j-1\", \"status\": \"failed\", \"result\": null, \"progress\": 40.5, "
             "\"news\": {\"deep\": [1]}, \"problem\": {\"detail\": \"why\", \"more\": 2}}");
    JobReply job = {0};
    assert_int_equal(job_reply_read(&answer, &job, NULL), STATUS_OK);
    assert_string_equal(job.id, "j-1");
    assert_null(job.result);
    assert_true(job.progress == 40.5);
    assert_true(job_reply_is_final(&job));
    assert_string_equal(job.problem.detail, "why");
    job_reply_clear(&job);
    http_answer_clear(&answer);
}

static void what_is_no_job_is_refused(void **state) {
    (void)state;
    static const char *const texts[] = {"",
                                        "{}",
                                        "[]",
                                        "{\"id\": 5, \"status\": \"running\"}",
                                        "{\"id\": \"j-1\"}",
                                        "{\"id\": \"j-1\", \"id\": \"j-2\", \"status\": \"x\"}"};
    for (size_t i = 0; i < COUNT(texts); i++) {
        HttpAnswer answer = answer_of(200, texts[i]);
        JobReply job = {0};
        assert_int_equal(job_reply_read(&answer, &job, NULL), STATUS_UNREACHABLE);
        job_reply_clear(&job);
        http_answer_clear(&answer);
    }
}

static void a_problem_document_becomes_a_problem(void **state) {
    (void)state;
    Problem *problem = calloc(1, sizeof *problem);
    HttpAnswer answer = answer_of(
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
    http_answer_clear(&answer);
    free(problem);
}

static void every_code_has_a_status(void **state) {
    (void)state;
    static const struct {
        int code;
        Status status;
    } rows[] = {{400, STATUS_USAGE},       {401, STATUS_FORBIDDEN}, {404, STATUS_NOT_FOUND},
                {410, STATUS_NOT_FOUND},   {409, STATUS_CONFLICT},  {422, STATUS_INVALID},
                {429, STATUS_UNREACHABLE}, {500, STATUS_INTERNAL},  {503, STATUS_UNREACHABLE},
                {299, STATUS_INTERNAL}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        HttpAnswer answer = answer_of(rows[i].code, "<html>");
        assert_int_equal(problem_reply_read(&answer, NULL), rows[i].status);
        http_answer_clear(&answer);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_job_is_read_and_what_is_not_known_skipped),
        cmocka_unit_test(what_is_no_job_is_refused),
        cmocka_unit_test(a_problem_document_becomes_a_problem),
        cmocka_unit_test(every_code_has_a_status),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
