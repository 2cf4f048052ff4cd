// Tables of numbers in text files: lines, words, numbers, rows, evenly rising times. A position in
// a fault is "line 12, column 3", both from 1.
#ifndef CORE_FORMATS_TEXT_TABLE_H
#define CORE_FORMATS_TEXT_TABLE_H

#include "core/base/status.h"

// The unread part of a text. A copy continues from the same position.
typedef struct TextReader {
    const char *at, *end;
    size_t line;            // number of the last line read
    const char *separators; // of words, besides blanks
} TextReader;

typedef struct TextLine {
    const char *at, *end; // without line end and trailing blanks
    size_t number;        // from 1
    const char *separators;
} TextLine;

typedef struct TextWord {
    const char *at, *end;
} TextWord;

// All numbers of a file in reading order, and the shape of its rows. Released by free(at).
typedef struct NumberTable {
    double *at;
    size_t count, room, count_max;
    size_t rows, columns; // columns: of the first row
    size_t last_line;     // of the last row
    size_t last_columns;  // of the last row
    size_t uneven_line;   // first row, except the last, with another number of columns; 0: none
    size_t uneven_columns;
} NumberTable;

// Skips a byte order mark of UTF-8 and refuses bytes that no text has: STATUS_UNREADABLE.
Status text_table_open(const char *text, size_t size, const char *separators, TextReader *reader,
                       Problem *problem);

// The next line; false at the end of the text.
bool text_table_next_line(TextReader *reader, TextLine *line);

// The next word from *at, which moves behind it; false at the end of the line.
bool text_table_next_word(const TextLine *line, const char **at, TextWord *word);

// The whole word as a decimal number, exponent E or D. False: not a number, or not finite.
bool text_table_number(const TextWord *word, double *value);

// How many numbers the line has; 0 if any word of it is not a number. `values` receives the first
// `max` of them.
size_t text_table_numbers(const TextLine *line, double *values, size_t max);

// The line in upper case, cut to `size`.
void text_table_upper(const TextLine *line, char *target, size_t size);

// Whether the line starts with "***" and contains the word, which is in upper case.
bool text_table_is_marker(const TextLine *line, const char *word);

// Adds a fault that describes why the word is not a number.
Status text_table_refuse(const TextLine *line, const TextWord *word, Problem *problem);

// Adds a fault at "line 12, column 3"; column 0 is left out.
Status text_table_fault(Problem *problem, Status status, size_t line, size_t column,
                        const char *format, ...) __attribute__((format(printf, 5, 6)));

// Appends the numbers of a line; an empty line is not a row. STATUS_UNREADABLE, STATUS_TOO_LARGE
// beyond count_max numbers, STATUS_NO_MEMORY.
Status text_table_add_row(NumberTable *table, const TextLine *line, Problem *problem);

// The first row with another number of columns than the first one, which is set in *columns; 0:
// none. `may_end_short`: the last row may have fewer.
size_t text_table_uneven_line(const NumberTable *table, bool may_end_short, size_t *columns);

// Splits a table of two columns, times and values, at least two rows: leaves the values in `table`
// and sets the first time and the interval. `reader` starts at or above the first row.
// STATUS_UNREADABLE: the times do not rise evenly.
Status text_table_split_times(NumberTable *table, TextReader reader, double *start,
                              double *interval, Problem *problem);

#endif
