// What a document says of two things.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/base/bytes.h"
#include "server/codec/pairs.h"

static void every_object_with_both_sides_is_a_row(void **state) {
    (void)state;
    static const char text[] =
        "{\"a\": {\"id\": \"r-1\", \"links\": {\"self\": \"/x\"}}, \"b\": {}, \"metrics\": "
        "{\"peak\": {\"a\": 1, \"b\": 2.5, \"unit\": \"m\", "
        "\"none\": null}}, \"inputs\": [{\"pointer\": \"/x\", \"a\": null, \"b\": [1, 2]}], "
        "\"psd\": {\"distance\": 3, \"values\": [1, 2]}, \"channels\": [{\"channel\": "
        "\"velocity\", "
        "\"rms\": 0.5, \"peak\": null}], \"more\": [{\"name\": \"buffer\", \"a\": {\"e\": 0.5}, "
        "\"b\": 1}]}";
    Pairs pairs;
    assert_int_equal(pairs_read(text, sizeof text - 1, &pairs, NULL), STATUS_OK);
    assert_int_equal(pairs.count, 6);
    assert_string_equal(pairs.at[0].name, "a/id");
    assert_null(pairs.at[0].b);
    assert_string_equal(pairs.at[1].name, "peak");
    assert_string_equal(pairs.at[1].a, "1");
    assert_string_equal(pairs.at[1].b, "2.5");
    assert_string_equal(pairs.at[1].rest, "unit m");
    assert_string_equal(pairs.at[2].name, "/x");
    assert_string_equal(pairs.at[2].a, "-");
    assert_string_equal(pairs.at[2].b, "[1,2]");
    assert_string_equal(pairs.at[3].name, "psd/distance");
    assert_string_equal(pairs.at[4].name, "channels/0");
    assert_string_equal(pairs.at[4].a, "channel velocity, rms 0.5");
    assert_string_equal(pairs.at[5].name, "buffer");
    assert_string_equal(pairs.at[5].a, "{\"e\":0.5}");
    pairs_clear(&pairs);
    assert_int_equal(pairs.count, 0);
}

static void a_list_is_a_table_of_the_members_that_are_asked_for(void **state) {
    (void)state;
    static const char text[] =
        "{\"rows\": [{\"name\": \"x\", \"rms\": 0.123456, \"more\": 1}, "
        "{\"rms\": null, \"name\": \"yyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyy\"}, "
        "7]}";
    static const char *const members[] = {"name", "rms", NULL};
    Listing listing;
    assert_int_equal(listing_read(text, sizeof text - 1, "rows", members, &listing, NULL),
                     STATUS_OK);
    assert_int_equal(listing.columns, 2);
    assert_int_equal(listing.rows, 3);
    assert_string_equal(listing.cells[0], "x");
    assert_string_equal(listing.cells[1], "0.1235");
    assert_int_equal(strlen(listing.cells[2]), LISTING_CELL - 1);
    assert_string_equal(listing.cells[3], "-");
    assert_string_equal(listing.cells[4], "-");
    listing_clear(&listing);
    assert_int_equal(listing_read(text, sizeof text - 1, "none", members, &listing, NULL),
                     STATUS_OK);
    assert_int_equal(listing.rows, 0);
    listing_clear(&listing);
    assert_int_equal(listing_read("[1]", 3, "rows", members, &listing, NULL), STATUS_UNREADABLE);
    listing_clear(&listing);
}

static void what_is_no_object_is_refused(void **state) {
    (void)state;
    static const char *const texts[] = {"", "[1]", "{", "1", "{\"a\": 1, \"a\": 2}"};
    Pairs pairs;
    for (size_t i = 0; i < COUNT(texts); i++) {
        assert_int_equal(pairs_read(texts[i], strlen(texts[i]), &pairs, NULL), STATUS_UNREADABLE);
        pairs_clear(&pairs);
    }
}

static void rows_are_bounded_and_long_texts_cut(void **state) {
    (void)state;
    Bytes text = {0};
    bytes_text(&text, "{\"rows\": [");
    for (int i = 0; i < 3 * PAIRS_MAX; i++)
        bytes_format(&text, "%s{\"a\": \"%01000d\", \"b\": %d}", i > 0 ? "," : "", i, i);
    bytes_text(&text, "]}");
    Pairs pairs;
    assert_int_equal(pairs_read(text.at, text.count, &pairs, NULL), STATUS_OK);
    assert_int_equal(pairs.count, PAIRS_MAX);
    assert_true(strlen(pairs.at[7].a) < PAIRS_TEXT);
    pairs_clear(&pairs);
    bytes_clear(&text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_object_with_both_sides_is_a_row),
        cmocka_unit_test(a_list_is_a_table_of_the_members_that_are_asked_for),
        cmocka_unit_test(what_is_no_object_is_refused),
        cmocka_unit_test(rows_are_bounded_and_long_texts_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
