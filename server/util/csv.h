// CSV (RFC 4180): cells that are written, and a reader.
#ifndef SERVER_UTIL_CSV_H
#define SERVER_UTIL_CSV_H

#include "core/base/field.h"
#include "server/util/bytes.h"

void csv_put_name(Bytes *bytes, const char *name, const char *unit); // "name [unit]"

void csv_cells_real(Bytes *bytes, double value);                    // "nan", "inf" and "-inf" too
void csv_cells_text(Bytes *bytes, const char *text, size_t length); // quoted, its quotes doubled

enum { CSV_CELLS_MAX = 1000 };

typedef struct CsvCell {
    const char *text; // without its quotes; NUL-terminated
    size_t first;     // its offset in the row's texts
    bool is_quoted;
    const char *fault; // a static sentence; NULL: none
} CsvCell;

// One pass over a text, which is borrowed. Starts as all zero except text and size.
typedef struct CsvReader {
    const char *text;
    size_t size, at;
    size_t row; // of the cells, from 1; empty rows count
    CsvCell *cells;
    size_t count, room;
    Bytes texts;
    bool is_failed; // no memory, or a row of more than CSV_CELLS_MAX cells
} CsvReader;

// The next row that is not empty; its cells are valid until the next call. False after the last one
// or if csv->is_failed.
bool csv_reader_next(CsvReader *csv);
void csv_reader_clear(CsvReader *csv);

#endif
