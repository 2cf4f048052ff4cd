// A header ends behind the last line that names NPTS or is "*** Begin data ***"; without such a
// line, before the first line of numbers alone.
#include "core/formats/import_header.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/field.h"
#include "core/formats/ground_motion_text.h"

enum { HEADER_LINES = 64, LINE_SEEN = 512 };

static bool is_word_edge(char c) {
    return !isalnum((unsigned char)c) && c != '_';
}

// The word in a line of capitals, from `from` on; NULL if it is not there.
static const char *word_find(const char *line, const char *from, const char *word) {
    const size_t length = strlen(word);
    for (const char *at = from; (at = strstr(at, word)) != NULL; at++)
        if ((at == line || is_word_edge(at[-1])) && is_word_edge(at[length]))
            return at;
    return NULL;
}

// The number behind `at`, blanks and an equals sign or a colon; NAN if there is none.
static double number_behind(const char *at) {
    while (*at == ' ' || *at == '\t' || *at == '=' || *at == ':')
        at++;
    TextWord word = {at, at};
    double value;
    while (*word.end != '\0' && strchr(" \t,;", *word.end) == NULL)
        word.end++;
    return word.end > word.at && text_number(&word, &value) ? value : (double)NAN;
}

// "NPTS=  4000, DT= .01000 SEC" or "4096    0.0100    NPTS, DT".
static void read_count(const char *line, ImportHeader *header) {
    const char *dt = word_find(line, line, "DT");
    header->count = number_behind(line);
    header->interval = NAN;
    header->layout = "at2_value_first";
    if (!isnan(header->count)) {
        const char *at = line + strspn(line, " \t");
        at += strcspn(at, " \t,;");
        header->interval = number_behind(at + strspn(at, " \t,;"));
        return;
    }
    header->layout = "at2";
    header->count = number_behind(word_find(line, line, "NPTS") + strlen("NPTS"));
    if (dt != NULL)
        header->interval = number_behind(dt + strlen("DT"));
}

static Status check_count(const ImportHeader *header, Problem *problem) {
    char place[64], is[32];
    (void)text_place(place, header->count_line, 0);
    if (isnan(header->count))
        return problem_add(problem, STATUS_UNREADABLE, place,
                           "must tell the number of values behind NPTS, or before it");
    if (header->count < 1 || header->count != floor(header->count))
        return problem_add(problem, STATUS_UNREADABLE, place,
                           "must tell a whole number of values of at least 1, tells %s",
                           text_real(is, header->count));
    if (!isnan(header->interval) && !(header->interval > 0))
        return problem_add(problem, STATUS_UNREADABLE, place,
                           "must tell an interval above 0 s, tells %s",
                           text_real(is, header->interval));
    return STATUS_OK;
}

// Behind "M/S" or "M/SEC": ^2, 2, **2, /S or /SEC.
static bool is_squared(const char *at) {
    if (strncmp(at, "EC", 2) == 0)
        at += 2;
    return strncmp(at, "^2", 2) == 0 || *at == '2' || strncmp(at, "**2", 3) == 0 ||
           strncmp(at, "/S", 2) == 0;
}

// G in a line that speaks of units or acceleration, and not as part of a formula.
static bool has_g(const char *line) {
    if (strstr(line, "UNIT") == NULL && strstr(line, "ACC") == NULL &&
        strstr(line, "(G)") == NULL && strstr(line, "[G]") == NULL)
        return false;
    for (const char *at = line; (at = word_find(line, at, "G")) != NULL; at++)
        if ((at == line || strchr("/*^%", at[-1]) == NULL) &&
            (at[1] == '\0' || strchr("/*^%", at[1]) == NULL))
            return true;
    return false;
}

static void see_unit(ImportHeader *header, AccelerationUnit unit, size_t line) {
    if (header->unit == CHOICE_ABSENT) {
        header->unit = (int)unit;
        header->unit_line = line;
    } else if (header->unit != (int)unit && header->conflict_line == 0) {
        header->conflict_line = line;
    }
}

static void see_units(ImportHeader *header, const char *line, size_t number) {
    if (has_g(line))
        see_unit(header, ACCELERATION_G, number);
    if (word_find(line, line, "GAL") != NULL)
        see_unit(header, ACCELERATION_CENTIMETRES, number);
    for (const char *at = line; (at = strstr(at, "M/S")) != NULL; at++) {
        const bool is_centi = at > line && at[-1] == 'C';
        const char *first = is_centi ? at - 1 : at;
        if ((first == line || is_word_edge(first[-1])) && is_squared(at + 3))
            see_unit(header, is_centi ? ACCELERATION_CENTIMETRES : ACCELERATION_METRES, number);
    }
}

