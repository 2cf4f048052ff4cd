// Header, then all numbers in reading order; what their rows look like tells the rest of the
// layout. Every word is looked at a fixed number of times, so the time is linear in the size.
#include "core/formats/ground_motion_text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/import_header.h"
#include "core/formats/text_table.h"

enum { VALUES_MAX = 2 * RECORD_SAMPLES };

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

// The numbers of a file as its rows hold them.
typedef struct Numbers {
    double *at;
    size_t count, room;
    size_t rows, columns; // columns of the first row
    size_t last_line;     // with numbers
    size_t uneven_line;   // the first row but the last with another number of columns; 0: none
    size_t uneven_count;  // its columns
    size_t last_columns;  // of the last row
} Numbers;

static Status numbers_add(Numbers *numbers, double value, size_t line, Problem *problem) {
    if (numbers->count == VALUES_MAX) {
        char place[64];
        return problem_add(problem, STATUS_TOO_LARGE, text_place(place, line, 0),
                           "must hold at most %d numbers up to here", VALUES_MAX);
    }
    if (numbers->count == numbers->room) {
        const size_t room = numbers->room > 0 ? 2 * numbers->room : 4096;
        double *at = realloc(numbers->at, room * sizeof *at);
        if (at == NULL)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu samples", room);
        numbers->at = at;
        numbers->room = room;
    }
    numbers->at[numbers->count++] = value;
    return STATUS_OK;
}

static Status read_row(Numbers *numbers, const TextLine *line, Problem *problem) {
    const char *at = line->at;
    const size_t before = numbers->count;
    TextWord word;
    double value;
    while (text_word(line, &at, &word)) {
        if (!text_number(&word, &value))
            return text_refuse_word(line, &word, problem);
        TRY(numbers_add(numbers, value, line->number, problem));
    }
    const size_t columns = numbers->count - before;
    if (columns == 0)
        return STATUS_OK;
    // The row before was not the last one.
    if (numbers->rows > 0 && numbers->last_columns != numbers->columns &&
        numbers->uneven_line == 0) {
        numbers->uneven_line = numbers->last_line;
        numbers->uneven_count = numbers->last_columns;
    }
    if (numbers->rows++ == 0)
        numbers->columns = columns;
    numbers->last_columns = columns;
    numbers->last_line = line->number;
    return STATUS_OK;
}

static Status read_numbers(TextReader reader, Numbers *numbers, Problem *problem) {
    TextLine line;
    bool is_ended = false;
    char place[64], seen[64];
    while (text_line(&reader, &line)) {
        text_capitals(&line, seen, sizeof seen);
        if (is_ended && line.at < line.end)
            return problem_add(problem, STATUS_UNREADABLE, text_place(place, line.number, 0),
                               "must be empty, as the line that ends the numbers is above");
        if (text_is_mark(&line) && strstr(seen, "END") != NULL)
            is_ended = true;
        else if (!is_ended)
            TRY(read_row(numbers, &line, problem));
    }
    return STATUS_OK;
}

// The line of row `row` of the numbers.
static size_t row_line(TextReader reader, size_t row) {
    TextLine line = {0};
    while (text_line(&reader, &line))
        if (text_numbers(&line) > 0 && row-- == 0)
            break;
    return line.number;
}

// Whether the first column is a time: most of its steps are as its first one.
static bool has_times(const Numbers *numbers) {
    const size_t columns = numbers->columns;
    if (numbers->rows < 3 || columns < 2 || numbers->uneven_line != 0 ||
        numbers->last_columns != columns)
        return false;
    const double *at = numbers->at, step = at[columns] - at[0];
    size_t alike = 0;
    for (size_t i = 1; i < numbers->rows; i++)
        alike += fabs(at[i * columns] - at[(i - 1) * columns] - step) <= 0.3 * step;
    return step > 0 && alike > numbers->rows / 2;
}

