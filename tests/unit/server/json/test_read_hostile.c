// Documents that mean harm, or are none: each is answered, none crashes, hangs or leaks.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <dirent.h>
#include <jansson.h>

#include "core/simulation/simulation.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/clock.h"
#include "tests/support/test.h"

enum { MUTATIONS = IMPACTD_SANITIZED ? 20000 : 200000, SLOWDOWN = IMPACTD_SANITIZED ? 20 : 1 };

static const char scene[] =
    "{\"structure\": {\"kind\": \"sdof\", \"mass\": 1.35, \"stiffness\": 865, \"damping\": "
    "1.092},\n"
    " \"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, \"buffer\": \"sponge\","
    " \"left_buffer\": {\"restitution\": 0.61, \"contact_time\": 0.025}}],\n"
    " \"contact\": {\"model\": \"auto\", \"separation\": \"zero_penetration\"},\n"
    " \"excitation\": {\"kind\": \"record\", \"samples\": [0.1, -2e-3, 3], \"interval\": 0.01},\n"
    " \"duration\": 10, \"sample_rate\": 1000, \"accuracy\": {\"solver\": \"auto\"},\n"
    " \"output\": {\"channels\": [\"displacement\", \"acceleration\"],"
    " \"psd\": {\"channels\": [\"mean_acceleration\"], \"segment\": 4096}},\n"
    " \"title\": \"\\u00fcber\", \"labels\": [\"a\", \"b\"]}";

static Problem problem;

// Reads and judges, and looks at what is said: the problem document must be JSON, whatever came in.
static Status survive(const char *text, size_t size) {
    // A copy of the exact size, so that a sanitizer sees a byte read too far.
    char *copy = malloc(size > 0 ? size : 1);
    memcpy(copy, text, size);
    Simulation simulation;
    problem_clear(&problem);
    Status status = json_parse(copy, size, simulation_fields, &simulation, &problem);
    free(copy);
    assert_true(status == STATUS_OK || status == STATUS_INVALID || status == STATUS_UNREADABLE);
    assert_int_equal(problem.status, status);
    assert_int_equal(problem.count > 0, status != STATUS_OK);
    if (status != STATUS_UNREADABLE &&
        fields_validate(simulation_fields, &simulation, "", &problem) != STATUS_OK)
        status = STATUS_INVALID;
    fields_clear(simulation_fields, &simulation);
    if (status != STATUS_OK) {
        Bytes answer = {0};
        encode_problem(&answer, &problem, 400, NULL);
        json_t *parsed = json_loadb(answer.at, answer.count, JSON_REJECT_DUPLICATES, NULL);
        if (parsed == NULL)
            fail_msg("no JSON: %s", answer.at);
        json_decref(parsed);
        bytes_clear(&answer);
    }
    return status;
}

static Status survive_text(const char *text) {
    return survive(text, strlen(text));
}

// Nicolas Seriot's JSON parsing test suite.
TEST(files_of_the_json_test_suite_are_answered) {
    static const char folder[] = IMPACTD_SOURCE_DIR "/tests/contract/json";
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    size_t count = 0;
    const struct dirent *entry;
    while ((entry = readdir(directory)) != NULL) {
        if (strstr(entry->d_name, ".json") == NULL)
            continue;
        char path[4096];
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        FILE *file = fopen(path, "rb");
        assert_non_null(file);
        static char text[1 << 20];
        const size_t size = fread(text, 1, sizeof text, file);
        fclose(file);
        // None of them is a scene.
        assert_int_not_equal(survive(text, size), STATUS_OK);
        count++;
    }
    closedir(directory);
    assert_int_equal(count, 318);
}

TEST(every_beginning_of_a_scene_is_answered) {
    assert_int_equal(survive_text(scene), STATUS_OK);
    for (size_t size = 0; size < sizeof scene - 1; size++)
        assert_int_equal(survive(scene, size), STATUS_UNREADABLE);
}

static uint64_t next(uint64_t *seed) {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    return *seed >> 11;
}

