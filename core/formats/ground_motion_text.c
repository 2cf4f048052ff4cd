// The header ends with the last line that names NPTS or is "*** Begin data ***"; without such a
// line, above the first line that has only numbers. All numbers below are read in reading order;
// the shape of their rows decides between the layouts that the header leaves open.
#include "core/formats/ground_motion_text.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/formats/text_table.h"

enum { HEADER_LINES = 64, LINE_MAX = 512 };

const char *const acceleration_unit_names[] = {[ACCELERATION_G] = "g",
                                               [ACCELERATION_METRES] = "m/s^2",
                                               [ACCELERATION_CENTIMETRES] = "cm/s^2",
                                               NULL};
static const double unit_sizes[] = {[ACCELERATION_G] = 9.80665,
                                    [ACCELERATION_METRES] = 1,
                                    [ACCELERATION_CENTIMETRES] = 0.01}; // [m/s^2]

double acceleration_unit_size(int unit) {
    return unit_sizes[unit];
}

typedef struct MotionHeader {
    const char *layout;   // of the line with the number of samples; NULL: there is none
    size_t count_line;    // that line
    double count;         // samples; NAN: not stated
    double interval;      // [s]; NAN: not stated
    int unit;             // AccelerationUnit; CHOICE_ABSENT: not stated
    size_t unit_line;     // line that states the unit
    size_t conflict_line; // first line that states another unit; 0: none
    bool is_time;         // its last line starts with "time"
    char text[1001];      // lines joined by "; ", cut
    TextReader data;      // starts at the numbers
} MotionHeader;

static bool motion_is_word_edge(char c) {
    return !isalnum((unsigned char)c) && c != '_';
}

// The first occurrence of the word at or after `from` in a line in upper case; NULL: none.
static const char *motion_find_word(const char *line, const char *from, const char *word) {
    const size_t length = strlen(word);
    for (const char *at = from; (at = strstr(at, word)) != NULL; at++)
        if ((at == line || motion_is_word_edge(at[-1])) && motion_is_word_edge(at[length]))
            return at;
    return NULL;
}

// The number that follows `at` in a line; NAN: none.
static double motion_number_at(const TextLine *line, const char *at) {
    TextWord word;
    double value;
    return text_table_next_word(line, &at, &word) && text_table_number(&word, &value) ? value
                                                                                      : (double)NAN;
}

// "NPTS=  4000, DT= .01000 SEC" or "4096    0.0100    NPTS, DT".
static void motion_read_count(const char *seen, MotionHeader *header) {
    const TextLine line = {seen, seen + strlen(seen), 0, "=:,;"};
    const char *points = motion_find_word(seen, seen, "NPTS"),
               *step = motion_find_word(seen, seen, "DT"), *second = seen;
    TextWord first;
    header->count = motion_number_at(&line, seen);
    header->layout = isnan(header->count) ? "at2" : "at2_value_first";
    if (!isnan(header->count) && text_table_next_word(&line, &second, &first)) {
        header->interval = motion_number_at(&line, second);
        return;
    }
    header->count = motion_number_at(&line, points + strlen("NPTS"));
    header->interval = step != NULL ? motion_number_at(&line, step + strlen("DT")) : (double)NAN;
}

static Status motion_check_count(const MotionHeader *header, Problem *problem) {
    if (isnan(header->count))
        return text_table_fault(problem, STATUS_UNREADABLE, header->count_line, 0,
                                "must state the number of values after NPTS, or before it");
    if (header->count < 1 || header->count != floor(header->count))
        return text_table_fault(problem, STATUS_UNREADABLE, header->count_line, 0,
                                "must state a whole number of values of at least 1, states %s",
                                real_text(header->count).at);
    if (!isnan(header->interval) && !(header->interval > 0))
        return text_table_fault(problem, STATUS_UNREADABLE, header->count_line, 0,
                                "must state an interval above 0 s, states %s",
                                real_text(header->interval).at);
    return STATUS_OK;
}

// Whether "M/S" or "M/SEC" continues as an acceleration: ^2, 2, **2, /S or /SEC.
static bool motion_is_squared(const char *at) {
    if (strncmp(at, "EC", 2) == 0)
        at += 2;
    return strncmp(at, "^2", 2) == 0 || *at == '2' || strncmp(at, "**2", 3) == 0 ||
           strncmp(at, "/S", 2) == 0;
}

