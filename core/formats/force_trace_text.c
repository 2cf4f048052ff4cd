#include "core/formats/force_trace_text.h"

#include <math.h>
#include <stdlib.h>

#include "core/formats/text_table.h"

enum { UNIT_MAX = 12 }; // bytes; longer text in brackets is not a unit

// A force in "[kN]" would be a thousand times too small.
static Status force_trace_check_header(const TextLine *line, Problem *problem) {
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
        return text_table_fault(problem, STATUS_UNREADABLE, line->number, 0,
                                "must have times in [s] and forces in [N], has [%.*s]", (int)size,
                                begin);
    }
    return STATUS_OK;
}

static Status force_trace_read_rows(TextReader reader, size_t samples_max, NumberTable *table,
                                    Problem *problem) {
    TextLine line;
    while (text_table_next_line(&reader, &line)) {
        if (table->rows == 0 && text_table_numbers(&line, NULL, 0) == 0) {
            TRY(force_trace_check_header(&line, problem));
            continue;
        }
        const size_t before = table->count;
        TRY(text_table_add_row(table, &line, problem));
        const size_t columns = table->count - before;
        if (columns > 2 || (columns > 0 && columns != table->columns))
            return text_table_fault(problem, STATUS_UNREADABLE, line.number, 0,
                                    "must have %s, has %zu numbers",
                                    columns > 2 ? "a time and its force, or the force alone"
                                                : "as many numbers as the rows above",
                                    columns);
        if (table->rows > samples_max)
            return text_table_fault(problem, STATUS_TOO_LARGE, line.number, 0,
                                    "must have at most %zu samples up to here", samples_max);
    }
    return STATUS_OK;
}

static Status force_trace_take_table(NumberTable *table, TextReader reader, double *interval,
                                     Problem *problem) {
    if (table->rows == 0)
        return problem_set(problem, STATUS_UNREADABLE,
                           "has no line of numbers: a time in s and a force in N, or the force "
                           "alone");
    if (table->rows < 2)
        return problem_set(problem, STATUS_UNREADABLE, "has %zu samples; must have at least 2",
                           table->rows);
    if (table->columns == 1)
        return !isnan(*interval)
                   ? STATUS_OK
                   : problem_set(
                         problem, STATUS_UNREADABLE,
                         "has forces alone: --interval must state the time between samples");
    double start, found;
    TRY(text_table_split_times(table, reader, &start, &found, problem));
    if (!isnan(*interval) && !(fabs(*interval - found) <= 1e-6 * *interval))
        return problem_set(problem, STATUS_UNREADABLE,
                           "states an interval of %s s, but %s s is given", real_text(found).at,
                           real_text(*interval).at);
    *interval = found;
    return STATUS_OK;
}

Status force_trace_text_read(const char *text, size_t size, size_t samples_max, double *interval,
                             Reals *force, Problem *problem) {
    *force = (Reals){NULL, 0};
    TextReader reader;
    TRY(text_table_open(text, size, ",;", &reader, problem));
    NumberTable table = {.count_max = 2 * samples_max + 2};
    Status status = force_trace_read_rows(reader, samples_max, &table, problem);
    if (status == STATUS_OK)
        status = force_trace_take_table(&table, reader, interval, problem);
    if (status == STATUS_OK)
        *force = (Reals){table.at, table.count};
    else
        free(table.at);
    return status;
}
