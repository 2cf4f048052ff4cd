// Tables of text for people: built cell by cell, or made of a JSON document.
#ifndef SERVER_JSON_TABLE_H
#define SERVER_JSON_TABLE_H

#include <stdio.h>

#include "core/base/field.h"

enum { LISTING_COLUMNS = 12 };

// An empty table is zero but for the number of columns. Cells are added row by row; with heads the
// first row has the names of the columns. Columns of numbers are right-aligned.
typedef struct PrintTable {
    size_t columns, count; // count of cells
    char **cells;
    bool has_heads, is_failed; // is_failed: no memory
} PrintTable;

// Adds the next cell. Control characters, which a terminal would interpret, become '?'.
void print_table_add(PrintTable *table, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
// The same for a number; NAN is "-".
void print_table_number(PrintTable *table, const char *format, double value);
void print_table_clear(PrintTable *table);
// Prints and clears the table; an empty cell under a head is "-".
void print_table_print(PrintTable *table, FILE *file);

// Replaces control characters by '?', in place; NULL is allowed.
void text_make_printable(char *text);

// The columns of a list of objects, in this order; empty ones are left out. A list without such an
// entry has all columns.
typedef struct PrintTableColumns {
    const char *list;
    const char *columns[LISTING_COLUMNS + 1]; // NULL-terminated
} PrintTableColumns;

typedef struct PrintTableView {
    const char *const *skipped;     // members to leave out, at any depth; NULL-terminated
    const PrintTableColumns *lists; // ends with list NULL
    const Field *const *fields;     // rows with the units of members; NULL-terminated; NULL: none
} PrintTableView;

// Prints the members of a document that are not empty: plain values as name and value, a list of
// objects as a table, neighbouring objects with the same members as rows of one table. *longest is
// the number of rows of the longest table. STATUS_UNREACHABLE if the text is not a JSON object.
Status print_table_print_json(const char *text, size_t size, const PrintTableView *view, FILE *file,
                              size_t *longest, Problem *problem);

#endif
