// What is written, and that reading it back gives an equal struct; problem documents.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "core/base/canonical.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "tests/support/test.h"
#include "tests/support/whole.h"

static void read_whole(Whole *whole, const char *text) {
    Problem problem = {0};
    if (json_parse(text, strlen(text), whole_fields, whole, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
}

static void take(void *context, const void *bytes, size_t size) {
    bytes_put(context, bytes, size);
}

static const char *const documents[] = {
    "{}",
    "{\"extra\": null}",
    "{\"extra\": {\"names\": []}, \"channels\": [], \"parts\": [{}]}",
    "{\"offset\": -1, \"mass\": 0.1, \"slope\": 1e-300, \"steps\": 12, \"storey\": "
    "9007199254740993,"
    " \"is_open\": false, \"title\": \"\\\"\\u0007\\u00fc\\ud834\\udd1e\", \"rule\": "
    "\"zero_force\","
    " \"samples\": [0.1, -3, 5e-324], \"labels\": {\"a\": \"b\"}, \"left\": \"sponge\","
    " \"right\": {\"material\": \"x\", \"stiffness\": 1e22, \"damping\": 0},"
    " \"parts\": [{\"stiffness\": 3}, {\"material\": \"m\"}, {}],"
    " \"shape\": {\"shape\": \"square\", \"sides\": [1, 2]}, \"spare\": {\"radius\": 1.5}}",
};

TEST(reading_back_gives_an_equal_struct) {
    for (size_t i = 0; i < COUNT(documents); i++) {
        Whole whole, again;
        Bytes text = {0}, second = {0}, canonical = {0}, expected = {0};
        read_whole(&whole, documents[i]);
        encode_item(&text, whole_fields, &whole, WRITE_SCENE);
        read_whole(&again, text.at);
        canonical_write(whole_fields, &whole, take, &expected);
        canonical_write(whole_fields, &again, take, &canonical);
        assert_int_equal(canonical.count, expected.count);
        assert_memory_equal(canonical.at, expected.at, expected.count);
        // Notes are in no canonical form; the second text has them.
        encode_item(&second, whole_fields, &again, WRITE_SCENE);
        assert_string_equal(second.at, text.at);
        fields_clear(whole_fields, &whole);
        fields_clear(whole_fields, &again);
        bytes_clear(&text);
        bytes_clear(&second);
        bytes_clear(&canonical);
        bytes_clear(&expected);
    }
}

TEST(scenes_leave_out_what_is_absent) {
    Whole whole;
    Bytes text = {0};
    read_whole(&whole, "{\"mass\": 2, \"right\": \"sponge\"}");
    encode_item(&text, whole_fields, &whole, WRITE_SCENE);
    assert_string_equal(
        text.at, "{\"offset\": 0.25, \"mass\": 2, \"steps\": 7, \"is_open\": true,"
                 " \"rule\": \"zero_penetration\", \"channels\": [\"velocity\", \"displacement\"],"
                 " \"right\": {\"material\": \"sponge\", \"damping\": 0.5},"
                 " \"extra\": {\"names\": [\"one\"], \"rule\": \"zero_force\"},"
                 " \"parts\": [], \"shape\": {\"shape\": \"round\", \"offset\": 0.25}}");
    bytes_clear(&text);
    fields_clear(whole_fields, &whole);
}

TEST(reports_write_null_for_what_is_absent) {
    Whole whole;
    Bytes text = {0};
    read_whole(&whole, "{\"extra\": null, \"samples\": [1, 2.5], \"spare\": {}}");
    whole.slope = INFINITY;
    encode_item(&text, whole_fields, &whole, WRITE_REPORT);
    assert_string_equal(
        text.at,
        "{\"offset\": 0.25, \"mass\": null, \"slope\": null, \"steps\": 7, \"storey\": null,"
        " \"is_open\": true, \"title\": null, \"rule\": \"zero_penetration\","
        " \"samples\": [1,2.5], \"channels\": [\"velocity\", \"displacement\"], \"labels\": [],"
        " \"left\": null, \"right\": null, \"extra\": null, \"parts\": [],"
        " \"shape\": {\"shape\": \"round\", \"offset\": 0.25, \"radius\": null},"
        " \"spare\": {\"shape\": \"round\", \"offset\": 0.25, \"radius\": null}}");
    bytes_clear(&text);
    fields_clear(whole_fields, &whole);
}

TEST(a_fact_that_may_be_unknown_has_three_values) {
    typedef struct Fact {
        int holds;
    } Fact;
    static const Field fields[] = {FIELD_FLAG_OR_NULL(Fact, holds, "a fact"), FIELD_END};
    static const char *const texts[] = {"{\"holds\": null}", "{\"holds\": false}",
                                        "{\"holds\": true}"};
    for (int i = 0; i < 3; i++) {
        Problem problem = {0};
        Fact fact;
        Bytes text = {0};
        const char *text_in = i == 0 ? "{}" : texts[i];
        assert_int_equal(json_parse(text_in, strlen(text_in), fields, &fact, &problem), STATUS_OK);
        assert_int_equal(fact.holds, i == 0 ? CHOICE_ABSENT : i - 1);
        encode_item(&text, fields, &fact, WRITE_REPORT);
        assert_string_equal(text.at, texts[i]);
        bytes_clear(&text);
    }
    Problem problem = {0};
    Fact fact;
    static const char wrong[] = "{\"holds\": \"true\"}";
    assert_int_equal(json_parse(wrong, strlen(wrong), fields, &fact, &problem), STATUS_INVALID);
}

TEST(members_stand_beside_others) {
    Round round = {{&shape_round}, {0.5}, 2};
    Bytes text = {0};
    assert_int_equal(encode_members(&text, shape_round.fields, &round, WRITE_SCENE), 2);
    assert_string_equal(text.at, "\"offset\": 0.5, \"radius\": 2");
    bytes_clear(&text);
    encode_list(&text, shape_round.fields, &round, 1, sizeof round, WRITE_SCENE);
    assert_string_equal(text.at, "[{\"offset\": 0.5, \"radius\": 2}]");
    bytes_clear(&text);
    encode_list(&text, shape_round.fields, NULL, 0, sizeof round, WRITE_SCENE);
    assert_string_equal(text.at, "[]");
    bytes_clear(&text);
}

TEST(a_full_buffer_only_fails) {
    Whole whole;
    read_whole(&whole, documents[3]);
    for (size_t most = 1; most < 400; most += 13) {
        Bytes text = {.most = most};
        encode_item(&text, whole_fields, &whole, WRITE_SCENE);
        assert_true(text.is_failed);
    }
    fields_clear(whole_fields, &whole);
}

TEST(problems_are_problem_documents) {
    Problem problem = {0};
    const Fault mass = {.pointer = "/structure/mass",
                        .detail = "must be above 0 kg, is -1",
                        .value = "-1",
                        .unit = "kg"};
    const Fault key = {.pointer = "/structur",
                       .detail = "unknown key",
                       .did_you_mean = "structure",
                       .row = 3,
                       .column = "name"};
    problem_add_fault(&problem, STATUS_INVALID, &mass);
    Bytes text = {0};
    encode_problem(&text, &problem, 422, NULL);
    assert_string_equal(
        text.at, "{\"type\": \"/problems/invalid-scene\", \"title\": \"The scene has 1 fault\","
                 " \"status\": 422, \"detail\": \"/structure/mass: must be above 0 kg, is -1\","
                 " \"errors\": [{\"pointer\": \"/structure/mass\", \"value\": -1,"
                 " \"detail\": \"must be above 0 kg, is -1\", \"unit\": \"kg\"}]}");
    bytes_clear(&text);
    problem_add_fault(&problem, STATUS_INVALID, &key);
    encode_problem(&text, &problem, 422, "/v1/jobs");
    assert_string_equal(
        text.at, "{\"type\": \"/problems/invalid-scene\", \"title\": \"The scene has 2 faults\","
                 " \"status\": 422, \"detail\": \"/structure/mass: must be above 0 kg, is -1\","
                 " \"instance\": \"/v1/jobs\","
                 " \"errors\": [{\"pointer\": \"/structure/mass\", \"value\": -1,"
                 " \"detail\": \"must be above 0 kg, is -1\", \"unit\": \"kg\"},"
                 " {\"pointer\": \"/structur\", \"value\": null, \"detail\": \"unknown key\","
                 " \"did_you_mean\": \"structure\", \"row\": 3, \"column\": \"name\"}]}");
    bytes_clear(&text);
    problem_clear(&problem);
    problem.whose = "material";
    problem_add(&problem, STATUS_INVALID, "/name", "is required");
    encode_problem(&text, &problem, 422, NULL);
    assert_string_equal(
        text.at, "{\"type\": \"/problems/bad-request\", \"title\": \"The material has 1 fault\","
                 " \"status\": 422, \"detail\": \"/name: is required\","
                 " \"errors\": [{\"pointer\": \"/name\", \"value\": null,"
                 " \"detail\": \"is required\"}]}");
    bytes_clear(&text);
    problem_clear(&problem);
    problem_set(&problem, STATUS_NOT_FOUND, "no job \"%s\"", "j-1");
    encode_problem(&text, &problem, 404, "/v1/jobs/j-1");
    assert_string_equal(text.at, "{\"type\": \"/problems/not-found\", \"title\": \"Not found\","
                                 " \"status\": 404, \"detail\": \"no job \\\"j-1\\\"\","
                                 " \"instance\": \"/v1/jobs/j-1\"}");
    bytes_clear(&text);
}

TEST(faults_past_the_hundredth_are_counted) {
    Bytes document = {0}, text = {0};
    bytes_text(&document, "{\"samples\": [");
    for (int i = 0; i < 50; i++)
        bytes_text(&document, i > 0 ? ", \"\\u00fc\\\"\"" : "\"\"");
    bytes_text(&document, "]");
    for (int i = 0; i < 200; i++)
        bytes_format(&document, ", \"key%d\": %d", i, i);
    bytes_text(&document, "}");
    Problem problem = {0};
    Whole whole;
    assert_int_equal(json_parse(document.at, document.count, whole_fields, &whole, &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 250);
    encode_problem(&text, &problem, 422, NULL);
    json_t *parsed = json_loadb(text.at, text.count, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(parsed);
    assert_string_equal(json_string_value(json_object_get(parsed, "title")),
                        "The scene has 250 faults");
    assert_int_equal(json_integer_value(json_object_get(parsed, "more")), 150);
    const json_t *errors = json_object_get(parsed, "errors");
    assert_int_equal(json_array_size(errors), 100);
    assert_string_equal(json_string_value(json_object_get(json_array_get(errors, 49), "value")),
                        "\xC3\xBC\"");
    json_decref(parsed);
    fields_clear(whole_fields, &whole);
    bytes_clear(&document);
    bytes_clear(&text);
}