// Whether a line about units or acceleration has G as a word outside a formula.
static bool motion_names_g(const char *line) {
    if (strstr(line, "UNIT") == NULL && strstr(line, "ACC") == NULL &&
        strstr(line, "(G)") == NULL && strstr(line, "[G]") == NULL)
        return false;
    for (const char *at = line; (at = motion_find_word(line, at, "G")) != NULL; at++)
        if ((at == line || strchr("/*^%", at[-1]) == NULL) &&
            (at[1] == '\0' || strchr("/*^%", at[1]) == NULL))
            return true;
    return false;
}

static void motion_add_unit(MotionHeader *header, AccelerationUnit unit, size_t line) {
    if (header->unit == CHOICE_ABSENT) {
        header->unit = (int)unit;
        header->unit_line = line;
    } else if (header->unit != (int)unit && header->conflict_line == 0) {
        header->conflict_line = line;
    }
}

static void motion_find_units(MotionHeader *header, const char *line, size_t number) {
    if (motion_names_g(line))
        motion_add_unit(header, ACCELERATION_G, number);
    if (motion_find_word(line, line, "GAL") != NULL)
        motion_add_unit(header, ACCELERATION_CENTIMETRES, number);
    for (const char *at = line; (at = strstr(at, "M/S")) != NULL; at++) {
        const bool is_centi = at > line && at[-1] == 'C';
        const char *first = is_centi ? at - 1 : at;
        if ((first == line || motion_is_word_edge(first[-1])) && motion_is_squared(at + 3))
            motion_add_unit(header, is_centi ? ACCELERATION_CENTIMETRES : ACCELERATION_METRES,
                            number);
    }
}

// Velocities and displacements are published in the same layouts.
static Status motion_check_quantity(const char *line, size_t number, Problem *problem) {
    const bool is_velocity = motion_find_word(line, line, "VELOCITY") != NULL;
    if ((!is_velocity && motion_find_word(line, line, "DISPLACEMENT") == NULL) ||
        strstr(line, "ACC") != NULL ||
        (strstr(line, "UNITS") == NULL && strstr(line, "TIME") == NULL))
        return STATUS_OK;
    return text_table_fault(problem, STATUS_UNREADABLE, number, 0,
                            "must be of an acceleration, is of a %s",
                            is_velocity ? "velocity" : "displacement");
}

