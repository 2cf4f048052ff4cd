// Each word is scanned a fixed number of times: the run time is linear in the size of the text.
#include "core/formats/text_table.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBER_MAX = 63 }; // bytes of a number

static const double unevenness_max = 0.3; // of an interval, since printed times are rounded

static bool text_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v';
}

static bool text_is_between(const TextLine *line, char c) {
    return text_is_blank(c) || (c != '\0' && strchr(line->separators, c) != NULL);
}

Status text_table_fault(Problem *problem, Status status, size_t line, size_t column,
                        const char *format, ...) {
    char place[64], detail[sizeof((Fault){0}.detail)];
    const int used = snprintf(place, sizeof place, "line %zu", line);
    if (column > 0)
        snprintf(place + used, sizeof place - (size_t)used, ", column %zu", column);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(detail, sizeof detail, format, arguments);
    va_end(arguments);
    return problem_add(problem, status, place, "%s", detail);
}

Status text_table_open(const char *text, size_t size, const char *separators, TextReader *reader,
                       Problem *problem) {
    const size_t mark = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    *reader = (TextReader){text + mark, text + size, 0, separators};
    size_t line = 1;
    const char *start = reader->at;
    for (const char *at = start; at < reader->end; at++) {
        const unsigned char byte = (unsigned char)*at;
        if (byte == '\n') {
            line++;
            start = at + 1;
        } else if ((byte < ' ' && !text_is_blank(*at)) || byte == 0x7f) {
            return text_table_fault(problem, STATUS_UNREADABLE, line, (size_t)(at - start) + 1,
                                    "must be text, holds the byte 0x%02X%s", byte,
                                    byte == 0 ? " (a binary file, or UTF-16)" : "");
        }
    }
    return STATUS_OK;
}

bool text_table_next_line(TextReader *reader, TextLine *line) {
    if (reader->at == reader->end)
        return false;
    const char *end = memchr(reader->at, '\n', (size_t)(reader->end - reader->at));
    const char *last = end != NULL ? end : reader->end;
    *line = (TextLine){reader->at, last, ++reader->line, reader->separators};
    while (line->end > line->at && text_is_blank(line->end[-1]))
        line->end--;
    reader->at = end != NULL ? end + 1 : reader->end;
    return true;
}

bool text_table_next_word(const TextLine *line, const char **at, TextWord *word) {
    while (*at < line->end && text_is_between(line, **at))
        ++*at;
    word->at = *at;
    while (*at < line->end && !text_is_between(line, **at))
        ++*at;
    word->end = *at;
    return word->end > word->at;
}

static const char *text_skip_digits(const char *at, const char *end) {
    while (at < end && isdigit((unsigned char)*at))
        at++;
    return at;
}

static const char *text_skip_sign(const char *at, const char *end) {
    return at < end && (*at == '+' || *at == '-') ? at + 1 : at;
}

// The end of the number that starts at `at`; NULL: none starts there.
static const char *text_number_end(const char *at, const char *end) {
    at = text_skip_sign(at, end);
    const char *whole = text_skip_digits(at, end), *last = whole;
    if (whole < end && *whole == '.') {
        last = text_skip_digits(whole + 1, end);
        if (last == at + 1)
            return NULL; // only a point
    } else if (whole == at) {
        return NULL;
    }
    if (last == end || strchr("EeDd", *last) == NULL)
        return last;
    const char *power = text_skip_sign(last + 1, end);
    const char *power_end = text_skip_digits(power, end);
    return power_end > power ? power_end : last;
}

bool text_table_number(const TextWord *word, double *value) {
    char copy[NUMBER_MAX + 1];
    const size_t length = (size_t)(word->end - word->at);
    if (length > NUMBER_MAX || text_number_end(word->at, word->end) != word->end)
        return false;
    memcpy(copy, word->at, length);
    copy[length] = '\0';
    for (char *c = copy; *c != '\0'; c++)
        if (*c == 'D' || *c == 'd')
            *c = 'e';
    *value = strtod(copy, NULL);
    return isfinite(*value);
}

size_t text_table_numbers(const TextLine *line, double *values, size_t max) {
    const char *at = line->at;
    TextWord word;
    double value;
    size_t count = 0;
    for (; text_table_next_word(line, &at, &word); count++) {
        if (!text_table_number(&word, &value))
            return 0;
        if (count < max)
            values[count] = value;
    }
    return count;
}

void text_table_upper(const TextLine *line, char *target, size_t size) {
    size_t length = 0;
    for (const char *c = line->at; c < line->end && length + 1 < size; c++)
        target[length++] = (char)toupper((unsigned char)*c);
    target[length] = '\0';
}

bool text_table_is_marker(const TextLine *line, const char *word) {
    char seen[64];
    text_table_upper(line, seen, sizeof seen);
    return strncmp(seen + strspn(seen, " \t\r\f\v"), "***", 3) == 0 && strstr(seen, word) != NULL;
}

