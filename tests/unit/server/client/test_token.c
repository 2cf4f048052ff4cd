// Where a token comes from, and which files are not trusted with one.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/client/token.h"

static char path[] = "/tmp/impactd-token-XXXXXX";

static void put(const char *text, mode_t mode) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(chmod(path, mode), 0);
}

static int setup(void **state) {
    (void)state;
    const int file = mkstemp(path);
    return file < 0 ? 1 : close(file);
}

static int teardown(void **state) {
    (void)state;
    return unlink(path);
}

static void the_file_wins_over_the_environment(void **state) {
    (void)state;
    char token[TOKEN_MAX + 1];
    assert_int_equal(unsetenv("IMPACTD_TOKEN"), 0);
    assert_int_equal(token_read(NULL, token, NULL), STATUS_OK);
    assert_string_equal(token, "");
    assert_int_equal(setenv("IMPACTD_TOKEN", "of.environment", 1), 0);
    assert_int_equal(token_read(NULL, token, NULL), STATUS_OK);
    assert_string_equal(token, "of.environment");
    put("of-file\r\nand more\n", 0600);
    assert_int_equal(token_read(path, token, NULL), STATUS_OK);
    assert_string_equal(token, "of-file");
    put("of-file", 0400);
    assert_int_equal(token_read(path, token, NULL), STATUS_OK);
}

static void files_that_others_can_read_are_refused(void **state) {
    (void)state;
    char token[TOKEN_MAX + 1];
    static const mode_t modes[] = {0644, 0640, 0604, 0620, 0602, 0601};
    for (size_t i = 0; i < COUNT(modes); i++) {
        put("secret", modes[i]);
        assert_int_equal(token_read(path, token, NULL), STATUS_USAGE);
    }
    assert_int_equal(token_read("/tmp", token, NULL), STATUS_USAGE);
    assert_int_equal(token_read("/dev/null", token, NULL), STATUS_USAGE);
    assert_int_equal(token_read("/nowhere", token, NULL), STATUS_USAGE);
}

static void what_is_no_token_is_refused_and_not_told(void **state) {
    (void)state;
    char token[TOKEN_MAX + 1];
    char longest[TOKEN_MAX + 2];
    memset(longest, 'x', sizeof longest);
    longest[TOKEN_MAX + 1] = '\0';
    const char *const wrong[] = {"", "\nx", "secret word", "secret\x01", "secret\xc3\xa4", longest};
    Problem *problem = calloc(1, sizeof *problem);
    for (size_t i = 0; i < COUNT(wrong); i++) {
        put(wrong[i], 0600);
        problem_clear(problem);
        assert_int_equal(token_read(path, token, problem), STATUS_USAGE);
        assert_null(strstr(problem->faults[0].detail, "secret"));
    }
    longest[TOKEN_MAX] = '\0';
    put(longest, 0600);
    assert_int_equal(token_read(path, token, NULL), STATUS_OK);
    assert_string_equal(token, longest);
    free(problem);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_file_wins_over_the_environment),
        cmocka_unit_test(files_that_others_can_read_are_refused),
        cmocka_unit_test(what_is_no_token_is_refused_and_not_told),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
