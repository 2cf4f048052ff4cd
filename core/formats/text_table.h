// Text as lines, words and numbers, with the place of each.
// Knows nothing of layouts. Used by import.c and import_header.c.
#ifndef CORE_FORMATS_TEXT_TABLE_H
#define CORE_FORMATS_TEXT_TABLE_H

#include "core/base/status.h"

// What is left to read. A copy of it goes on from the same place.
typedef struct TextReader {
    const char *at, *end;
    size_t line; // number of the last one read
} TextReader;

typedef struct TextLine {
    const char *at, *end; // without its end and the blanks before that
    size_t number;        // from 1
} TextLine;

typedef struct TextWord {
    const char *at, *end;
} TextWord;

// The next line; false at the end of the text.
bool text_line(TextReader *reader, TextLine *line);

// The next word from *at on, which is moved behind it; false at the end of the line.
bool text_word(const TextLine *line, const char **at, TextWord *word);

// A whole word as a number, decimal, with an exponent of E or D. False: it is none, or not finite.
bool text_number(const TextWord *word, double *value);

// Whether the line is made of numbers; how many. 0: no, or it is empty.
size_t text_numbers(const TextLine *line);

// The line in capitals, cut at `size`.
void text_capitals(const TextLine *line, char *target, size_t size);

// Whether it begins with "***".
bool text_is_mark(const TextLine *line);

// Adds the fault at the word's line and column; says what kind of garbage it is.
Status text_refuse_word(const TextLine *line, const TextWord *word, Problem *problem);

// "line 12, column 3"; column 0 is left out.
const char *text_place(char target[64], size_t line, size_t column);

// Refuses bytes that no text has.
Status text_check(const char *text, size_t size, Problem *problem);

#endif