// Why a word is not a number.
static const char *text_refusal(const TextWord *word) {
    const size_t length = (size_t)(word->end - word->at);
    char copy[8];
    text_table_upper(&(TextLine){word->at, word->end, 0, ""}, copy, sizeof copy);
    const char *letters = copy[0] == '-' || copy[0] == '+' ? copy + 1 : copy;
    if (strncmp(letters, "NAN", 3) == 0 || strncmp(letters, "INF", 3) == 0)
        return "must be a finite number";
    if (memchr(word->at, '*', length) != NULL)
        return "must be a number; stars replace one that was too long for its field";
    const char *end = text_number_end(word->at, word->end);
    if (end == word->end)
        return length > NUMBER_MAX ? "must be a number of at most 63 characters"
                                   : "must be a number that a double can hold";
    if (end != NULL && text_number_end(end, word->end) != NULL)
        return "must be one number; these have run together";
    if (memchr(word->at, ',', length) != NULL || memchr(word->at, ';', length) != NULL)
        return "must be a number (separated by blanks, not by commas or semicolons, and with a "
               "decimal point)";
    return "must be a number";
}

Status text_table_refuse(const TextLine *line, const TextWord *word, Problem *problem) {
    char shown[40];
    size_t length = 0;
    for (const char *c = word->at; c < word->end && length < 32; c++)
        shown[length++] = isprint((unsigned char)*c) ? *c : '?';
    snprintf(shown + length, sizeof shown - length, "%s",
             word->at + length < word->end ? "..." : "");
    return text_table_fault(problem, STATUS_UNREADABLE, line->number,
                            (size_t)(word->at - line->at) + 1, "%s, is %s", text_refusal(word),
                            shown);
}

static Status text_add_number(NumberTable *table, double value, size_t line, Problem *problem) {
    if (table->count == table->count_max)
        return text_table_fault(problem, STATUS_TOO_LARGE, line, 0,
                                "must hold at most %zu numbers up to here", table->count_max);
    if (table->count == table->room) {
        const size_t room = table->room > 0 ? 2 * table->room : 4096;
        double *at = realloc(table->at, room * sizeof *at);
        if (at == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu samples", room);
        table->at = at;
        table->room = room;
    }
    table->at[table->count++] = value;
    return STATUS_OK;
}

Status text_table_add_row(NumberTable *table, const TextLine *line, Problem *problem) {
    const char *at = line->at;
    const size_t before = table->count;
    TextWord word;
    double value;
    while (text_table_next_word(line, &at, &word)) {
        if (!text_table_number(&word, &value))
            return text_table_refuse(line, &word, problem);
        TRY(text_add_number(table, value, line->number, problem));
    }
    const size_t columns = table->count - before;
    if (columns == 0)
        return STATUS_OK;
    // The row before was not the last one.
    if (table->rows > 0 && table->last_columns != table->columns && table->uneven_line == 0) {
        table->uneven_line = table->last_line;
        table->uneven_columns = table->last_columns;
    }
    if (table->rows++ == 0)
        table->columns = columns;
    table->last_columns = columns;
    table->last_line = line->number;
    return STATUS_OK;
}

size_t text_table_uneven_line(const NumberTable *table, bool may_end_short, size_t *columns) {
    const bool is_last = table->uneven_line == 0;
    *columns = is_last ? table->last_columns : table->uneven_columns;
    if (!is_last)
        return table->uneven_line;
    return *columns == table->columns || (may_end_short && *columns < table->columns)
               ? 0
               : table->last_line;
}

// Adds the fault at the row whose step differs most from the mean: a wrong time bends the mean, and
// with it the distance of all later times from the line.
static Status text_refuse_times(const NumberTable *table, double mean, TextReader reader,
                                Problem *problem) {
    const double *at = table->at;
    size_t row = 1;
    for (size_t i = 2; i < table->rows; i++)
        if (fabs(at[2 * i] - at[2 * i - 2] - mean) > fabs(at[2 * row] - at[2 * row - 2] - mean))
            row = i;
    TextLine line = {0};
    size_t rows = 0;
    while (rows <= row && text_table_next_line(&reader, &line))
        rows += text_table_numbers(&line, NULL, 0) > 0;
    return text_table_fault(problem, STATUS_UNREADABLE, line.number, 0,
                            "times must rise evenly: is %s s after %s s, where steps are %.4g s",
                            real_text(at[2 * row]).at, real_text(at[2 * row - 2]).at,
                            row > 1 ? at[2] - at[0] : mean);
}

Status text_table_split_times(NumberTable *table, TextReader reader, double *start,
                              double *interval, Problem *problem) {
    const size_t rows = table->rows;
    double *at = table->at;
    const double mean = (at[2 * rows - 2] - at[0]) / (double)(rows - 1);
    // Printed times are rounded; a missing time shifts all later ones by an interval.
    for (size_t i = 1; i < rows; i++)
        if (!(at[2 * i] - at[2 * i - 2] > 0 &&
              fabs(at[2 * i] - at[0] - (double)i * mean) <= unevenness_max * mean))
            return text_refuse_times(table, mean, reader, problem);
    // Differences of printed decimals: more than twelve digits are rounding.
    const double scale = pow(10, 11 - floor(log10(mean)));
    *interval = isfinite(scale) && scale > 0 ? nearbyint(mean * scale) / scale : mean;
    *start = at[0];
    for (size_t i = 0; i < rows; i++)
        at[i] = at[2 * i + 1];
    table->count = rows;
    return STATUS_OK;
}
