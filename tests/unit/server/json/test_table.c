// Tables of text, made of documents.
#include <stdlib.h>
#include <string.h>

#include "server/json/table.h"
#include "tests/support/test.h"

typedef struct Thing {
    double speed;
} Thing;
static const Field thing_fields[] = {
    FIELD_REAL(Thing, speed, "m/s", ANY, 0, "of it"),
    FIELD_END,
};

TEST(control_characters_are_replaced) {
    char text[] = "a\x1b[2J\x7f\xc2\x9bz \xc3\xa4";
    text_make_printable(text);
    assert_string_equal(text, "a?[2J???z \xc3\xa4");
    text_make_printable(NULL);
}

// What is printed of a document.
static Status printed(const char *json, char **text, size_t *longest) {
    static const char *const skipped[] = {"links", NULL};
    static const PrintTableColumns lists[] = {{"rows", {"b", "a", "c"}}, {NULL, {NULL}}};
    static const Field *const fields[] = {thing_fields, NULL};
    static const PrintTableView view = {skipped, lists, fields};
    size_t size;
    *text = NULL;
    FILE *file = open_memstream(text, &size);
    Bytes bytes = {0};
    *longest = 0;
    bytes_text(&bytes, json);
    const Status status =
        print_table_print_json(&bytes, &view, (PrintTableForm){.width = 0}, file, longest, NULL);
    fclose(file);
    bytes_clear(&bytes);
    return status;
}

TEST(numbers_stand_to_the_right_and_unknown_cells_are_marked) {
    char *text;
    size_t longest;
    assert_int_equal(printed("{\"rows\": [{\"b\": \"\xc3\xa4\", \"c\": \"x\"}, {\"b\": \"bb\", "
                             "\"a\": 12.5}]}",
                             &text, &longest),
                     STATUS_OK);
    assert_string_equal(text, "b      a  c\n"
                              "\xc3\xa4      -  x\n"
                              "bb  12.5  -\n");
    free(text);
}

TEST(text_that_is_not_an_object_is_refused_and_a_long_list_is_cut) {
    static const char *const texts[] = {"", "[1]", "{", "{\"a\": 1, \"a\": 2}"};
    char *text;
    size_t longest;
    for (size_t i = 0; i < COUNT(texts); i++) {
        assert_int_equal(printed(texts[i], &text, &longest), STATUS_UNREACHABLE);
        assert_string_equal(text, "");
        free(text);
    }
    static char large[100000];
    size_t used = (size_t)snprintf(large, sizeof large, "{\"rows\": [{\"a\": 0}");
    for (int i = 1; i < 2100; i++)
        used += (size_t)snprintf(large + used, sizeof large - used, ", {\"a\": %d}", i);
    snprintf(large + used, sizeof large - used, "]}");
    assert_int_equal(printed(large, &text, &longest), STATUS_OK);
    assert_int_equal(longest, 2000);
    assert_non_null(strstr(text, "... and 100 more"));
    free(text);
}
