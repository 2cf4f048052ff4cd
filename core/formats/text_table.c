#include "core/formats/text_table.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORD_MAX = 63 }; // bytes of a number

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

bool text_line(TextReader *reader, TextLine *line) {
    if (reader->at == reader->end)
        return false;
    const char *end = memchr(reader->at, '\n', (size_t)(reader->end - reader->at));
    const char *last = end != NULL ? end : reader->end;
    *line = (TextLine){reader->at, last, ++reader->line};
    while (line->end > line->at && is_blank(line->end[-1]))
        line->end--;
    reader->at = end != NULL ? end + 1 : reader->end;
    return true;
}

bool text_word(const TextLine *line, const char **at, TextWord *word) {
    while (*at < line->end && is_blank(**at))
        ++*at;
    word->at = *at;
    while (*at < line->end && !is_blank(**at))
        ++*at;
    word->end = *at;
    return word->end > word->at;
}

static const char *skip_digits(const char *at, const char *end) {
    while (at < end && isdigit((unsigned char)*at))
        at++;
    return at;
}

static const char *skip_sign(const char *at, const char *end) {
    return at < end && (*at == '+' || *at == '-') ? at + 1 : at;
}

// Where a number that begins at `at` ends; NULL if none does.
static const char *number_end(const char *at, const char *end) {
    at = skip_sign(at, end);
    const char *whole = skip_digits(at, end), *last = whole;
    if (whole < end && *whole == '.') {
        last = skip_digits(whole + 1, end);
        if (last == at + 1)
            return NULL; // a point alone
    } else if (whole == at) {
        return NULL;
    }
    if (last == end || strchr("EeDd", *last) == NULL)
        return last;
    const char *power = skip_sign(last + 1, end);
    const char *power_end = skip_digits(power, end);
    return power_end > power ? power_end : last;
}

bool text_number(const TextWord *word, double *value) {
    char copy[WORD_MAX + 1];
    const size_t length = (size_t)(word->end - word->at);
    if (length > WORD_MAX || number_end(word->at, word->end) != word->end)
        return false;
    memcpy(copy, word->at, length);
    copy[length] = '\0';
    for (char *c = copy; *c != '\0'; c++)
        if (*c == 'D' || *c == 'd')
            *c = 'e';
    *value = strtod(copy, NULL);
    return isfinite(*value);
}

size_t text_numbers(const TextLine *line) {
    const char *at = line->at;
    TextWord word;
    double value;
    size_t count = 0;
    for (; text_word(line, &at, &word); count++)
        if (!text_number(&word, &value))
            return 0;
    return count;
}

void text_capitals(const TextLine *line, char *target, size_t size) {
    size_t length = 0;
    for (const char *c = line->at; c < line->end && length + 1 < size; c++)
        target[length++] = (char)toupper((unsigned char)*c);
    target[length] = '\0';
}

bool text_is_mark(const TextLine *line) {
    const char *at = line->at;
    TextWord word;
    return text_word(line, &at, &word) && word.end - word.at >= 3 && memcmp(word.at, "***", 3) == 0;
}

const char *text_place(char target[64], size_t line, size_t column) {
    if (column > 0)
        snprintf(target, 64, "line %zu, column %zu", line, column);
    else
        snprintf(target, 64, "line %zu", line);
    return target;
}

// What a person would call a word that is no number.
static const char *garbage_name(const TextWord *word) {
    char copy[8] = "";
    const size_t length = (size_t)(word->end - word->at);
    for (size_t i = 0; i < length && i + 1 < sizeof copy; i++)
        copy[i] = (char)tolower((unsigned char)word->at[i]);
    const char *letters = copy[0] == '-' || copy[0] == '+' ? copy + 1 : copy;
    if (strncmp(letters, "nan", 3) == 0 || strncmp(letters, "inf", 3) == 0)
        return "must be a finite number";
    bool has_stars = false;
    for (const char *c = word->at; c < word->end; c++)
        has_stars = has_stars || *c == '*';
    if (has_stars)
        return "must be a number; stars stand for one that was too long for its field";
    const char *end = number_end(word->at, word->end);
    if (end == word->end)
        return length > WORD_MAX ? "must be a number of at most 63 characters"
                                 : "must be a number that a double can hold";
    if (end != NULL && number_end(end, word->end) != NULL)
        return "must be one number; these have run together";
    if (memchr(word->at, ',', length) != NULL)
        return "must be a number; blanks separate them, their decimal mark is a point";
    return "must be a number";
}

Status text_refuse_word(const TextLine *line, const TextWord *word, Problem *problem) {
    char place[64], shown[40];
    size_t length = 0;
    for (const char *c = word->at; c < word->end && length < 32; c++)
        shown[length++] = isprint((unsigned char)*c) ? *c : '?';
    snprintf(shown + length, sizeof shown - length, "%s",
             word->at + length < word->end ? "..." : "");
    return problem_add(problem, STATUS_UNREADABLE,
                       text_place(place, line->number, (size_t)(word->at - line->at) + 1),
                       "%s, is %s", garbage_name(word), shown);
}

Status text_check(const char *text, size_t size, Problem *problem) {
    size_t line = 1, start = 0;
    for (size_t i = 0; i < size; i++) {
        const unsigned char byte = (unsigned char)text[i];
        if (byte == '\n') {
            line++;
            start = i + 1;
        } else if ((byte < ' ' && !is_blank(text[i])) || byte == 0x7f) {
            char place[64];
            return problem_add(problem, STATUS_UNREADABLE, text_place(place, line, i - start + 1),
                               "must be text, holds the byte 0x%02X%s", byte,
                               byte == 0 ? " (a binary file, or UTF-16)" : "");
        }
    }
    return STATUS_OK;
}