TEST(mutated_scenes_are_answered) {
    static const char *const pieces[] = {
        "{",     "}",     "[",    "]",         "\"",         ",",  ":",    "null", "true",
        "-1",    "1e308", "0",    "\"kind\":", "{}",         "[]", "[[]]", "\"\"", "\\",
        "\\u00", "\xff",  "\xc3", "1.5",       "\"sponge\"", "\n", "-0.0",
    };
    uint64_t seed = 88172645463325252u;
    size_t read = 0;
    for (int i = 0; i < MUTATIONS; i++) {
        char text[2 * sizeof scene];
        size_t size = sizeof scene - 1;
        memcpy(text, scene, size);
        for (uint64_t changes = 1 + next(&seed) % 4; changes > 0; changes--) {
            const size_t at = (size_t)(next(&seed) % size);
            const char *piece = pieces[next(&seed) % COUNT(pieces)];
            const size_t length = strlen(piece);
            size_t gone = (size_t)(next(&seed) % 12);
            if (next(&seed) % 3 == 0)
                gone = length; // in place of as many bytes
            gone = gone < size - at ? gone : size - at;
            memmove(text + at + length, text + at + gone, size - at - gone);
            memcpy(text + at, piece, length);
            size += length - gone;
        }
        read += survive(text, size) != STATUS_UNREADABLE;
    }
    // The mutations are no good test if all of them are refused by the parser.
    assert_true(read > MUTATIONS / 50);
}

TEST(nesting_is_allowed_to_32) {
    char text[256];
    for (int depth = 2; depth <= 40; depth++) {
        size_t size = (size_t)snprintf(text, sizeof text, "{\"a\": ");
        for (int i = 1; i < depth; i++)
            text[size++] = '[';
        for (int i = 1; i < depth; i++)
            text[size++] = ']';
        text[size++] = '}';
        const Status status = survive(text, size);
        assert_int_equal(status, depth <= JSON_DEPTH_MAX ? STATUS_INVALID : STATUS_UNREADABLE);
        if (depth == JSON_DEPTH_MAX + 1) {
            assert_string_equal(problem.faults[0].pointer,
                                "/a/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0");
            assert_string_equal(
                problem.faults[0].detail,
                "line 1, column 38: objects and arrays are nested more than 32 deep");
        }
    }
    assert_int_equal(survive_text("{\"title\": \"[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\\\"[[[\"}"),
                     STATUS_INVALID);
}

TEST(deep_duplicates_are_told_by_pointer) {
    assert_int_equal(
        survive_text("{\"a\": [1, {\"b/c\": {\"x\": [0, 1],\n \"\\u00fc\": 1, \"\xC3\xBC\": 2}}]}"),
        STATUS_UNREADABLE);
    assert_string_equal(problem.faults[0].pointer, "/a/1/b~1c/\xC3\xBC");
    assert_string_equal(problem.faults[0].detail,
                        "line 2, column 17: the key occurs twice in its object");
}

TEST(long_texts_are_cut_in_the_answer) {
    enum { LONG = 1 << 20 };
    Bytes text = {0};
    bytes_text(&text, "{\"");
    for (int i = 0; i < LONG / 2; i++)
        bytes_text(&text, "\xC3\xBC");
    bytes_text(&text, "\": \"");
    for (int i = 0; i < LONG / 2; i++)
        bytes_text(&text, "\xC3\xBC");
    bytes_text(&text, "\", \"title\": 5}");
    assert_int_equal(survive(text.at, text.count), STATUS_INVALID);
    assert_string_equal(problem.faults[1].pointer, "/title");
    // The same where the parser fails within.
    text.at[text.count - 2] = 'x';
    assert_int_equal(survive(text.at, text.count), STATUS_UNREADABLE);
    assert_int_equal(survive(text.at, LONG / 2), STATUS_UNREADABLE);
    assert_true(strlen(problem.faults[0].pointer) < sizeof problem.faults[0].pointer);
    bytes_clear(&text);
}

// Runs within a bound that only a quadratic or worse reader misses.
static void check_time(const Bytes *text, Status expected, double seconds) {
    const int64_t started = clock_thread_cpu_ns();
    assert_false(text->is_failed);
    assert_int_equal(survive(text->at, text->count), expected);
    const double taken = (double)(clock_thread_cpu_ns() - started) * 1e-9;
    if (taken > seconds * SLOWDOWN)
        fail_msg("took %.2f s", taken);
}

