// Members put into documents of people's, and taken out of them.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/codec/amend.h"

static Bytes of(const char *text) {
    Bytes bytes = {0};
    bytes_text(&bytes, text);
    return bytes;
}

static void becomes(Status (*change)(Bytes *, const char *, const Bytes *, Problem *),
                    const char *before, const char *name, const char *json, const char *after) {
    Bytes text = of(before), value = of(json);
    assert_int_equal(change(&text, name, &value, NULL), STATUS_OK);
    assert_string_equal(text.at != NULL ? text.at : "", after);
    bytes_clear(&text);
    bytes_clear(&value);
}

static void members_are_set_and_lists_grow(void **state) {
    (void)state;
    becomes(amend_set, "{\"a\": 1}", "comment", "\"x \\\" y\"",
            "{\"a\":1,\"comment\":\"x \\\" y\"}");
    becomes(amend_set, "\xEF\xBB\xBF{\"comment\": 0.5}", "comment", "\"b\"", "{\"comment\":\"b\"}");
    becomes(amend_append, "{}", "traces", "{\"force\": [1, 0.5]}",
            "{\"traces\":[{\"force\":[1,0.5]}]}");
    becomes(amend_append, "{\"traces\": [1]}", "traces", "2", "{\"traces\":[1,2]}");
}

static void what_is_no_object_is_left_to_its_judge(void **state) {
    (void)state;
    static const char *const texts[] = {"", "[1]", "{", "{\"a\": 1, \"a\": 2}"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        becomes(amend_set, texts[i], "comment", "1", texts[i]);
        becomes(amend_append, texts[i], "traces", "1", texts[i]);
    }
    becomes(amend_append, "{\"traces\":{}}", "traces", "1", "{\"traces\":{}}");
    Bytes text = of("{}"), value = of("\"\xFF\"");
    assert_int_equal(amend_set(&text, "comment", &value, NULL), STATUS_INVALID);
    assert_string_equal(text.at, "{}");
    bytes_clear(&text);
    bytes_clear(&value);
}

static void parts_are_taken_out(void **state) {
    (void)state;
    Bytes text = of("{\"revision\": {\"e\": 0.5, \"n\": null}, \"b\": 1}"), part = {0};
    assert_int_equal(amend_take(&text, "revision", &part, NULL), STATUS_OK);
    assert_string_equal(part.at, "{\"e\":0.5,\"n\":null}");
    assert_int_equal(amend_take(&text, "b", &part, NULL), STATUS_NOT_FOUND);
    assert_int_equal(amend_take(&text, "c", &part, NULL), STATUS_NOT_FOUND);
    bytes_clear(&part);
    bytes_clear(&text);
}

static void nulls_are_dropped_at_any_depth(void **state) {
    (void)state;
    Bytes text = of("{\"a\": null, \"b\": [{\"c\": null, \"d\": 1}, {}], \"e\": {\"f\": null}}");
    assert_int_equal(amend_known(&text, NULL), STATUS_OK);
    assert_string_equal(text.at, "{\"b\":[{\"d\":1},{}],\"e\":{}}");
    bytes_clear(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(members_are_set_and_lists_grow),
        cmocka_unit_test(what_is_no_object_is_left_to_its_judge),
        cmocka_unit_test(parts_are_taken_out),
        cmocka_unit_test(nulls_are_dropped_at_any_depth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
