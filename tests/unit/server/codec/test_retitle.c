// Titles and labels put into a scene's text.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/codec/retitle.h"

static Status changed(const char *before, const char *title, size_t count, char **labels,
                      Bytes *text) {
    const Texts all = {labels, count};
    *text = (Bytes){0};
    bytes_text(text, before);
    return retitle(text, title, &all, NULL);
}

static void expect(const char *before, const char *title, size_t count, char **labels,
                   const char *after) {
    Bytes text;
    assert_int_equal(changed(before, title, count, labels, &text), STATUS_OK);
    assert_string_equal(text.at, after);
    bytes_clear(&text);
}

static void titles_and_labels_come_on_top_of_the_scene_s(void **state) {
    (void)state;
    char *labels[] = {"a=b=c", "d="};
    expect("{\"title\": \"x\", \"n\": 0.1}", "new \"one\"", 0, NULL,
           "{\"title\":\"new \\\"one\\\"\",\"n\":0.10000000000000001}");
    expect("\xEF\xBB\xBF{}", "new", 0, NULL, "{\"title\":\"new\"}");
    expect("{}", NULL, 2, labels, "{\"labels\":{\"a\":\"b=c\",\"d\":\"\"}}");
    expect("{\"labels\": {\"a\": \"old\", \"z\": \"1\"}}", NULL, 1, labels,
           "{\"labels\":{\"a\":\"b=c\",\"z\":\"1\"}}");
    expect("{\"labels\": [\"z=1\"]}", NULL, 1, labels, "{\"labels\":[\"z=1\",\"a=b=c\"]}");
}

static void without_either_not_a_byte_is_changed(void **state) {
    (void)state;
    expect("{ \"n\" : 1e0 }", NULL, 0, NULL, "{ \"n\" : 1e0 }");
}

static void what_is_no_scene_is_left_to_its_judge(void **state) {
    (void)state;
    char *labels[] = {"a=b"};
    static const char *const texts[] = {
        "[1]", "{", "{\"a\": 1, \"a\": 2}", "{\"labels\": 5}", "nonsense", "{\"a\": NaN}"};
    for (size_t i = 0; i < COUNT(texts); i++)
        expect(texts[i], "title", 1, labels, texts[i]);
}

static void labels_are_pairs_and_all_is_utf8(void **state) {
    (void)state;
    static char *const wrong[] = {"a", "", "=b"};
    Bytes text;
    for (size_t i = 0; i < COUNT(wrong); i++) {
        char *labels[] = {wrong[i]};
        assert_int_equal(changed("{}", NULL, 1, labels, &text), STATUS_USAGE);
        bytes_clear(&text);
    }
    assert_int_equal(changed("{}", "\xff", 0, NULL, &text), STATUS_USAGE);
    assert_string_equal(text.at, "{}");
    bytes_clear(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(titles_and_labels_come_on_top_of_the_scene_s),
        cmocka_unit_test(without_either_not_a_byte_is_changed),
        cmocka_unit_test(what_is_no_scene_is_left_to_its_judge),
        cmocka_unit_test(labels_are_pairs_and_all_is_utf8),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