// Leaves the accelerations in numbers->at; the first one's time, and their interval.
static Status take_times(Numbers *numbers, const ImportHeader *header, double *start,
                         double *interval, Problem *problem) {
    const size_t rows = numbers->rows;
    double *at = numbers->at;
    char place[64], now[32], then[32], step[32];
    if (numbers->columns != 2 || numbers->uneven_line != 0 || numbers->last_columns != 2 ||
        rows < 2) {
        const size_t line = numbers->uneven_line != 0 ? numbers->uneven_line : numbers->last_line;
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, line, 0),
                           "must hold two columns, a time and its acceleration, as every row; has "
                           "%zu",
                           numbers->uneven_line != 0 ? numbers->uneven_count
                                                     : numbers->last_columns);
    }
    const double mean = (at[2 * rows - 2] - at[0]) / (double)(rows - 1);
    // Printed times are rounded, and a time that is missing shifts all later ones by an interval.
    for (size_t i = 1; i < rows; i++) {
        const double gained = at[2 * i] - at[2 * i - 2];
        if (gained > 0 && fabs(gained - mean) <= 0.6 * mean &&
            fabs(at[2 * i] - at[0] - (double)i * mean) <= 0.3 * mean)
            continue;
        // What is wrong bends the mean, and with it what is behind; itself it is furthest from it.
        size_t row = 1;
        for (size_t j = 2; j < rows; j++)
            if (fabs(at[2 * j] - at[2 * j - 2] - mean) > fabs(at[2 * row] - at[2 * row - 2] - mean))
                row = j;
        return problem_add(problem, STATUS_UNREADABLE,
                           text_place(place, row_line(header->data, row), 0),
                           "times must rise evenly: is %s s after %s s, where steps are %s s",
                           text_real(now, at[2 * row]), text_real(then, at[2 * row - 2]),
                           text_real(step, row > 1 ? at[2] - at[0] : mean));
    }
    // Differences of printed decimals: twelve digits are all they have.
    const double scale = pow(10, 11 - floor(log10(mean)));
    *interval = isfinite(scale) && scale > 0 ? nearbyint(mean * scale) / scale : mean;
    *start = at[0];
    for (size_t i = 0; i < rows; i++)
        at[i] = at[2 * i + 1];
    numbers->count = rows;
    return STATUS_OK;
}

static Status check_rows(const Numbers *numbers, const ImportHeader *header, Problem *problem) {
    char place[64], count[32];
    if (!isnan(header->count)) {
        if (header->count == (double)numbers->count)
            return STATUS_OK;
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, header->count_line, 0),
                           "must tell how many values follow: tells %s, but %zu follow, the last "
                           "on line %zu",
                           text_real(count, header->count), numbers->count, numbers->last_line);
    }
    if (numbers->uneven_line != 0 || numbers->last_columns > numbers->columns)
        return problem_add(
            problem, STATUS_UNREADABLE,
            text_place(place, numbers->uneven_line != 0 ? numbers->uneven_line : numbers->last_line,
                       0),
            "must have %zu numbers, as the rows before, has %zu", numbers->columns,
            numbers->uneven_line != 0 ? numbers->uneven_count : numbers->last_columns);
    return STATUS_OK;
}

static Status choose_interval(const GroundMotionOptions *request, const ImportHeader *header,
                              GroundMotionText *import, Problem *problem) {
    const double told = !isnan(import->interval) ? import->interval : header->interval;
    char place[64], is[32], asked[32];
    (void)text_place(place, header->count_line > 0 ? header->count_line : header->data.line + 1, 0);
    if (isnan(told) && isnan(request->interval))
        return problem_add(problem, STATUS_UNREADABLE, place,
                           "must tell the interval of the samples, or interval must be given");
    if (!isnan(told) && !isnan(request->interval) &&
        !(fabs(told - request->interval) <= 1e-6 * told))
        return problem_add(problem, STATUS_UNREADABLE, place,
                           "tells an interval of %s s, but %s s is given", text_real(is, told),
                           text_real(asked, request->interval));
    import->interval = isnan(told) ? request->interval : told;
    return STATUS_OK;
}