TEST(many_keys_take_little_time) {
    Bytes text = {0};
    // As many as one object may have, in many objects.
    bytes_text(&text, "{\"dampers\": [");
    for (int object = 0; object < 32; object++) {
        bytes_text(&text, object > 0 ? ", {\"mass\": 1" : "{\"mass\": 1");
        for (int i = 1; i < 4096; i++)
            bytes_format(&text, ", \"key_number_%d\": \"%d\"", i, i);
        bytes_text(&text, "}");
    }
    bytes_text(&text, "]}");
    check_time(&text, STATUS_INVALID, 1);
    // Structure, duration, sample_rate and 32 clearances are missing.
    assert_int_equal(problem.count, 32 * 4095 + 3 + 32);
    bytes_clear(&text);
}

TEST(more_keys_than_any_object_has_are_refused_before_they_are_parsed) {
    Bytes text = {0};
    bytes_text(&text, "{\"structure\": {\"mass\": 1");
    for (int i = 1; i < 4096; i++)
        bytes_format(&text, ", \"%d\": 1", i);
    bytes_text(&text, "}}");
    assert_int_equal(survive(text.at, text.count), STATUS_INVALID);
    text.count -= 2;
    bytes_text(&text, ", \"4096\": 1}}");
    assert_int_equal(survive(text.at, text.count), STATUS_UNREADABLE);
    assert_string_equal(problem.faults[0].pointer, "/structure/4095");
    assert_non_null(strstr(problem.faults[0].detail, "more than 4096 members in one object"));
    bytes_clear(&text);
}

TEST(many_containers_are_refused) {
    Bytes text = {0};
    bytes_text(&text, "{\"a\": [");
    for (int i = 0; i < 5000000; i++)
        bytes_put(&text, "{},", 3);
    bytes_text(&text, "{}]}");
    check_time(&text, STATUS_UNREADABLE, 1);
    assert_string_equal(problem.faults[0].pointer, "/a/131070");
    bytes_clear(&text);
}

TEST(many_wrong_elements_take_little_time) {
    Bytes text = {0};
    bytes_text(&text, "{\"excitation\": {\"kind\": \"record\", \"interval\": 1, \"samples\": [0");
    for (int i = 0; i < 500000; i++)
        bytes_put(&text, ",null", 5);
    bytes_text(&text, "]}}");
    check_time(&text, STATUS_INVALID, 2);
    assert_string_equal(problem.faults[0].pointer, "/excitation/samples/1");
    assert_int_equal(problem.count, 500000 + 3);
    bytes_clear(&text);
}

TEST(four_million_numbers_are_read) {
    Bytes text = {0};
    bytes_text(&text, "{\"excitation\": {\"kind\": \"record\", \"interval\": 1, \"samples\": [0");
    for (int i = 1; i < 4000000; i++)
        bytes_format(&text, ",%d.%d", i % 7, i % 10);
    bytes_text(&text, "]}}");
    check_time(&text, STATUS_INVALID, 5);
    assert_int_equal(problem.count, 3);
    bytes_clear(&text);
}

static size_t requests_left; // until one fails

static void *fail_once(size_t size) {
    return requests_left-- == 0 ? NULL : malloc(size);
}

// At whichever request memory runs out: never a fault of the text.
static void fail_each_request_of(const char *text) {
    static Problem memory_problem;
    const Field fields[] = {FIELD_END};
    char item;
    const Status whole = json_parse(text, strlen(text), fields, &item, &memory_problem);
    assert_int_equal(whole, STATUS_INVALID);
    Status status = STATUS_NO_MEMORY;
    size_t count = 0;
    json_memory_source = fail_once;
    for (; status == STATUS_NO_MEMORY; count++) {
        problem_clear(&memory_problem);
        requests_left = count;
        status = json_parse(text, strlen(text), fields, &item, &memory_problem);
    }
    json_memory_source = malloc;
    assert_int_equal(status, whole);
    assert_true(count > 4);
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
