#include "tests/support/test.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static Test *tests; // by file and line

enum { GROUPS = 32, TESTS = 256 };
static struct {
    const char *file;
    CMFixtureFunction set_up, tear_down;
} groups[GROUPS];

void test_add(Test *test) {
    Test **at = &tests;
    while (*at != NULL) {
        const int order = strcmp((*at)->file, test->file);
        if (order > 0 || (order == 0 && (*at)->line > test->line))
            break;
        at = &(*at)->next;
    }
    test->next = *at;
    *at = test;
}

void test_group(const char *file, CMFixtureFunction set_up, CMFixtureFunction tear_down) {
    int i = 0;
    while (groups[i].file != NULL)
        i++;
    groups[i].file = file;
    groups[i].set_up = set_up;
    groups[i].tear_down = tear_down;
}

// Whether a name is that of the file ("test_flight" of ".../test_flight.c"), or there are none.
static bool test_is_wanted(const char *path, int count, char **names) {
    const char *base = strrchr(path, '/');
    base = base != NULL ? base + 1 : path;
    for (int i = 0; i < count; i++) {
        const size_t length = strlen(names[i]);
        if (strncmp(base, names[i], length) == 0 && strcmp(base + length, ".c") == 0)
            return true;
    }
    return count == 0;
}

// Runs the tests of the file of `first`; whether one failed.
static bool test_run_file(const Test *first) {
    static struct CMUnitTest of_file[TESTS];
    size_t count = 0;
    for (const Test *at = first; at != NULL && strcmp(at->file, first->file) == 0; at = at->next) {
        if (count == TESTS)
            abort();
        of_file[count++] = at->test;
    }
    int group = 0;
    while (groups[group].file != NULL && strcmp(groups[group].file, first->file) != 0)
        group++;
    return _cmocka_run_group_tests(first->file, of_file, count, groups[group].set_up,
                                   groups[group].tear_down) != 0;
}

int test_run(int count, char **files) {
    int failed = 0, run = 0;
    const char *last = "";
    for (const Test *at = tests; at != NULL; at = at->next) {
        if (strcmp(at->file, last) == 0)
            continue;
        last = at->file;
        if (test_is_wanted(at->file, count, files)) {
            run++;
            failed += test_run_file(at);
        }
    }
    if (run < count || run == 0)
        fprintf(stderr, "this program has not all of these files\n");
    return failed > 0 || run < count || run == 0;
}
