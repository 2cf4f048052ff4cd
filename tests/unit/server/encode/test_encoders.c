// The formats to the letter, on tables small enough to read; tests/contract/test_encoders.py reads
// large ones back with numpy.
#include "server/encode/encoding.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/status.h"
#include "server/encode/buckets.h"
#include "server/encode/mat.h"

enum { ROWS = 5000 };

static double displacement[ROWS], force[ROWS], frequency[ROWS];
static Column column[2] = {{"displacement", "m", displacement}, {"contact_force", "N", force}};
static const Column *const both[] = {&column[0], &column[1]};

static int fill(void **state) {
    (void)state;
    for (size_t i = 0; i < ROWS; i++) {
        displacement[i] = (double)i / 8;
        force[i] = -(double)i;
        frequency[i] = (double)i * 0.5;
    }
    force[51] = NAN;
    return 0;
}

static Table series(size_t first, size_t count) {
    return (Table){.axis_name = "time",
                   .axis_unit = "s",
                   .axis_rate = 1000,
                   .first = first,
                   .count = count,
                   .columns = both,
                   .column_count = 2};
}

static Table over_frequency(size_t first, size_t count) {
    Table table = series(first, count);
    table.axis_name = "frequency";
    table.axis_unit = "Hz";
    table.axis = frequency;
    return table;
}

static void assert_text(const char *extension, Table table, const char *expected) {
    Bytes bytes = {0};
    assert_int_equal(encoding_write(encoder_find(extension), &table, &bytes, NULL), STATUS_OK);
    assert_false(bytes.is_failed);
    assert_string_equal(bytes.at, expected);
    assert_int_equal(bytes.count, strlen(expected));
    bytes_clear(&bytes);
}

static void json_has_rate_start_count_and_channels(void **state) {
    (void)state;
    assert_text("json", series(50, 3),
                "{\"sample_rate\": 1000, \"start\": 0.05, \"count\": 3, \"channels\": {"
                "\"displacement\": {\"unit\": \"m\", \"values\": [6.25,6.375,6.5]}, "
                "\"contact_force\": {\"unit\": \"N\", \"values\": [-50,null,-52]}}}\n");
    Table none = series(0, 0);
    none.column_count = 0;
    assert_text("json", none,
                "{\"sample_rate\": 1000, \"start\": 0, \"count\": 0, \"channels\": {}}\n");
}

static void json_over_an_axis_carries_the_axis(void **state) {
    (void)state;
    Table table = over_frequency(2, 2);
    table.column_count = 1;
    assert_text("json", table,
                "{\"count\": 2, \"frequency\": {\"unit\": \"Hz\", \"values\": [1,1.5]}, "
                "\"channels\": {\"displacement\": {\"unit\": \"m\", \"values\": [0.25,0.375]}}}\n");
}

static void csv_has_a_header_with_units_and_short_times(void **state) {
    (void)state;
    assert_text("csv", series(49, 3),
                "time [s],displacement [m],contact_force [N]\n"
                "0.049,6.125,-49\n"
                "0.05,6.25,-50\n"
                "0.051,6.375,nan\n");
    assert_text("csv", over_frequency(1, 2),
                "frequency [Hz],displacement [m],contact_force [N]\n0.5,0.125,-1\n1,0.25,-2\n");
    assert_text("csv", series(0, 0), "time [s],displacement [m],contact_force [N]\n");
}

static void npy_has_its_header_and_columns_as_they_lie_in_memory(void **state) {
    (void)state;
    const Table table = series(50, 4500);
    Bytes bytes = {0};
    assert_int_equal(encoding_write(encoder_find("npy"), &table, &bytes, NULL), STATUS_OK);
    const size_t header = 128;
    assert_int_equal(bytes.count, header + 4500 * 3 * 8);
    assert_memory_equal(bytes.at, "\x93NUMPY\x01\x00\x76\x00", 10);
    const char *text = "{'descr': '<f8', 'fortran_order': True, 'shape': (4500, 3), }";
    assert_memory_equal(bytes.at + 10, text, strlen(text));
    for (size_t i = 10 + strlen(text); i + 1 < header; i++)
        assert_int_equal(bytes.at[i], ' ');
    assert_int_equal(bytes.at[header - 1], '\n');
    double time;
    memcpy(&time, bytes.at + header, sizeof time);
    assert_true(time == 0.05);
    memcpy(&time, bytes.at + header + 4499 * 8, sizeof time);
    assert_true(time == 4549 / 1000.0);
    assert_memory_equal(bytes.at + header + 4500 * 8, displacement + 50, 4500 * 8);
    assert_memory_equal(bytes.at + header + 9000 * 8, force + 50, 4500 * 8);
    bytes_clear(&bytes);
}

static void a_full_buffer_fails_and_stays_empty(void **state) {
    (void)state;
    for (size_t e = 0; encoders[e] != NULL; e++)
        for (size_t most = 1; most < 40000; most = most * 3 + 1) {
            const Table table = series(0, ROWS);
            Bytes bytes = {.most = most};
            assert_int_equal(encoding_write(encoders[e], &table, &bytes, NULL), STATUS_OK);
            assert_true(bytes.is_failed);
            assert_int_equal(bytes.count, 0);
            bytes_clear(&bytes);
        }
}

static void formats_are_found_by_extension_and_json_is_first(void **state) {
    (void)state;
    assert_string_equal(encoders[0]->extension, "json");
    for (size_t i = 0; encoders[i] != NULL; i++) {
        assert_ptr_equal(encoder_find(encoders[i]->extension), encoders[i]);
        assert_non_null(strchr(encoders[i]->content_type, '/'));
    }
    assert_true(encoder_find("npy")->is_binary);
    assert_false(encoder_find("csv")->is_binary);
    assert_null(encoder_find("xml"));
    assert_null(encoder_find(""));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_rate_start_count_and_channels),
        cmocka_unit_test(json_over_an_axis_carries_the_axis),
        cmocka_unit_test(csv_has_a_header_with_units_and_short_times),
        cmocka_unit_test(npy_has_its_header_and_columns_as_they_lie_in_memory),
        cmocka_unit_test(a_full_buffer_fails_and_stays_empty),
        cmocka_unit_test(formats_are_found_by_extension_and_json_is_first),
    };
    return cmocka_run_group_tests(tests, fill, NULL);
}
