// Time series: which channels, which window, and all its samples or the extremes of buckets of
// them. They come from the Outcome, which is in memory or is computed anew by a worker while the
// request sleeps.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/api/tables.h"
#include "server/encode/buckets.h"

static void list_names(const Columns *columns, char *target, size_t size) {
    target[0] = '\0';
    for (size_t i = 0; i < columns->count; i++) {
        const size_t used = strlen(target), more = strlen(columns->at[i].name) + 2;
        if (used + more + sizeof ", and 1000 more" > size) {
            snprintf(target + used, size - used, ", and %zu more", columns->count - i);
            return;
        }
        snprintf(target + used, size - used, "%s%s", i > 0 ? ", " : "", columns->at[i].name);
    }
}

// "?channels=a,b": those columns in that order; all without it.
static Status choose_columns(const Request *request, const Columns *columns, const Column **chosen,
                             size_t *count, Problem *problem) {
    const char *text = request_query(request, "channels");
    *count = 0;
    if (text == NULL) {
        for (size_t i = 0; i < columns->count; i++)
            chosen[(*count)++] = &columns->at[i];
        return STATUS_OK;
    }
    char there[256];
    list_names(columns, there, sizeof there);
    for (const char *at = text; at != NULL;
         at = strchr(at, ',') != NULL ? strchr(at, ',') + 1 : NULL) {
        char name[48];
        snprintf(name, sizeof name, "%.*s", (int)strcspn(at, ","), at);
        const Column *column = columns_find(columns, name);
        if (column == NULL)
            return problem_set(problem, STATUS_NOT_FOUND,
                               "the scene did not ask for the channel \"%s\"; there are: %s", name,
                               there[0] != '\0' ? there : "none");
        for (size_t i = 0; i < *count; i++)
            if (chosen[i] == column)
                return problem_set(problem, STATUS_USAGE, "the channel \"%s\" is named twice",
                                   name);
        chosen[(*count)++] = column;
    }
    return STATUS_OK;
}

static Status choose_rows(const Request *request, const Response *response, Table *table,
                          Problem *problem) {
    // The half of a rounding on either side keeps a sample that stands at the very time asked for.
    const double rate = response->sample_rate, end = (double)(response->count - 1) / rate;
    double from, to;
    TRY(request_number(request, "from", 0, 1e12, 0, &from, problem));
    TRY(request_number(request, "to", 0, 1e12, end, &to, problem));
    const double first = ceil(from * rate * (1 - 1e-12)), last = floor(to * rate * (1 + 1e-12));
    char text[32], text_to[32];
    if (first > (double)(response->count - 1))
        return problem_set(problem, STATUS_USAGE,
                           "\"from\" is %s s, behind the last sample at %s s",
                           text_real(text, from), text_real(text_to, end));
    if (last < first)
        return problem_set(problem, STATUS_USAGE, "there is no sample from %s s to %s s",
                           text_real(text, from), text_real(text_to, to));
    table->first = (size_t)first;
    table->count =
        (last < (double)response->count ? (size_t)last : response->count - 1) - table->first + 1;
    return STATUS_OK;
}

// "?points=n": at most n buckets, all of one size but the last.
static Status choose_buckets(const Request *request, Sheet *sheet, Problem *problem) {
    Table *table = &sheet->table;
    size_t most;
    if (request_query(request, "points") == NULL)
        return STATUS_OK;
    TRY(request_count(request, "points", 1, 1000000000, 1, &most, problem));
    const size_t samples = table->count;
    const size_t bucket = (samples + most - 1) / most;
    TRY(buckets_make(table->columns, table->column_count, table->first, samples, bucket,
                     &sheet->own, problem));
    TRY(sheet_own(sheet, problem));
    // Without channels too there is a time for each.
    table->count = (samples + bucket - 1) / bucket;
    table->bucket = bucket;
    table->samples = samples;
    return STATUS_OK;
}

static Status choose(const Request *request, Sheet *sheet, Problem *problem) {
    const Response *response = &sheet->outcome->response;
    sheet->table =
        (Table){.axis_name = "time", .axis_unit = "s", .axis_rate = response->sample_rate};
    if (response->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no samples");
    TRY(sheet_make(sheet, response->series.count, problem));
    TRY(choose_columns(request, &response->series, sheet->chosen, &sheet->table.column_count,
                       problem));
    TRY(choose_rows(request, response, &sheet->table, problem));
    return choose_buckets(request, sheet, problem);
}

Status results_series(App *app, const Request *request, Reply *reply, Problem *problem) {
    const Encoder *encoder = NULL;
    Sheet sheet = {.encoding = NULL};
    TRY(tables_encoder(request, 1, reply, &encoder, problem));
    TRY(tables_outcome(app, request, reply, "series", encoder->extension, &sheet.outcome, problem));
    if (sheet.outcome == NULL)
        return STATUS_OK;
    const Status status = choose(request, &sheet, problem);
    if (status == STATUS_OK)
        return tables_reply(app, reply, encoder, &sheet, problem);
    sheet_clear(&sheet);
    return status;
}
