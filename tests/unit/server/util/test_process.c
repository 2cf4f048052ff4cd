// What others send stays within its quotes on its line. Programs end as they ended, or in time.
#include <signal.h>
#include <string.h>

#include "server/util/process.h"
#include "tests/support/test.h"

static void expect(const char *text, size_t most, const char *wanted) {
    Bytes line = {0};
    log_put(&line, "a", text, most);
    assert_string_equal(line.at != NULL ? line.at : "", wanted);
    bytes_clear(&line);
}

TEST(texts_of_others_are_escaped_and_cut) {
    expect("plain /v1", 20, " a=\"plain /v1\"");
    expect("\x1b[2J\r\nx", 20, " a=\"\\x1b[2J\\x0d\\x0ax\"");
    expect("\" b=\"\\", 20, " a=\"\\x22 b=\\x22\\x5c\"");
    expect("\xc3\xa9\x7f", 20, " a=\"\\xc3\\xa9\\x7f\"");
    expect("0123456789", 10, " a=\"0123456789\"");
    expect("0123456789x", 10, " a=\"0123456789...\"");
    expect("", 10, " a=\"\"");
    expect(NULL, 10, "");
}

static Status process_run_text(const char *script, double seconds, Bytes *output,
                               Problem *problem) {
    const char *const words[] = {"sh", "-c", script, NULL};
    problem_clear(problem);
    bytes_clear(output);
    *output = (Bytes){.most = 1 << 20};
    return process_run(words, seconds, output, problem);
}

TEST(a_program_is_run_to_its_end_or_its_time) {
    static Problem problem;
    Bytes output = {0};
    const char *const none[] = {"/nowhere/sbatch", NULL};
    assert_int_equal(process_run_text("echo one; echo two >&2", 10, &output, &problem), STATUS_OK);
    assert_string_equal(output.at, "one\ntwo\n");
    assert_int_equal(
        process_run_text("echo no such partition; echo; exit 1", 10, &output, &problem), STATUS_IO);
    assert_string_equal(problem.detail, "no such partition");
    assert_int_equal(process_run_text("exit 3", 10, &output, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "sh failed"));
    assert_int_equal(process_run_text("kill -9 $$", 10, &output, &problem), STATUS_IO);
    // With all that it started, also where it closed the pipe.
    assert_int_equal(process_run_text("sleep 100 & sleep 100", 0.2, &output, &problem),
                     STATUS_TIMEOUT);
    assert_int_equal(process_run_text("exec >&- 2>&-; sleep 100", 0.2, &output, &problem),
                     STATUS_TIMEOUT);
    assert_int_equal(process_run_text("yes | head -c 3000000", 10, &output, &problem), STATUS_IO);
    assert_non_null(strstr(problem.detail, "more than 1048576 bytes"));
    bytes_clear(&output);
    problem_clear(&problem);
    assert_int_equal(process_run(none, 10, &output, &problem), STATUS_NOT_FOUND);
    bytes_clear(&output);
}

// What a parent of the program ignored is inherited: no exit code is no success.
TEST(a_program_whose_end_is_not_seen_has_failed) {
    static Problem problem;
    Bytes output = {0};
    (void)signal(SIGCHLD, SIG_IGN);
    assert_int_equal(process_run_text("exit 1", 10, &output, &problem), STATUS_IO);
    (void)signal(SIGCHLD, SIG_DFL);
    bytes_clear(&output);
}
