// Time series: which channels, which window, and all its samples or the extremes of buckets of
// them. They come from the Outcome, which is in memory or is computed anew by a worker while the
// request sleeps.
#include <stdio.h>
#include <string.h>

#include "server/api/columns.h"

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

static Status choose(const Request *request, ColumnReply *column_reply, Problem *problem) {
    const Response *response = &column_reply->outcome->response;
    column_reply->table =
        (Table){.axis_name = "time", .axis_unit = "s", .axis_rate = response->sample_rate};
    if (response->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no samples");
    TRY(column_reply_make(column_reply, response->series.count, problem));
    TRY(choose_columns(request, &response->series, column_reply->chosen,
                       &column_reply->table.column_count, problem));
    TRY(columns_window(request, response->count, &column_reply->table, problem));
    return columns_downsample(request, column_reply, problem);
}

Status results_series(App *app, const Request *request, Reply *reply, Problem *problem) {
    const TableFormat *encoder = NULL;
    ColumnReply column_reply = {.encoding = NULL};
    TRY(columns_format(request, 1, true, reply, &encoder, problem));
    TRY(columns_outcome(app, request, reply, "series", encoder->extension, &column_reply.outcome,
                        problem));
    if (column_reply.outcome == NULL)
        return STATUS_OK;
    const Status status = choose(request, &column_reply, problem);
    if (status == STATUS_OK)
        return columns_reply(app, reply, encoder, &column_reply, problem);
    column_reply_clear(&column_reply);
    return status;
}
