// A cell ends at a comma or at the end of a line, LF, CR LF or CR; within quotes both are text, and
// a quote is written twice.
#include "server/util/csv_reader.h"

#include <stdlib.h>
#include <string.h>

static bool is_end(const CsvReader *scan) {
    return scan->at == scan->size || scan->text[scan->at] == '\n' || scan->text[scan->at] == '\r';
}

static void skip_end(CsvReader *scan) {
    const size_t left = scan->size - scan->at;
    if (left > 1 && memcmp(scan->text + scan->at, "\r\n", 2) == 0)
        scan->at += 2;
    else if (left > 0)
        scan->at++;
}

static CsvCell *add_cell(CsvReader *scan) {
    if (scan->count == scan->room) {
        const size_t room = scan->room > 0 ? 2 * scan->room : 64;
        CsvCell *grown =
            scan->count < CSV_CELLS_MAX ? realloc(scan->cells, room * sizeof *grown) : NULL;
        if (grown == NULL)
            return NULL;
        scan->cells = grown;
        scan->room = room;
    }
    CsvCell *cell = &scan->cells[scan->count++];
    *cell = (CsvCell){.first = scan->texts.count};
    return cell;
}

// Up to the quote that closes; what is behind it up to the cell's end is passed over.
static void read_quoted(CsvReader *scan, CsvCell *cell) {
    cell->is_quoted = true;
    scan->at++;
    for (;;) {
        const char *from = scan->text + scan->at;
        const char *quote = memchr(from, '"', scan->size - scan->at);
        const size_t length = quote != NULL ? (size_t)(quote - from) : scan->size - scan->at;
        bytes_put(&scan->texts, from, length);
        scan->at += length + (quote != NULL);
        if (quote == NULL) {
            cell->fault = "the quote that begins this cell is never closed";
            return;
        }
        if (scan->at == scan->size || scan->text[scan->at] != '"')
            break;
        bytes_put(&scan->texts, "\"", 1);
        scan->at++;
    }
    for (; !is_end(scan) && scan->text[scan->at] != ','; scan->at++)
        if (scan->text[scan->at] != ' ' && scan->text[scan->at] != '\t')
            cell->fault = "there is text behind the closing quote: a quote within quotes is "
                          "written twice";
}

static void read_plain(CsvReader *scan) {
    const size_t first = scan->at;
    while (!is_end(scan) && scan->text[scan->at] != ',')
        scan->at++;
    bytes_put(&scan->texts, scan->text + first, scan->at - first);
}

// False where there is no room for all its cells.
static bool read_row(CsvReader *scan) {
    scan->count = 0;
    scan->texts.count = 0;
    for (;;) {
        CsvCell *cell = add_cell(scan);
        if (cell == NULL)
            return false;
        if (scan->at < scan->size && scan->text[scan->at] == '"')
            read_quoted(scan, cell);
        else
            read_plain(scan);
        bytes_put(&scan->texts, "", 1);
        if (is_end(scan))
            break;
        scan->at++; // the comma
    }
    skip_end(scan);
    scan->row++;
    return !scan->texts.is_failed;
}

// The texts have come to rest. What has a NUL in it ends there.
static bool settle(CsvReader *scan) {
    bool has_any = false;
    for (size_t i = 0; i < scan->count; i++) {
        CsvCell *cell = &scan->cells[i];
        const size_t end = i + 1 < scan->count ? scan->cells[i + 1].first : scan->texts.count;
        cell->text = scan->texts.at + cell->first;
        if (strlen(cell->text) + 1 < end - cell->first)
            cell->fault = "there is a NUL byte in it; the text must be UTF-8";
        else if (!text_is_utf8(cell->text))
            cell->fault = "is not UTF-8; save the table with the encoding UTF-8";
        has_any = has_any || cell->fault != NULL || cell->text[0] != '\0' || cell->is_quoted;
    }
    return has_any;
}

bool csv_reader_next(CsvReader *scan) {
    while (scan->at < scan->size && !scan->is_failed) {
        scan->is_failed = !read_row(scan);
        if (!scan->is_failed && settle(scan))
            return true;
    }
    return false;
}

void csv_reader_clear(CsvReader *scan) {
    free(scan->cells);
    bytes_clear(&scan->texts);
    *scan = (CsvReader){.text = NULL};
}
