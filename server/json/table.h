// Tables of text for people, made of a JSON document.
#ifndef SERVER_JSON_TABLE_H
#define SERVER_JSON_TABLE_H

#include <stdio.h>

#include "core/base/field.h"
#include "server/util/bytes.h"

enum { LISTING_COLUMNS = 12 };

// Replaces control characters by '?', in place; NULL is allowed.
void text_make_printable(char *text);

// A table is filled cell by cell; with heads the first row has the names of the columns. Columns of
// numbers are right-aligned.
typedef struct PrintTable {
    size_t columns, count; // count of cells
    char **cells;
    bool has_heads, is_failed; // is_failed: no memory
} PrintTable;

// Adds the next cell. Control characters, which a terminal would interpret, become '?'.
void print_table_add(PrintTable *table, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
const char *print_table_cell(const PrintTable *table, size_t index); // "-" below a head if empty
// Whether a column has heads and, below, nothing but numbers.
bool print_table_is_numeric(const PrintTable *table, size_t column);
void print_table_clear(PrintTable *table);

typedef struct PrintTableForm {
    size_t width; // of a line: texts are shortened, then columns left out; 0: no limit
    size_t rows;  // below the heads; 0: no limit
    bool has_colour;
} PrintTableForm;
void print_table_print(const PrintTable *table, const PrintTableForm *form, FILE *file);

// The columns of a list of objects, or of the objects that are the members of an object, in this
// order; empty ones are left out. "errors.psd" is a member of a member. A list without such an
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
// the number of rows of the longest table; NULL is allowed. STATUS_NO_MEMORY if the document has
// failed, STATUS_UNREACHABLE if it is not a JSON object.
Status print_table_print_json(const Bytes *json, const PrintTableView *view, PrintTableForm form,
                              FILE *file, size_t *longest, Problem *problem);

#endif
