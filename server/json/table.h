// Tables of text for people: built cell by cell, or made of a JSON document.
#ifndef SERVER_JSON_TABLE_H
#define SERVER_JSON_TABLE_H

#include <stdio.h>

#include "core/base/field.h"

enum { LISTING_COLUMNS = 12 };

// Zero but for the number of columns is an empty table. Cells come row by row; with heads the first
// row has the names of the columns, and columns of numbers stand to the right.
typedef struct PrintTable {
    size_t columns, count; // count of cells
    char **cells;
    bool has_heads, is_failed; // failed: no memory
} PrintTable;

// The next cell. Control characters, which a terminal would obey, are replaced.
void print_table_add(PrintTable *table, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
// The same of a number, "-" where it is NAN.
void print_table_number(PrintTable *table, const char *format, double value);
void print_table_clear(PrintTable *table);
// Prints and clears the table; an empty cell below a head is "-".
void print_table_print(PrintTable *table, FILE *file);

// Replaces control characters in place; NULL is allowed.
void text_make_printable(char *text);

// The columns of a list of objects, in this order, without those that are empty; a list that is not
// named here has all columns.
typedef struct PrintTableColumns {
    const char *list;
    const char *columns[LISTING_COLUMNS + 1]; // NULL-terminated
} PrintTableColumns;

typedef struct PrintTableView {
    const char *const *skipped;     // members that are not shown, at any depth; NULL-terminated
    const PrintTableColumns *lists; // ends with list NULL
    const Field *const *fields;     // they know units by name; NULL-terminated; NULL: no units
} PrintTableView;

// Prints the document's members, without empty ones: plain values as names and values, a list of
// objects as a table, neighbouring objects with the same members as columns of one table. `longest`
// is the number of rows of the longest list, 0 where nothing was printed. STATUS_UNREACHABLE if it
// is no JSON object: nothing but a daemon's answer is printed.
Status print_table_print_json(const char *text, size_t size, const PrintTableView *view, FILE *file,
                              size_t *longest, Problem *problem);

#endif
