// Documents as blocks for people.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/base/bytes.h"
#include "server/codec/outline.h"

typedef struct Item {
    double length, mass;
} Item;
// clang-format off
static const Field item_fields[] = {
    FIELD_REAL(Item, length, "m", ANY, OPTIONAL, "length"),
    FIELD_REAL(Item, mass, "kg", ANY, OPTIONAL, "mass"),
    FIELD_END,
};
// clang-format on
static const Field *const fields[] = {item_fields, NULL};
static const char *const besides[] = {"links", NULL};
static const OutlineTable tables[] = {{"chosen", {"b", "a"}}, {NULL, {NULL}}};
static const OutlineWay way = {besides, tables, fields};

static Outline good(const char *text) {
    Outline outline;
    assert_int_equal(outline_read(text, strlen(text), &way, &outline, NULL), STATUS_OK);
    return outline;
}

static void check(const Outline *outline, size_t block, const char *heading, size_t columns,
                  const char *const *cells) {
    assert_true(block < outline->count);
    const OutlineBlock *at = &outline->at[block];
    assert_string_equal(at->heading, heading);
    assert_int_equal(at->columns, columns);
    size_t count = 0;
    while (cells[count] != NULL)
        count++;
    assert_int_equal(at->rows * at->columns, count);
    for (size_t i = 0; i < count; i++)
        assert_string_equal(at->cells[i], cells[i]);
}

static void values_stand_under_their_names_with_units(void **state) {
    (void)state;
    Outline outline = good("{\"name\": \"x\", \"length\": 0.25, \"none\": null, \"empty\": \"\", "
                           "\"list\": [], \"count\": 12345678, \"is\": true, \"tags\": [\"a\", "
                           "\"b\"], \"links\": {\"self\": \"/x\"}}");
    static const char *const cells[] = {"name", "x",   "length", "0.25 m", "count", "12345678",
                                        "is",   "yes", "tags",   "a, b",   NULL};
    assert_int_equal(outline.count, 1);
    check(&outline, 0, "", 2, cells);
    outline_clear(&outline);
}

static void a_list_of_objects_is_a_table(void **state) {
    (void)state;
    Outline outline = good("{\"rows\": [{\"name\": \"x\", \"length\": 1, \"none\": null}, "
                           "{\"name\": \"y\", \"mass\": 2.5, \"links\": {}, \"is\": false}, 7], "
                           "\"chosen\": [{\"a\": 1, \"b\": \"two\", \"c\": {\"d\": 1}}]}");
    static const char *const all[] = {"name", "length [m]", "mass [kg]", "x", "1", "",  "y",
                                      "",     "2.5",        "",          "",  "",  NULL};
    static const char *const chosen[] = {"b", "a", "two", "1", NULL};
    assert_int_equal(outline.count, 2);
    assert_true(outline.at[0].has_heads);
    check(&outline, 0, "rows", 3, all);
    check(&outline, 1, "chosen", 2, chosen);
    outline_clear(&outline);
}

static void objects_that_are_alike_stand_side_by_side(void **state) {
    (void)state;
    Outline outline =
        good("{\"pair\": {\"length\": {\"mean\": 1, \"why\": null, \"trend\": {\"p\": 0.5}}, "
             "\"mass\": {\"mean\": 2, \"why\": \"a sentence that is longer than a cell of it is\", "
             "\"trend\": {\"p\": null}}}, \"other\": {\"z\": 1}}");
    static const char *const both[] = {" ", "length [m]", "mass [kg]", "mean", "1", "2", NULL};
    static const char *const why[] = {"mass why", "a sentence that is longer than a cell of it is",
                                      NULL};
    static const char *const trend[] = {"p", "0.5", NULL}, *const other[] = {"z", "1", NULL};
    assert_int_equal(outline.count, 4);
    check(&outline, 0, "pair", 3, both);
    check(&outline, 1, "pair", 2, why);
    check(&outline, 2, "pair length trend", 2, trend);
    check(&outline, 3, "other", 2, other);
    outline_clear(&outline);
}

static void items_with_parts_are_shown_one_by_one(void **state) {
    (void)state;
    Outline outline = good("{\"contacts\": [{\"rule\": \"a\", \"k\": {\"value\": 1}}, "
                           "{\"rule\": \"b\", \"k\": {\"value\": 2}}]}");
    static const char *const first[] = {"rule", "a", NULL}, *const value[] = {"value", "2", NULL};
    assert_int_equal(outline.count, 4);
    check(&outline, 0, "contacts 1", 2, first);
    check(&outline, 3, "contacts 2 k", 2, value);
    outline_clear(&outline);
}

static void what_is_no_object_is_refused(void **state) {
    (void)state;
    static const char *const texts[] = {"", "[]", "7", "{", "{\"a\": 1, \"a\": 2}", "null"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        Outline outline;
        assert_int_equal(outline_read(texts[i], strlen(texts[i]), &way, &outline, NULL),
                         STATUS_UNREADABLE);
        assert_int_equal(outline.count, 0);
    }
}

static void large_documents_are_cut_and_say_so(void **state) {
    (void)state;
    Bytes text = {0};
    bytes_text(&text, "{\"rows\": [{\"a\": 1}");
    for (int i = 0; i < 2500; i++)
        bytes_text(&text, ",{\"a\": 1}");
    bytes_text(&text, "]}");
    Outline outline = good(text.at);
    assert_int_equal(outline.at[0].rows, OUTLINE_ROWS + 1);
    assert_int_equal(outline.at[0].more, 501);
    assert_false(outline.is_cut);
    outline_clear(&outline);
    bytes_clear(&text);
    bytes_text(&text, "{\"o\": {}");
    for (int i = 0; i < 300; i++)
        bytes_format(&text, ",\"o%d\": {\"p%d\": 1}", i, i);
    bytes_text(&text, "}");
    outline = good(text.at);
    assert_int_equal(outline.count, OUTLINE_BLOCKS);
    assert_true(outline.is_cut);
    outline_clear(&outline);
    bytes_clear(&text);
    for (int i = 0; i < 20; i++)
        bytes_text(&text, "{\"o\":");
    bytes_text(&text, "1");
    for (int i = 0; i < 20; i++)
        bytes_text(&text, "}");
    outline = good(text.at);
    outline_clear(&outline);
    bytes_clear(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_stand_under_their_names_with_units),
        cmocka_unit_test(a_list_of_objects_is_a_table),
        cmocka_unit_test(objects_that_are_alike_stand_side_by_side),
        cmocka_unit_test(items_with_parts_are_shown_one_by_one),
        cmocka_unit_test(what_is_no_object_is_refused),
        cmocka_unit_test(large_documents_are_cut_and_say_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
