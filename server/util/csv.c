#include "server/util/csv.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void csv_put_name(Bytes *bytes, const char *name, const char *unit) {
    bytes_text(bytes, name);
    if (unit != NULL && unit[0] != '\0')
        bytes_format(bytes, " [%s]", unit);
}

void csv_cells_real(Bytes *bytes, double value) {
    if (isfinite(value))
        bytes_real(bytes, value);
    else
        bytes_text(bytes, isnan(value) ? "nan" : value < 0 ? "-inf" : "inf");
}

void csv_cells_text(Bytes *bytes, const char *text, size_t length) {
    bytes_text(bytes, "\"");
    for (size_t i = 0; i < length; i++)
        bytes_put(bytes, text[i] == '"' ? "\"\"" : &text[i], text[i] == '"' ? 2 : 1);
    bytes_text(bytes, "\"");
}

// --- reading ---

// A cell ends at a comma or at the end of a line, LF, CR LF or CR; within quotes both are text, and
// a quote is written twice.
static bool csv_at_line_end(const CsvReader *csv) {
    return csv->at == csv->size || csv->text[csv->at] == '\n' || csv->text[csv->at] == '\r';
}

static void csv_skip_line_end(CsvReader *csv) {
    const size_t left = csv->size - csv->at;
    if (left > 1 && memcmp(csv->text + csv->at, "\r\n", 2) == 0)
        csv->at += 2;
    else if (left > 0)
        csv->at++;
}

static CsvCell *csv_add_cell(CsvReader *csv) {
    if (csv->count == csv->room) {
        const size_t room = csv->room > 0 ? 2 * csv->room : 64;
        CsvCell *grown =
            csv->count < CSV_CELLS_MAX ? realloc(csv->cells, room * sizeof *grown) : NULL;
        if (grown == NULL)
            return NULL;
        csv->cells = grown;
        csv->room = room;
    }
    CsvCell *cell = &csv->cells[csv->count++];
    *cell = (CsvCell){.first = csv->texts.count};
    return cell;
}

// Up to the closing quote; the rest of the cell is skipped.
static void csv_read_quoted(CsvReader *csv, CsvCell *cell) {
    cell->is_quoted = true;
    csv->at++;
    for (;;) {
        const char *from = csv->text + csv->at;
        const char *quote = memchr(from, '"', csv->size - csv->at);
        const size_t length = quote != NULL ? (size_t)(quote - from) : csv->size - csv->at;
        bytes_put(&csv->texts, from, length);
        csv->at += length + (quote != NULL);
        if (quote == NULL) {
            cell->fault = "the quote that begins this cell is never closed";
            return;
        }
        if (csv->at == csv->size || csv->text[csv->at] != '"')
            break;
        bytes_put(&csv->texts, "\"", 1);
        csv->at++;
    }
    for (; !csv_at_line_end(csv) && csv->text[csv->at] != ','; csv->at++)
        if (csv->text[csv->at] != ' ' && csv->text[csv->at] != '\t')
            cell->fault = "there is text after the closing quote: a quote within quotes is "
                          "written twice";
}

static void csv_read_plain(CsvReader *csv) {
    const size_t first = csv->at;
    while (!csv_at_line_end(csv) && csv->text[csv->at] != ',')
        csv->at++;
    bytes_put(&csv->texts, csv->text + first, csv->at - first);
}

// False without memory, or with more than CSV_CELLS_MAX cells.
static bool csv_read_row(CsvReader *csv) {
    csv->row++;
    csv->count = 0;
    csv->texts.count = 0;
    for (;;) {
        CsvCell *cell = csv_add_cell(csv);
        if (cell == NULL)
            return false;
        if (csv->at < csv->size && csv->text[csv->at] == '"')
            csv_read_quoted(csv, cell);
        else
            csv_read_plain(csv);
        bytes_put(&csv->texts, "", 1);
        if (csv_at_line_end(csv))
            break;
        csv->at++; // the comma
    }
    csv_skip_line_end(csv);
    return !csv->texts.is_failed;
}

// Sets the cells' texts, which do not move any more. False: the row is empty.
static bool csv_finish_row(CsvReader *csv) {
    bool has_any = false;
    for (size_t i = 0; i < csv->count; i++) {
        CsvCell *cell = &csv->cells[i];
        const size_t end = i + 1 < csv->count ? csv->cells[i + 1].first : csv->texts.count;
        cell->text = csv->texts.at + cell->first;
        if (strlen(cell->text) + 1 < end - cell->first)
            cell->fault = "has a NUL byte; the text must be UTF-8";
        else if (!text_is_utf8(cell->text))
            cell->fault = "is not UTF-8; save the table with the encoding UTF-8";
        has_any = has_any || cell->fault != NULL || cell->text[0] != '\0' || cell->is_quoted;
    }
    return has_any;
}

bool csv_reader_next(CsvReader *csv) {
    while (csv->at < csv->size && !csv->is_failed) {
        csv->is_failed = !csv_read_row(csv);
        if (!csv->is_failed && csv_finish_row(csv))
            return true;
    }
    return false;
}

void csv_reader_clear(CsvReader *csv) {
    free(csv->cells);
    bytes_clear(&csv->texts);
    *csv = (CsvReader){.text = NULL};
}
