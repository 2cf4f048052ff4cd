// The schema of a struct with every kind of row, member by member.
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "server/json/schema.h"
#include "tests/support/test.h"
#include "tests/support/whole.h"

// What the schema says at a path of member names and indices, as compact JSON.
static void check(const json_t *at, const char *path, const char *expected) {
    char part[64];
    for (const char *rest = path; *rest != '\0';) {
        const size_t length = strcspn(rest, "/");
        assert_true(length < sizeof part);
        memcpy(part, rest, length);
        part[length] = '\0';
        at = json_is_array(at) ? json_array_get(at, (size_t)(part[0] - '0'))
                               : json_object_get(at, part);
        rest += length + (rest[length] == '/');
    }
    char *text = json_dumps(at, JSON_COMPACT | JSON_ENCODE_ANY);
    if (text == NULL || strcmp(text, expected) != 0)
        fail_msg("%s is %s", path, text != NULL ? text : "missing");
    free(text);
}

TEST(every_kind_of_row_has_its_schema) {
    Bytes bytes = {0};
    schema_write(&bytes, "/schemas/whole", "A whole", whole_fields);
    assert_int_equal(bytes.at[bytes.count - 1], '\n');
    json_t *schema = json_loadb(bytes.at, bytes.count, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(schema);
    check(schema, "$schema", "\"https://json-schema.org/draft/2020-12/schema\"");
    check(schema, "$id", "\"/schemas/whole\"");
    check(schema, "title", "\"A whole\"");
    check(schema, "required", "[\"mass\"]");
    check(schema, "additionalProperties", "false");
    const json_t *rows = json_object_get(schema, "properties");
    assert_int_equal(json_object_size(rows), 17);
    check(rows, "offset",
          "{\"description\":\"where it stands\",\"type\":\"number\",\"minimum\":-1,\"maximum\":1,"
          "\"default\":0.25,\"x-unit\":\"m\"}");
    check(rows, "mass",
          "{\"description\":\"mass of it\",\"type\":\"number\",\"exclusiveMinimum\":0,"
          "\"x-unit\":\"kg\"}");
    check(rows, "slope", "{\"description\":\"any number\",\"type\":\"number\"}");
    check(rows, "steps",
          "{\"description\":\"how many\",\"type\":\"integer\",\"minimum\":1,\"maximum\":1000000,"
          "\"default\":7,\"x-unit\":\"steps\"}");
    check(rows, "is_open", "{\"description\":\"a fact\",\"type\":\"boolean\",\"default\":true}");
    check(rows, "title", "{\"description\":\"for people\",\"type\":\"string\",\"maxLength\":20}");
    check(rows, "rule",
          "{\"description\":\"when it ends\",\"enum\":[\"zero_penetration\",\"zero_force\"],"
          "\"default\":\"zero_penetration\"}");
    check(rows, "samples/items", "{\"type\":\"number\",\"minimum\":-10,\"maximum\":10}");
    check(rows, "samples/maxItems", "50");
    check(rows, "channels/items/enum", "[\"displacement\",\"velocity\",\"acceleration\"]");
    check(rows, "channels/default", "[\"velocity\",\"displacement\"]");
    check(rows, "labels/anyOf/1",
          "{\"type\":\"object\",\"additionalProperties\":{\"type\":\"string\"},"
          "\"maxProperties\":4}");
    check(rows, "left/anyOf/0/properties/damping/default", "0.5");
    check(rows, "left/anyOf/1",
          "{\"type\":\"string\",\"maxLength\":12,\"description\":\"where it comes from\"}");
    check(rows, "extra/anyOf/1", "{\"type\":\"null\"}");
    check(rows, "extra/default", "{}");
    check(rows, "parts/items/required", "[]");
    check(rows, "parts/default", "[]");
    check(rows, "shape/oneOf/0/required", "[\"radius\"]");
    check(rows, "shape/oneOf/0/properties/shape", "{\"const\":\"round\"}");
    check(rows, "shape/oneOf/1/required", "[\"shape\"]");
    check(rows, "shape/default", "{\"shape\":\"round\"}");
    assert_null(json_object_get(json_object_get(rows, "spare"), "default"));
    json_decref(schema);
    bytes_clear(&bytes);
}
