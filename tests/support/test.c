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

// "test_flight" is the name of ".../test_flight.c".
static bool test_is_of(const char *path, const char *name) {
    const char *base = strrchr(path, '/');
    base = base != NULL ? base + 1 : path;
    const size_t length = strlen(name);
    return strncmp(base, name, length) == 0 && strcmp(base + length, ".c") == 0;
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
    int failed = 0;
    const char *last = "";
    bool *found = calloc((size_t)count + 1, sizeof *found);
    for (const Test *at = tests; at != NULL && found != NULL; at = at->next) {
        if (strcmp(at->file, last) == 0)
            continue;
        last = at->file;
        bool is_wanted = count == 0;
        for (int i = 0; i < count; i++)
            if (test_is_of(at->file, files[i]))
                is_wanted = found[i] = true;
        failed += is_wanted && test_run_file(at);
    }
    for (int i = 0; i < count && found != NULL; i++) {
        if (!found[i]) {
            fprintf(stderr, "there is no file %s in this program\n", files[i]);
            failed++;
        }
    }
    free(found);
    return failed > 0 || tests == NULL;
}
