// Cells of CSV texts.
#include "server/util/csv.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "tests/support/test.h"

static void expect_row(CsvReader *scan, size_t row, size_t count, const char *const *cells) {
    assert_true(csv_reader_next(scan));
    assert_int_equal(scan->row, row);
    assert_int_equal(scan->count, count);
    for (size_t i = 0; i < count; i++) {
        assert_null(scan->cells[i].fault);
        assert_string_equal(scan->cells[i].text, cells[i]);
    }
}

static CsvReader scan_of(const char *text) {
    return (CsvReader){.text = text, .size = strlen(text)};
}

TEST(csv_cells_are_parted_by_commas_and_rows_by_any_end_of_line) {
    static const char *const ends[] = {"\n", "\r\n", "\r"};
    for (size_t i = 0; i < COUNT(ends); i++) {
        char text[64];
        snprintf(text, sizeof text, "a,b%s%s,%sc,%s\"d\"", ends[i], ends[i], ends[i], ends[i]);
        CsvReader scan = scan_of(text);
        expect_row(&scan, 1, 2, (const char *const[]){"a", "b"});
        // Row 2 is nothing and is passed over; row 3 has cells, but nothing in them.
        expect_row(&scan, 4, 2, (const char *const[]){"c", ""});
        expect_row(&scan, 5, 1, (const char *const[]){"d"});
        assert_false(csv_reader_next(&scan));
        assert_false(scan.is_failed);
        csv_reader_clear(&scan);
    }
}

TEST(quotes_hold_commas_lines_and_quotes) {
    CsvReader scan = scan_of("\"a,\r\nb\",\"say \"\"so\"\"\",\"\",5\" \n x ,\"y\" \n");
    expect_row(&scan, 1, 4, (const char *const[]){"a,\r\nb", "say \"so\"", "", "5\" "});
    assert_true(scan.cells[2].is_quoted);
    assert_false(scan.cells[3].is_quoted);
    expect_row(&scan, 2, 2, (const char *const[]){" x ", "y"});
    assert_false(csv_reader_next(&scan));
    csv_reader_clear(&scan);
}

TEST(what_is_no_cell_is_told) {
    CsvReader scan = scan_of("\"a\"b,c\nx,\xffy\nz,\"open,\n\n");
    assert_true(csv_reader_next(&scan));
    assert_non_null(strstr(scan.cells[0].fault, "closing quote"));
    assert_string_equal(scan.cells[1].text, "c");
    assert_true(csv_reader_next(&scan));
    assert_non_null(strstr(scan.cells[1].fault, "UTF-8"));
    assert_true(csv_reader_next(&scan));
    assert_null(scan.cells[0].fault);
    assert_non_null(strstr(scan.cells[1].fault, "never closed"));
    assert_false(csv_reader_next(&scan));
    csv_reader_clear(&scan);
    scan = (CsvReader){.text = "a\0b,c", .size = 5};
    assert_true(csv_reader_next(&scan));
    assert_non_null(strstr(scan.cells[0].fault, "NUL"));
    assert_string_equal(scan.cells[1].text, "c");
    csv_reader_clear(&scan);
}

TEST(a_row_has_so_many_cells_and_no_more) {
    enum { CELLS = 5000 };
    char *text = malloc(CELLS + 1);
    assert_non_null(text);
    memset(text, ',', CELLS);
    text[CELLS] = '\0';
    text[0] = 'x';
    CsvReader scan = scan_of(text);
    assert_false(csv_reader_next(&scan));
    assert_true(scan.is_failed);
    assert_true(scan.count >= CSV_CELLS_MAX);
    csv_reader_clear(&scan);
    free(text);
}