// Velocities and displacements come in the same layouts.
static Status check_quantity(const char *line, size_t number, Problem *problem) {
    const bool is_velocity = word_find(line, line, "VELOCITY") != NULL;
    if ((!is_velocity && word_find(line, line, "DISPLACEMENT") == NULL) ||
        strstr(line, "ACC") != NULL ||
        (strstr(line, "UNITS") == NULL && strstr(line, "TIME") == NULL))
        return STATUS_OK;
    char place[64];
    return problem_add(problem, STATUS_UNREADABLE, text_place(place, number, 0),
                       "must be of an acceleration, is of a %s",
                       is_velocity ? "velocity" : "displacement");
}

// Of the header only what is printable ASCII: it goes on into other texts, with limits in bytes.
static void keep_text(ImportHeader *header, const TextLine *line) {
    const char *at = line->at;
    while (at < line->end && isspace((unsigned char)*at))
        at++;
    size_t used = strlen(header->text);
    if (at < line->end && used > 0 && used + 3 < sizeof header->text) {
        memcpy(header->text + used, "; ", 3);
        used += 2;
    }
    for (; at < line->end && used + 1 < sizeof header->text; at++)
        header->text[used++] = *at == '\t' ? ' ' : isprint((unsigned char)*at) ? *at : '?';
}

// Nowhere is a line of numbers: is it commas that keep them from being numbers?
static Status refuse_text(TextReader reader, size_t lines, Problem *problem) {
    TextLine line;
    TextWord word;
    char place[64];
    while (reader.line < HEADER_LINES && text_line(&reader, &line)) {
        const char *at = line.at;
        while (text_word(&line, &at, &word))
            if (strchr("+-.0123456789", *word.at) != NULL &&
                memchr(word.at, ',', (size_t)(word.end - word.at)) != NULL)
                return text_refuse_word(&line, &word, problem);
    }
    return problem_add(problem, STATUS_UNREADABLE, text_place(place, lines > 0 ? lines : 1, 0),
                       lines < HEADER_LINES
                           ? "must hold a line of numbers up to here, the end of the file"
                           : "must hold a line of numbers up to here");
}

// How many lines stand before the numbers.
static Status count_lines(TextReader reader, size_t *lines, size_t *count_line, Problem *problem) {
    TextLine line;
    char seen[LINE_SEEN];
    size_t first_numbers = 0, text_lines = 0;
    const TextReader start = reader;
    *lines = *count_line = 0;
    while (reader.line < HEADER_LINES && text_line(&reader, &line)) {
        text_capitals(&line, seen, sizeof seen);
        if (word_find(seen, seen, "NPTS") != NULL)
            *lines = *count_line = line.number;
        else if (text_is_mark(&line) && strstr(seen, "BEGIN") != NULL)
            *lines = line.number;
        if (first_numbers == 0 && text_numbers(&line) > 0)
            first_numbers = line.number;
        text_lines = line.number;
    }
    if (*lines > 0)
        return STATUS_OK;
    if (first_numbers == 0)
        return refuse_text(start, text_lines, problem);
    *lines = first_numbers - 1;
    return STATUS_OK;
}

// "4684 0.0100" before a single column: a count and an interval.
static void read_count_line(ImportHeader *header) {
    TextReader reader = header->data;
    TextLine line, next = {0};
    TextWord word;
    if (!text_line(&reader, &line) || text_numbers(&line) != 2)
        return;
    const TextReader behind = reader;
    const char *at = line.at;
    double count = 0, interval = 0;
    (void)(text_word(&line, &at, &word) && text_number(&word, &count));
    (void)(text_word(&line, &at, &word) && text_number(&word, &interval));
    while (text_line(&reader, &next) && next.at == next.end)
        ;
    if (text_numbers(&next) != 1 || count < 2 || count != floor(count) || !(interval > 0))
        return;
    header->layout = "count_line";
    header->count_line = line.number;
    header->count = count;
    header->interval = interval;
    header->data = behind;
}

Status import_header_read(TextReader reader, ImportHeader *header, Problem *problem) {
    *header = (ImportHeader){.count = NAN, .interval = NAN, .unit = CHOICE_ABSENT};
    size_t lines, count_line;
    char seen[LINE_SEEN];
    TextLine line;
    TRY(count_lines(reader, &lines, &count_line, problem));
    header->count_line = count_line;
    while (reader.line < lines && text_line(&reader, &line)) {
        text_capitals(&line, seen, sizeof seen);
        TRY(check_quantity(seen, line.number, problem));
        see_units(header, seen, line.number);
        keep_text(header, &line);
        const char *first = seen + strspn(seen, " \t#%\"");
        header->is_time = strncmp(first, "TIME", 4) == 0 && is_word_edge(first[4]);
        if (line.number == count_line) {
            read_count(seen, header);
            TRY(check_count(header, problem));
        }
    }
    header->data = reader;
    if (header->layout == NULL)
        read_count_line(header);
    return STATUS_OK;
}