static Status choose_unit(const GroundMotionOptions *request, const ImportHeader *header,
                          GroundMotionText *import, Problem *problem) {
    char place[64];
    import->stated_unit = header->unit;
    import->unit = request->unit;
    if (request->unit != CHOICE_ABSENT)
        return STATUS_OK;
    import->unit = header->unit;
    if (header->conflict_line != 0)
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, header->conflict_line, 0),
                           "tells another unit than line %zu, %s: unit must be given",
                           header->unit_line, acceleration_unit_names[header->unit]);
    if (header->unit != CHOICE_ABSENT)
        return STATUS_OK;
    // PEER's files are in g.
    import->unit = ACCELERATION_G;
    if (strncmp(import->layout, "at2", 3) == 0)
        return STATUS_OK;
    return problem_add(problem, STATUS_UNREADABLE, text_place(place, 1, 0),
                       "must tell the unit, or unit must be given: g, m/s^2 or cm/s^2");
}

static Status convert(Numbers *numbers, const ImportHeader *header, GroundMotionText *import,
                      Problem *problem) {
    char place[64], is[32];
    if (numbers->count < 2 || numbers->count > RECORD_SAMPLES)
        return problem_add(
            problem, numbers->count < 2 ? STATUS_UNREADABLE : STATUS_TOO_LARGE,
            text_place(place, numbers->count < 2 ? header->data.line + 1 : numbers->last_line, 0),
            "must hold 2 to %d samples from here on, holds %zu", RECORD_SAMPLES, numbers->count);
    for (size_t i = 0; i < numbers->count; i++) {
        const double value = numbers->at[i];
        numbers->at[i] *= unit_sizes[import->unit];
        if (!isfinite(numbers->at[i]))
            return problem_add(problem, STATUS_UNREADABLE, text_place(place, numbers->last_line, 0),
                               "sample %zu, %s, must be finite in m/s^2", i, text_real(is, value));
    }
    import->samples = (Reals){numbers->at, numbers->count};
    numbers->at = NULL;
    import->header = strdup(header->text);
    return import->header != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a header");
}

static Status read_all(TextReader reader, const GroundMotionOptions *request, Numbers *numbers,
                       GroundMotionText *import, Problem *problem) {
    ImportHeader header;
    TRY(import_header_read(reader, &header, problem));
    TRY(read_numbers(header.data, numbers, problem));
    import->interval = NAN;
    import->layout = header.layout != NULL   ? header.layout
                     : numbers->columns == 1 ? "one_column"
                                             : "columns";
    // A count that fits tells columns of a rising acceleration from times.
    if (numbers->rows > 0 && header.count != (double)numbers->count &&
        (header.is_time || has_times(numbers))) {
        import->layout = "time_acceleration";
        TRY(take_times(numbers, &header, &import->start, &import->interval, problem));
    }
    TRY(check_rows(numbers, &header, problem));
    TRY(choose_interval(request, &header, import, problem));
    TRY(choose_unit(request, &header, import, problem));
    return convert(numbers, &header, import, problem);
}

Status ground_motion_text_read(const char *text, size_t size, const GroundMotionOptions *request,
                               GroundMotionText *import, Problem *problem) {
    *import = (GroundMotionText){0};
    Numbers numbers = {0};
    // A byte order mark of UTF-8.
    const size_t skipped = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    Status status = text_check(text + skipped, size - skipped, problem);
    if (status == STATUS_OK)
        status = read_all((TextReader){text + skipped, text + size, 0}, request, &numbers, import,
                          problem);
    free(numbers.at);
    if (status != STATUS_OK)
        ground_motion_text_clear(import);
    return status;
}

void ground_motion_text_clear(GroundMotionText *import) {
    free(import->header);
    free(import->samples.at);
    *import = (GroundMotionText){0};
}
