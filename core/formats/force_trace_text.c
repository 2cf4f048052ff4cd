// Printed times are rounded, so each need only be near its place on the straight line through the
// first and the last one.
#include "core/formats/force_trace_text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/formats/text_table.h"

enum { UNIT_MAX = 12 };               // bytes; what is longer is no unit
static const double unevenness = 0.3; // of an interval, that a printed time may be off

typedef struct TraceColumns {
    double *times, *values;
    size_t *lines; // of the rows
    size_t count, room, columns;
} TraceColumns;

static bool grow(TraceColumns *rows) {
    const size_t room = rows->room > 0 ? 2 * rows->room : 4096;
    double *times = realloc(rows->times, room * sizeof *times);
    if (times != NULL)
        rows->times = times;
    double *values = realloc(rows->values, room * sizeof *values);
    if (values != NULL)
        rows->values = values;
    size_t *lines = realloc(rows->lines, room * sizeof *lines);
    if (lines != NULL)
        rows->lines = lines;
    if (times == NULL || values == NULL || lines == NULL)
        return false;
    rows->room = room;
    return true;
}

// "force [kN]" would be read a thousand times too small.
static Status check_header(const TextLine *line, Problem *problem) {
    char place[64];
    for (const char *at = line->at; at < line->end; at++) {
        if (*at != '[' && *at != '(')
            continue;
        const char *begin = at + 1, *end = begin;
        while (end < line->end && *end != ']' && *end != ')')
            end++;
        const ptrdiff_t size = end - begin;
        const bool is_right = size == 1 && (*begin == 's' || *begin == 'N');
        if (is_right || size > UNIT_MAX)
            continue;
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, line->number, 0),
                           "must have times in [s] and forces in [N], tells [%.*s]", (int)size,
                           begin);
    }
    return STATUS_OK;
}

static Status read_row(const TextLine *line, TraceColumns *rows, Problem *problem) {
    const char *at = line->at;
    double numbers[2] = {NAN, NAN};
    size_t count = 0;
    char place[64];
    TextWord word;
    while (text_word(line, &at, &word)) {
        double number;
        if (!text_number(&word, &number))
            return text_refuse_word(line, &word, problem);
        if (count < 2)
            numbers[count] = number;
        count++;
    }
    if (count == 0)
        return STATUS_OK;
    if (rows->columns == 0)
        rows->columns = count;
    if (count > 2 || count != rows->columns)
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, line->number, 0),
                           "must have %s, has %zu numbers",
                           count > 2 ? "a time and its force, or the force alone"
                                     : "as many numbers as the rows above",
                           count);
    if (rows->count == TRACE_SAMPLES_MAX)
        return problem_add(problem, STATUS_TOO_LARGE, text_place(place, line->number, 0),
                           "must have at most %d samples up to here", TRACE_SAMPLES_MAX);
    if (rows->count == rows->room && !grow(rows))
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a trace");
    rows->times[rows->count] = numbers[0];
    rows->values[rows->count] = numbers[count - 1];
    rows->lines[rows->count++] = line->number;
    return STATUS_OK;
}

static Status read_rows(TextReader reader, TraceColumns *rows, Problem *problem) {
    TextLine line;
    while (text_line(&reader, &line)) {
        if (rows->count == 0 && text_numbers(&line) == 0)
            TRY(check_header(&line, problem));
        else
            TRY(read_row(&line, rows, problem));
    }
    return STATUS_OK;
}

static Status take_times(const TraceColumns *rows, double *interval, Problem *problem) {
    const double *times = rows->times;
    const double mean = (times[rows->count - 1] - times[0]) / (double)(rows->count - 1);
    char place[64], is[32], before[32];
    bool is_even = true;
    size_t worst = 1; // what is wrong bends the mean, and with it all that is behind
    for (size_t i = 1; i < rows->count; i++) {
        const double step = times[i] - times[i - 1];
        is_even = is_even && step > 0 &&
                  fabs(times[i] - times[0] - (double)i * mean) <= unevenness * mean;
        if (fabs(step - mean) > fabs(times[worst] - times[worst - 1] - mean))
            worst = i;
    }
    if (!is_even)
        return problem_add(problem, STATUS_UNREADABLE, text_place(place, rows->lines[worst], 0),
                           "times must rise evenly: is %s s after %s s, where steps are %.4g s",
                           text_real(is, times[worst]), text_real(before, times[worst - 1]),
                           rows->count > 2 && worst > 1 ? times[1] - times[0] : mean);
    // Differences of printed decimals: twelve digits are all they have.
    const double scale = pow(10, 11 - floor(log10(mean)));
    *interval = isfinite(scale) && scale > 0 ? nearbyint(mean * scale) / scale : mean;
    return STATUS_OK;
}

static Status take(TraceColumns *rows, double interval, Trace *trace, Problem *problem) {
    char is[32], asked[32];
    if (rows->count == 0)
        return problem_set(problem, STATUS_UNREADABLE,
                           "has no line of numbers: a time in s and a force in N, or the force "
                           "alone");
    if (rows->count < 2)
        return problem_set(problem, STATUS_UNREADABLE, "has %zu samples; must have at least 2",
                           rows->count);
    if (rows->columns == 1 && isnan(interval))
        return problem_set(problem, STATUS_UNREADABLE,
                           "has forces alone: --interval must tell the time between samples");
    trace->interval = interval;
    if (rows->columns == 2) {
        TRY(take_times(rows, &trace->interval, problem));
        if (!isnan(interval) && !(fabs(interval - trace->interval) <= 1e-6 * interval))
            return problem_set(problem, STATUS_UNREADABLE,
                               "tells an interval of %s s, but %s s is given",
                               text_real(is, trace->interval), text_real(asked, interval));
    }
    trace->force = (Reals){rows->values, rows->count};
    rows->values = NULL;
    return STATUS_OK;
}

Status force_trace_text_read(const char *text, size_t size, double interval, Trace *trace,
                             Problem *problem) {
    TraceColumns rows = {0};
    // A byte order mark of UTF-8.
    const size_t skipped = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    TRY(text_check(text + skipped, size - skipped, problem));
    char *spaced = malloc(size + 1);
    if (spaced == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a trace");
    for (size_t i = skipped; i < size; i++)
        spaced[i] = (char)(text[i] == ',' || text[i] == ';' ? ' ' : text[i]);
    Status status = read_rows((TextReader){spaced + skipped, spaced + size, 0}, &rows, problem);
    if (status == STATUS_OK)
        status = take(&rows, interval, trace, problem);
    free(spaced);
    free(rows.times);
    free(rows.values);
    free(rows.lines);
    return status;
}
