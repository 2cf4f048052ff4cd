// How a C test is written: TEST(the_sentence_that_it_proves) { ... }. Nothing lists it: the program
// it is linked to runs it.
#ifndef TESTS_SUPPORT_TEST_H
#define TESTS_SUPPORT_TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

typedef struct Test {
    struct CMUnitTest test;
    const char *file;
    int line;
    struct Test *next;
} Test;

void test_add(Test *test);

// Before the first and after the last test of this file.
void test_group(const char *file, CMFixtureFunction set_up, CMFixtureFunction tear_down);

// Runs the tests of the files named ("test_flight"), of all files if there are none; the exit code.
int test_run(int count, char **files);

#define TEST(name) TEST_IN(name, NULL, NULL)

// With `set_up` before it and `tear_down` after it.
#define TEST_IN(name, set_up, tear_down)                                                           \
    static void name(void **state);                                                                \
    __attribute__((constructor)) static void name##_add(void) {                                    \
        static Test name##_test = {                                                                \
            {#name, name, set_up, tear_down, NULL}, __FILE__, __LINE__, NULL};                     \
        test_add(&name##_test);                                                                    \
    }                                                                                              \
    static void name(__attribute__((unused)) void **state)

#define TEST_GROUP(set_up, tear_down)                                                              \
    __attribute__((constructor)) static void group_add(void) {                                     \
        test_group(__FILE__, set_up, tear_down);                                                   \
    }

#endif
