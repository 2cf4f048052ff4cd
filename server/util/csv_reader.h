// The cells of a CSV text, row by row (RFC 4180): quoted or not, ends of lines of any kind. Not
// what the cells mean. Used by materials/exchange_csv.c.
#ifndef SERVER_UTIL_CSV_READER_H
#define SERVER_UTIL_CSV_READER_H

#include "server/util/bytes.h"

enum { CSV_CELLS_MAX = 1000 };

typedef struct CsvCell {
    const char *text; // without its quotes; NUL-terminated
    size_t first;     // where it begins among the row's texts
    bool is_quoted;
    const char *fault; // a static sentence: it is no cell; NULL
} CsvCell;

// One pass over a text, which is borrowed. All zero but text and size at first.
typedef struct CsvReader {
    const char *text;
    size_t size, at;
    size_t row; // of the cells, from 1; rows of nothing count
    CsvCell *cells;
    size_t count, room;
    Bytes texts;
    bool is_failed; // no memory, or a row of more than CSV_CELLS_MAX cells
} CsvReader;

// The next row that has anything in it, until the call after; false behind the last, or
// scan->is_failed.
bool csv_reader_next(CsvReader *scan);
void csv_reader_clear(CsvReader *scan);

#endif
