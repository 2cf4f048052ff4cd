// A failed allocation inside the parser is reported as such, at whichever request it happens: never
// as a fault of the text, and without a look behind the parser's buffers.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/memory.h"
#include "tests/support/test.h"

static size_t left; // requests until one fails

static void *fail_once(size_t size) {
    return left-- == 0 ? NULL : malloc(size);
}

static void fail_each_request_of(const char *text) {
    json_error_t error;
    bool is_out_of_memory;
    json_t *root =
        json_memory_load(text, strlen(text), JSON_REJECT_DUPLICATES, &error, &is_out_of_memory);
    assert_non_null(root);
    assert_false(is_out_of_memory);
    json_decref(root);
    size_t count = 0;
    json_memory_source = fail_once;
    for (;; count++) {
        left = count;
        root =
            json_memory_load(text, strlen(text), JSON_REJECT_DUPLICATES, &error, &is_out_of_memory);
        if (root != NULL)
            break;
        assert_true(is_out_of_memory);
    }
    json_memory_source = malloc;
    assert_false(is_out_of_memory);
    json_decref(root);
    assert_true(count > 3);
}

TEST(every_failed_request_is_reported) {
    char text[20000];
    char run[5000];
    memset(run, 'x', sizeof run - 1);
    run[sizeof run - 1] = '\0';
    snprintf(text, sizeof text, "{\"a\": \"%s\", \"%.900s\": [1, 2.5, true, null]}", run, run);
    fail_each_request_of(text);
    memset(run, '7', sizeof run - 1);
    snprintf(text, sizeof text, "[1.%s, \"b\", 1.0000000000000000000000e%.1s]", run, run);
    fail_each_request_of(text);
    text[0] = '\0';
    for (int i = 0; i < 200; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%c\"%.31s\"", i == 0 ? '[' : ',',
                 run);
    strcat(text, "]");
    fail_each_request_of(text);
}
