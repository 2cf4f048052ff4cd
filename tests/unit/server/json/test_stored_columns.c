// Stored spectra and impacts read back, and documents that are none.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/json/stored_columns.h"

static void spectra_read_back_with_the_frequency_first(void **state) {
    (void)state;
    Columns columns;
    assert_int_equal(
        stored_spectra("{\"method\": \"welch\", \"frequency\": {\"unit\": \"Hz\", "
                       "\"values\": [0, 0.1]}, \"channels\": {\"a\": {\"unit\": \"m\", "
                       "\"values\": [1e-300, null]}, \"b\": {\"unit\": \"s\", "
                       "\"values\": [2, 3]}}}",
                       &columns, NULL),
        STATUS_OK);
    assert_int_equal(columns.count, 3);
    assert_int_equal(columns.rows, 2);
    assert_string_equal(columns.at[0].name, "frequency");
    assert_string_equal(columns.at[2].unit, "s");
    assert_true(columns.at[0].values[1] == 0.1 && columns.at[1].values[0] == 1e-300);
    assert_true(isnan(columns.at[1].values[1]) && columns.at[2].values[1] == 3);
    columns_clear(&columns);
}

static void impacts_read_back_one_by_one(void **state) {
    (void)state;
    Impacts impacts;
    assert_int_equal(
        stored_impacts("{\"count\": 1, \"resting\": 1, \"impacts\": [{\"kind\": \"impact\", "
                       "\"start\": 0.1, \"end\": null, \"damper\": 2, \"side\": \"right\"}, "
                       "{\"kind\": \"resting\", \"start\": 1, \"of_another_engine\": 1}]}",
                       &impacts, NULL),
        STATUS_OK);
    assert_int_equal(impacts.count, 2);
    assert_true(impacts.at[0].start == 0.1 && isnan(impacts.at[0].end));
    assert_int_equal(impacts.at[0].damper, 2);
    assert_int_equal(impacts.at[1].kind, IMPACT_RESTING);
    free(impacts.at);
    assert_int_equal(
        stored_impacts("{\"count\": 0, \"resting\": 0, \"impacts\": []}", &impacts, NULL),
        STATUS_OK);
    assert_int_equal(impacts.count, 0);
    free(impacts.at);
}

#define HEAD "{\"count\": 2, \"resting\": 1, \"impacts\": ["
#define FIRST "\"kind\": \"impact\", \"start\": 1, \"end\": 1.5}"
#define RESTS "\"kind\": \"resting\", \"start\": 2, \"end\": null}"
#define LAST "\"kind\": \"impact\", \"start\": 3, \"end\": 3, \"peak_force\": null}"

static void a_window_of_impacts_stands_as_it_was_saved(void **state) {
    (void)state;
    static const char saved[] = HEAD "{" FIRST ", {" RESTS ", {" LAST "]}";
    static const struct {
        ImpactWindow window;
        bool is_numbered;
        const char *expected;
    } cases[] = {
        {{0, 9, 1, 9}, false, saved},
        {{1.5, 2, 1, 9}, false, HEAD "{" FIRST ", {" RESTS "]}"},
        // What rests until the end is met by every later window.
        {{2.5, 2.9, 1, 9}, true, HEAD "{\"number\": 2, " RESTS "], \"matching\": 1}"},
        {{0, 9, 2, 1}, true, HEAD "{\"number\": 2, " RESTS "], \"matching\": 3}"},
        {{3, 3, 3, 9}, true, HEAD "{\"number\": 3, " LAST "], \"matching\": 2}"},
        {{0, 0.5, 1, 9}, true, HEAD "], \"matching\": 0}"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        Bytes bytes = {.most = 1000};
        assert_int_equal(
            stored_impacts_window(saved, &cases[i].window, cases[i].is_numbered, &bytes, NULL),
            STATUS_OK);
        assert_string_equal(bytes.at, cases[i].expected);
        bytes_clear(&bytes);
    }
}

static void what_was_not_written_so_is_refused(void **state) {
    (void)state;
    static const char *const spectra[] = {
        "",
        "null",
        "[1]",
        "{\"frequency\": {\"unit\": \"Hz\", \"values\": [0]}}",
        "{\"frequency\": {\"unit\": \"Hz\", \"values\": []}, \"channels\": {\"a\": {}}}",
        "{\"frequency\": {\"values\": [0]}, \"channels\": {\"a\": {\"unit\": \"m\", \"values\": "
        "[1]}}}",
        "{\"frequency\": {\"unit\": \"Hz\", \"values\": [0]}, \"channels\": {\"a\": {\"unit\": "
        "\"m\", \"values\": [1, 2]}}}",
        "{\"frequency\": {\"unit\": \"Hz\", \"values\": [0]}, \"channels\": {\"a\": {\"unit\": "
        "\"m\", \"values\": [\"1\"]}}}",
    };
    static const char *const impacts[] = {
        "",
        "null",
        "{\"impacts\": [{\"kind\": \"impact\"",
        "{\"impacts\": [{\"kind\": \"blow\"}]}",
        "{\"impacts\": [{\"start\": {}}]}",
    };
    for (size_t i = 0; i < COUNT(spectra); i++) {
        Columns columns;
        assert_int_equal(stored_spectra(spectra[i], &columns, NULL), STATUS_INTERNAL);
        assert_null(columns.block);
    }
    for (size_t i = 0; i < COUNT(impacts); i++) {
        Impacts read;
        assert_int_equal(stored_impacts(impacts[i], &read, NULL), STATUS_INTERNAL);
        assert_null(read.at);
    }
    for (size_t i = 0; i < 3; i++) {
        Bytes bytes = {.most = 1000};
        assert_int_equal(
            stored_impacts_window(impacts[i], &(ImpactWindow){0, 9, 1, 9}, true, &bytes, NULL),
            STATUS_INTERNAL);
        bytes_clear(&bytes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spectra_read_back_with_the_frequency_first),
        cmocka_unit_test(impacts_read_back_one_by_one),
        cmocka_unit_test(a_window_of_impacts_stands_as_it_was_saved),
        cmocka_unit_test(what_was_not_written_so_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
