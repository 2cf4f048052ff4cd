// Members set in documents of people, and parts extracted from them.
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "server/json/document.h"
#include "tests/support/test.h"

static Bytes of(const char *text) {
    Bytes bytes = {0};
    bytes_text(&bytes, text);
    return bytes;
}

// Both strings for json_edit_set; a label; a list and what is appended to it.
static void becomes(const char *before, const char *name, const char *value, const char *after) {
    Bytes text = of(before), item = of(value);
    if (strcmp(name, "label") == 0)
        assert_int_equal(json_edit_label(&text, value, NULL), STATUS_OK);
    else if (strcmp(name, "traces") == 0)
        assert_int_equal(json_edit_append(&text, name, &item, NULL), STATUS_OK);
    else
        assert_int_equal(json_edit_set(&text, name, value, NULL), STATUS_OK);
    assert_string_equal(text.at != NULL ? text.at : "", after);
    bytes_clear(&text);
    bytes_clear(&item);
}

TEST(members_are_set_and_lists_grow) {
    becomes("{\"a\": 1}", "comment", "x \" y", "{\"a\":1,\"comment\":\"x \\\" y\"}");
    becomes("\xEF\xBB\xBF{\"comment\": 0.5}", "comment", "b", "{\"comment\":\"b\"}");
    becomes("{}", "traces", "{\"force\": [1, 0.5]}", "{\"traces\":[{\"force\":[1,0.5]}]}");
    becomes("{\"traces\": [1]}", "traces", "2", "{\"traces\":[1,2]}");
    becomes("{}", "label", "a=b=c", "{\"labels\":{\"a\":\"b=c\"}}");
    becomes("{\"labels\": {\"a\": \"old\", \"z\": \"1\"}}", "label",
            "a=", "{\"labels\":{\"a\":\"\",\"z\":\"1\"}}");
    becomes("{\"labels\": [\"z=1\"]}", "label", "a=b", "{\"labels\":[\"z=1\",\"a=b\"]}");
}

TEST(what_is_no_object_stays_as_it_is) {
    static const char *const texts[] = {"", "[1]", "{", "nonsense", "{\"a\": 1, \"a\": 2}"};
    for (size_t i = 0; i < COUNT(texts); i++) {
        becomes(texts[i], "comment", "1", texts[i]);
        becomes(texts[i], "traces", "1", texts[i]);
        becomes(texts[i], "label", "a=b", texts[i]);
    }
    becomes("{\"traces\":{}}", "traces", "1", "{\"traces\":{}}");
    becomes("{\"labels\": 5}", "label", "a=b", "{\"labels\": 5}");
}

TEST(labels_are_pairs_and_all_is_utf8) {
    static const char *const wrong[] = {"a", "", "=b", "a=\xFF"};
    Bytes text = of("{}"), value = of("\"\xFF\"");
    for (size_t i = 0; i < COUNT(wrong); i++)
        assert_int_equal(json_edit_label(&text, wrong[i], NULL), STATUS_USAGE);
    assert_int_equal(json_edit_set(&text, "title", "\xFF", NULL), STATUS_USAGE);
    assert_int_equal(json_edit_append(&text, "traces", &value, NULL), STATUS_INVALID);
    assert_string_equal(text.at, "{}");
    bytes_clear(&text);
    bytes_clear(&value);
}

TEST(parts_are_extracted) {
    Bytes text = of("{\"revision\": {\"e\": 0.5, \"n\": null}, \"b\": 1}"), part = {0};
    assert_int_equal(json_edit_extract(&text, "revision", &part, NULL), STATUS_OK);
    assert_string_equal(part.at, "{\"e\":0.5,\"n\":null}");
    assert_int_equal(json_edit_extract(&text, "b", &part, NULL), STATUS_NOT_FOUND);
    assert_int_equal(json_edit_extract(&text, "c", &part, NULL), STATUS_NOT_FOUND);
    bytes_clear(&part);
    bytes_clear(&text);
}

TEST(nulls_are_removed_at_any_depth) {
    Bytes text = of("{\"a\": null, \"b\": [{\"c\": null, \"d\": 1}, {}], \"e\": {\"f\": null}}");
    assert_int_equal(json_edit_remove_nulls(&text, NULL), STATUS_OK);
    assert_string_equal(text.at, "{\"b\":[{\"d\":1},{}],\"e\":{}}");
    bytes_clear(&text);
}