// Printable ASCII only: the text is copied into others whose limits are in bytes.
static void motion_keep_text(MotionHeader *header, const TextLine *line) {
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

// Refuses a file without a line of numbers; commas or semicolons are the usual reason.
static Status motion_refuse_text(TextReader reader, size_t lines, Problem *problem) {
    TextLine line;
    TextWord word;
    while (reader.line < HEADER_LINES && text_table_next_line(&reader, &line)) {
        const char *at = line.at;
        while (text_table_next_word(&line, &at, &word))
            if (strchr("+-.0123456789", *word.at) != NULL &&
                (memchr(word.at, ',', (size_t)(word.end - word.at)) != NULL ||
                 memchr(word.at, ';', (size_t)(word.end - word.at)) != NULL))
                return text_table_refuse(&line, &word, problem);
    }
    return text_table_fault(problem, STATUS_UNREADABLE, lines > 0 ? lines : 1, 0,
                            "must hold a line of numbers up to here%s",
                            lines < HEADER_LINES ? ", the end of the file" : "");
}

// The number of lines above the numbers, and the one that names NPTS (0: none).
static Status motion_find_data(TextReader reader, size_t *lines, size_t *count_line,
                               Problem *problem) {
    TextLine line;
    char seen[LINE_MAX];
    size_t first_numbers = 0, text_lines = 0;
    const TextReader start = reader;
    *lines = *count_line = 0;
    while (reader.line < HEADER_LINES && text_table_next_line(&reader, &line)) {
        text_table_upper(&line, seen, sizeof seen);
        if (motion_find_word(seen, seen, "NPTS") != NULL)
            *lines = *count_line = line.number;
        else if (text_table_is_marker(&line, "BEGIN"))
            *lines = line.number;
        if (first_numbers == 0 && text_table_numbers(&line, NULL, 0) > 0)
            first_numbers = line.number;
        text_lines = line.number;
    }
    if (*lines > 0)
        return STATUS_OK;
    if (first_numbers == 0)
        return motion_refuse_text(start, text_lines, problem);
    *lines = first_numbers - 1;
    return STATUS_OK;
}

// A line "4684 0.0100" above a single column: number of samples and interval.
static void motion_read_count_line(MotionHeader *header) {
    TextReader reader = header->data;
    TextLine line, next = {0};
    double pair[2]; // count and interval
    if (!text_table_next_line(&reader, &line) || text_table_numbers(&line, pair, 2) != 2)
        return;
    const TextReader behind = reader;
    while (text_table_next_line(&reader, &next) && next.at == next.end)
        ;
    if (text_table_numbers(&next, NULL, 0) != 1 || pair[0] < 2 || pair[0] != floor(pair[0]) ||
        !(pair[1] > 0))
        return;
    header->layout = "count_line";
    header->count_line = line.number;
    header->count = pair[0];
    header->interval = pair[1];
    header->data = behind;
}

static Status motion_read_header(TextReader reader, MotionHeader *header, Problem *problem) {
    *header = (MotionHeader){.count = NAN, .interval = NAN, .unit = CHOICE_ABSENT};
    size_t lines, count_line;
    char seen[LINE_MAX];
    TextLine line;
    TRY(motion_find_data(reader, &lines, &count_line, problem));
    header->count_line = count_line;
    while (reader.line < lines && text_table_next_line(&reader, &line)) {
        text_table_upper(&line, seen, sizeof seen);
        TRY(motion_check_quantity(seen, line.number, problem));
        motion_find_units(header, seen, line.number);
        motion_keep_text(header, &line);
        const char *first = seen + strspn(seen, " \t#%\"");
        header->is_time = strncmp(first, "TIME", 4) == 0 && motion_is_word_edge(first[4]);
        if (line.number == count_line) {
            motion_read_count(seen, header);
            TRY(motion_check_count(header, problem));
        }
    }
    header->data = reader;
    if (header->layout == NULL)
        motion_read_count_line(header);
    return STATUS_OK;
}

static Status motion_read_numbers(TextReader reader, NumberTable *table, Problem *problem) {
    TextLine line;
    bool is_ended = false;
    while (text_table_next_line(&reader, &line)) {
        if (is_ended && line.at < line.end)
            return text_table_fault(problem, STATUS_UNREADABLE, line.number, 0,
                                    "must be empty: the line that ends the numbers is above");
        if (text_table_is_marker(&line, "END"))
            is_ended = true;
        else if (!is_ended)
            TRY(text_table_add_row(table, &line, problem));
    }
    return STATUS_OK;
}

// Whether the first column is a time: more than half of its steps equal its first one.
static bool motion_has_times(const NumberTable *table) {
    const size_t columns = table->columns;
    size_t uneven;
    if (table->rows < 3 || columns < 2 || text_table_uneven_line(table, false, &uneven) != 0)
        return false;
    const double *at = table->at, step = at[columns] - at[0];
    size_t alike = 0;
    for (size_t i = 1; i < table->rows; i++)
        alike += fabs(at[i * columns] - at[(i - 1) * columns] - step) <= 0.3 * step;
    return step > 0 && alike > table->rows / 2;
}

static Status motion_take_times(NumberTable *table, const MotionHeader *header,
                                GroundMotionText *motion, Problem *problem) {
    size_t columns;
    const size_t line = text_table_uneven_line(table, false, &columns);
    if (line == 0 && columns == 2 && table->rows >= 2)
        return text_table_split_times(table, header->data, &motion->start, &motion->interval,
                                      problem);
    return text_table_fault(
        problem, STATUS_UNREADABLE, line > 0 ? line : table->last_line, 0,
        "must hold two columns, a time and its acceleration, as every row; has %zu", columns);
}

static Status motion_check_rows(const NumberTable *table, const MotionHeader *header,
                                Problem *problem) {
    size_t columns;
    if (header->count == (double)table->count)
        return STATUS_OK;
    if (!isnan(header->count))
        return text_table_fault(
            problem, STATUS_UNREADABLE, header->count_line, 0,
            "must state how many values follow: states %s, but %zu follow, the last on line %zu",
            real_text(header->count).at, table->count, table->last_line);
    const size_t line = text_table_uneven_line(table, true, &columns);
    return line == 0 ? STATUS_OK
                     : text_table_fault(problem, STATUS_UNREADABLE, line, 0,
                                        "must have %zu numbers, as the rows before, has %zu",
                                        table->columns, columns);
}

static Status motion_choose_interval(const GroundMotionOptions *options, const MotionHeader *header,
                                     GroundMotionText *motion, Problem *problem) {
    const double stated = !isnan(motion->interval) ? motion->interval : header->interval;
    const size_t line = header->count_line > 0 ? header->count_line : header->data.line + 1;
    motion->interval = isnan(stated) ? options->interval : stated;
    if (isnan(motion->interval))
        return text_table_fault(problem, STATUS_UNREADABLE, line, 0,
                                "must state the interval of the samples, or interval must be "
                                "given");
    if (fabs(stated - options->interval) > 1e-6 * stated) // false where one of them is NAN
        return text_table_fault(problem, STATUS_UNREADABLE, line, 0,
                                "states an interval of %s s, but %s s is given",
                                real_text(stated).at, real_text(options->interval).at);
    return STATUS_OK;
}

static Status motion_choose_unit(const GroundMotionOptions *options, const MotionHeader *header,
                                 GroundMotionText *motion, Problem *problem) {
    motion->stated_unit = header->unit;
    motion->unit = options->unit != CHOICE_ABSENT ? options->unit : header->unit;
    if (options->unit == CHOICE_ABSENT && header->conflict_line != 0)
        return text_table_fault(problem, STATUS_UNREADABLE, header->conflict_line, 0,
                                "states another unit than line %zu, %s: unit must be given",
                                header->unit_line, acceleration_unit_names[header->unit]);
    if (motion->unit != CHOICE_ABSENT)
        return STATUS_OK;
    // PEER's files are in g.
    motion->unit = ACCELERATION_G;
    return strncmp(motion->layout, "at2", 3) == 0
               ? STATUS_OK
               : text_table_fault(problem, STATUS_UNREADABLE, 1, 0,
                                  "must state the unit, or unit must be given: g, m/s^2 or "
                                  "cm/s^2");
}

static Status motion_convert(NumberTable *table, const MotionHeader *header, size_t samples_max,
                             GroundMotionText *motion, Problem *problem) {
    const bool is_short = table->count < 2;
    if (is_short || table->count > samples_max)
        return text_table_fault(problem, is_short ? STATUS_UNREADABLE : STATUS_TOO_LARGE,
                                is_short ? header->data.line + 1 : table->last_line, 0,
                                "must hold 2 to %zu samples from here on, holds %zu", samples_max,
                                table->count);
    for (size_t i = 0; i < table->count; i++) {
        const double value = table->at[i];
        table->at[i] *= unit_sizes[motion->unit];
        if (!isfinite(table->at[i]))
            return text_table_fault(problem, STATUS_UNREADABLE, table->last_line, 0,
                                    "sample %zu, %s, must be finite in m/s^2", i,
                                    real_text(value).at);
    }
    motion->samples = (Reals){table->at, table->count};
    table->at = NULL;
    motion->header = strdup(header->text);
    return motion->header != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a header");
}

static Status motion_read(TextReader reader, const GroundMotionOptions *options, NumberTable *table,
                          GroundMotionText *motion, Problem *problem) {
    MotionHeader header;
    TRY(motion_read_header(reader, &header, problem));
    TRY(motion_read_numbers(header.data, table, problem));
    motion->interval = NAN;
    motion->layout = header.layout != NULL ? header.layout
                     : table->columns == 1 ? "one_column"
                                           : "columns";
    // A number of samples that fits rules out times: the first column only happens to rise.
    if (table->rows > 0 && header.count != (double)table->count &&
        (header.is_time || motion_has_times(table))) {
        motion->layout = "time_acceleration";
        TRY(motion_take_times(table, &header, motion, problem));
    }
    TRY(motion_check_rows(table, &header, problem));
    TRY(motion_choose_interval(options, &header, motion, problem));
    TRY(motion_choose_unit(options, &header, motion, problem));
    return motion_convert(table, &header, table->count_max / 2, motion, problem);
}

Status ground_motion_text_read(const char *text, size_t size, size_t samples_max,
                               const GroundMotionOptions *options, GroundMotionText *motion,
                               Problem *problem) {
    *motion = (GroundMotionText){0};
    NumberTable table = {.count_max = 2 * samples_max};
    TextReader reader;
    Status status = text_table_open(text, size, "", &reader, problem);
    if (status == STATUS_OK)
        status = motion_read(reader, options, &table, motion, problem);
    free(table.at);
    if (status != STATUS_OK)
        ground_motion_text_clear(motion);
    return status;
}

void ground_motion_text_clear(GroundMotionText *motion) {
    free(motion->header);
    free(motion->samples.at);
    *motion = (GroundMotionText){0};
}
