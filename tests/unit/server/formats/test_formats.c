// The formats to the letter, on tables small enough to read; tests/contract/test_encoders.py reads
// large ones back with numpy.
#include "server/formats/table_stream.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "tests/support/test.h"

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
    assert_int_equal(format_write(format_find(extension), &table, &bytes, NULL), STATUS_OK);
    assert_false(bytes.is_failed);
    assert_string_equal(bytes.at, expected);
    assert_int_equal(bytes.count, strlen(expected));
    bytes_clear(&bytes);
}

TEST(json_has_rate_start_count_and_channels) {
    assert_text("json", series(50, 3),
                "{\"sample_rate\": 1000, \"start\": 0.05, \"count\": 3, \"channels\": {"
                "\"displacement\": {\"unit\": \"m\", \"values\": [6.25,6.375,6.5]}, "
                "\"contact_force\": {\"unit\": \"N\", \"values\": [-50,null,-52]}}}\n");
    Table none = series(0, 0);
    none.column_count = 0;
    assert_text("json", none,
                "{\"sample_rate\": 1000, \"start\": 0, \"count\": 0, \"channels\": {}}\n");
}

TEST(json_over_an_axis_carries_the_axis) {
    Table table = over_frequency(2, 2);
    table.column_count = 1;
    assert_text("json", table,
                "{\"count\": 2, \"frequency\": {\"unit\": \"Hz\", \"values\": [1,1.5]}, "
                "\"channels\": {\"displacement\": {\"unit\": \"m\", \"values\": [0.25,0.375]}}}\n");
}

TEST(csv_has_a_header_with_units_and_short_times) {
    assert_text("csv", series(49, 3),
                "time [s],displacement [m],contact_force [N]\n"
                "0.049,6.125,-49\n"
                "0.05,6.25,-50\n"
                "0.051,6.375,nan\n");
    assert_text("csv", over_frequency(1, 2),
                "frequency [Hz],displacement [m],contact_force [N]\n0.5,0.125,-1\n1,0.25,-2\n");
    assert_text("csv", series(0, 0), "time [s],displacement [m],contact_force [N]\n");
}

TEST(every_part_of_a_binary_format_can_be_read_alone) {
    static const char *const names[] = {"npy", "npz", "mat"};
    for (size_t n = 0; n < 3; n++) {
        const Table table = series(50, 4500);
        const TableFormat *encoder = format_find(names[n]);
        Bytes whole = {0};
        assert_int_equal(format_write(encoder, &table, &whole, NULL), STATUS_OK);
        unsigned seed = 1;
        for (size_t i = 0; i < 500; i++) {
            seed = seed * 1664525 + 1013904223;
            const size_t first = seed % whole.count;
            seed = seed * 1664525 + 1013904223;
            const size_t size = 1 + (i % 2 == 0 ? seed % 64 : seed % (whole.count - first));
            const size_t most = whole.count - first, taken = size < most ? size : most;
            TableStream *stream = table_stream_new(NULL);
            char piece[777];
            stream->table = table;
            assert_int_equal(table_stream_open(stream, encoder, NULL), STATUS_OK);
            assert_int_equal(table_stream_size(stream), whole.count);
            table_stream_cut(stream, first, taken);
            size_t at = 0;
            ptrdiff_t count;
            while ((count = table_stream_next(stream, piece, sizeof piece)) > 0) {
                assert_memory_equal(piece, whole.at + first + at, (size_t)count);
                at += (size_t)count;
            }
            assert_int_equal(at, taken);
            table_stream_free(stream);
        }
        bytes_clear(&whole);
    }
}

TEST(piece_by_piece_is_the_same_as_whole) {
    for (size_t e = 0; table_formats[e] != NULL; e++)
        for (size_t size = 1; size < 100000; size = size * 7 + 3) {
            const Table table = e % 2 == 0 ? series(7, 4990) : over_frequency(0, ROWS);
            Bytes whole = {0}, pieces = {0};
            TableStream *stream = table_stream_new(NULL);
            char *piece = malloc(size);
            assert_int_equal(format_write(table_formats[e], &table, &whole, NULL), STATUS_OK);
            stream->table = table;
            assert_int_equal(table_stream_open(stream, table_formats[e], NULL), STATUS_OK);
            ptrdiff_t count;
            while ((count = table_stream_next(stream, piece, size)) > 0)
                bytes_put(&pieces, piece, (size_t)count);
            assert_int_equal(pieces.count, whole.count);
            assert_memory_equal(pieces.at, whole.at, whole.count);
            table_stream_free(stream);
            bytes_clear(&whole);
            bytes_clear(&pieces);
            free(piece);
        }
}

TEST(what_is_too_large_for_a_format_is_refused) {
    // Its length alone is looked at: nothing of it is read.
    static const struct {
        const char *extension;
        size_t rows;
        const char *words;
    } cases[] = {{"npz", (size_t)1 << 29, "4 GiB"}, {"mat", (size_t)1 << 28, ".npy"}};
    for (size_t i = 0; i < 2; i++) {
        Table table = series(0, cases[i].rows);
        table.axis_name = NULL;
        TableStream *stream = table_stream_new(NULL);
        Problem problem;
        problem_clear(&problem);
        stream->table = table;
        assert_int_equal(table_stream_open(stream, format_find(cases[i].extension), &problem),
                         STATUS_LIMIT);
        table_stream_free(stream);
        assert_non_null(strstr(problem.detail, cases[i].words));
    }
}

TEST(names_become_variables) {
    char name[MAT_NAME_SIZE];
    mat_name("contact_force_2", name);
    assert_string_equal(name, "contact_force_2");
    mat_name("2nd force", name);
    assert_string_equal(name, "x2nd_force");
    mat_name("", name);
    assert_string_equal(name, "x");
    mat_name("a123456789b123456789c123456789d123456789e123456789f123456789g123456789", name);
    assert_int_equal(strlen(name), 63);
}

TEST(a_full_buffer_fails_and_stays_empty) {
    for (size_t e = 0; table_formats[e] != NULL; e++)
        for (size_t most = 1; most < 40000; most = most * 3 + 1) {
            const Table table = series(0, ROWS);
            Bytes bytes = {.most = most};
            assert_int_equal(format_write(table_formats[e], &table, &bytes, NULL), STATUS_OK);
            assert_true(bytes.is_failed);
            assert_int_equal(bytes.count, 0);
            bytes_clear(&bytes);
        }
}

TEST_GROUP(fill, NULL)
