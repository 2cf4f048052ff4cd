// Series, spectra, impacts and energies of a result, each in every format.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/jobs/documents.h"
#include "server/util/clock.h"

// Replies of up to so many bytes are made whole, so that they can be cached and compressed.
enum { WHOLE_MAX = 4 << 20 };

static const double wait_max = 60; // [s]

// --- parts of a reply ---

Status columns_format(const Request *request, size_t parameter, const TableFormat *const *offered,
                      Reply *reply, const TableFormat **format, Problem *problem) {
    ReplyFormat formats[REPLY_FORMATS_MAX];
    size_t count = 0, choice;
    for (; offered[count] != NULL && count < REPLY_FORMATS_MAX; count++)
        formats[count] = (ReplyFormat){offered[count]->extension, offered[count]->content_type};
    TRY(reply_format(request, parameter, formats, count, reply, &choice, problem));
    *format = offered[choice];
    return STATUS_OK;
}

Status columns_window(const Request *request, size_t count, TableStream *stream, Problem *problem) {
    // The half of a rounding on either side keeps a sample that stands at the very time asked for.
    Table *table = &stream->table;
    const double rate = table->axis_rate, end = (double)(count - 1) / rate;
    double from, to;
    size_t points;
    TRY(request_number(request, "from", 0, 1e12, 0, &from, problem));
    TRY(request_number(request, "to", 0, 1e12, end, &to, problem));
    const double first = ceil(from * rate * (1 - 1e-12)), last = floor(to * rate * (1 + 1e-12));
    char text[32], text_to[32];
    if (first > (double)(count - 1))
        return problem_set(problem, STATUS_USAGE,
                           "\"from\" is %s s, behind the last sample at %s s",
                           text_real(text, from), text_real(text_to, end));
    if (last < first)
        return problem_set(problem, STATUS_USAGE, "there is no sample from %s s to %s s",
                           text_real(text, from), text_real(text_to, to));
    table->first = (size_t)first;
    table->count = (last < (double)count ? (size_t)last : count - 1) - table->first + 1;
    if (request_query(request, "points") == NULL)
        return STATUS_OK;
    TRY(request_count(request, "points", 1, 1000000000, 1, &points, problem));
    return table_stream_downsample(stream, points, problem);
}

Status columns_wait(const Request *request, Reply *reply, void *kept, void (*forget)(void *kept),
                    const char *why, Problem *problem) {
    const double left = wait_max - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (left > 0 && !request->is_expired) {
        reply_wait(reply, (int)(1000 * left) + 1, kept, forget);
        return STATUS_OK;
    }
    if (forget != NULL)
        forget(kept);
    reply->retry_after = 5;
    return problem_set(problem, STATUS_BUSY, "%s", why);
}

Status columns_outcome(App *app, const Request *request, Reply *reply, Outcome **outcome,
                       Problem *problem) {
    const char *id = request->parameters[0];
    const Status status = jobs_outcome(app->manager, id, request->callback, outcome, problem);
    if (status == STATUS_GONE)
        results_link_gone(id, reply);
    if (status == STATUS_BUSY)
        reply->retry_after = 2;
    return status == STATUS_OK && *outcome == NULL
               ? columns_wait(request, reply, NULL, NULL,
                              "the series is still being computed again; retry a little later",
                              problem)
               : status;
}

static ptrdiff_t columns_stream_next(void *context, char *target, size_t size) {
    const ptrdiff_t count = table_stream_next(context, target, size);
    return count > 0 ? count : count == 0 ? STREAM_END : STREAM_BROKEN;
}

static void columns_stream_cut(void *context, uint64_t first, uint64_t size) {
    table_stream_cut(context, first, size);
}

Status columns_reply(App *app, Reply *reply, const TableFormat *format, TableStream *stream,
                     Problem *problem) {
    if (stream == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    const Status status = table_stream_open(stream, format, problem);
    if (status != STATUS_OK) {
        table_stream_free(stream);
        return status;
    }
    const uint64_t size = table_stream_size(stream);
    reply->accepts_ranges = format->is_binary;
    if (size != UINT64_MAX ? size <= WHOLE_MAX : table_stream_is_below(stream, WHOLE_MAX)) {
        Bytes bytes = {.most = app->reply_most};
        table_stream_write(stream, &bytes);
        const Status written = table_stream_check(stream, problem);
        table_stream_free(stream);
        if (written == STATUS_OK)
            return reply_bytes(reply, 200, format->content_type, &bytes, problem);
        bytes_clear(&bytes);
        return written;
    }
    reply_borrow(reply, 200, format->content_type, NULL, 0);
    reply->stream = (Stream){.next = columns_stream_next, .size = size, .cut = columns_stream_cut};
    reply->release = table_stream_free;
    reply->context = stream;
    return STATUS_OK;
}

// --- series ---

// "?channels=a,b": those columns in that order; all without it.
static Status series_choose(const Request *request, const Columns *columns, TableStream *stream,
                            Problem *problem) {
    size_t *count = &stream->table.column_count;
    const char *text = request_query(request, "channels");
    if (text == NULL)
        return STATUS_OK;
    char there[256] = "";
    for (size_t i = 0; i < columns->count; i++)
        text_list(there, sizeof there, columns->at[i].name);
    *count = 0;
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
            if (stream->chosen[i] == column)
                return problem_set(problem, STATUS_USAGE, "the channel \"%s\" is named twice",
                                   name);
        stream->chosen[(*count)++] = column;
    }
    return STATUS_OK;
}

static Status series_fill(const Request *request, const TableFormat **format, TableStream *stream,
                          Problem *problem) {
    const Response *response = &stream->outcome->response;
    (void)format;
    if (response->count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the result has no samples");
    TRY(table_stream_series(stream, problem));
    TRY(series_choose(request, &response->series, stream, problem));
    return columns_window(request, response->count, stream, problem);
}

// --- spectra, impacts, energies ---

static Status psd_fill(const Request *request, const TableFormat **format, TableStream *stream,
                       Problem *problem) {
    (void)request;
    (void)format;
    if (stream->outcome->spectrum.densities.count == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "the scene asked for no psd");
    return table_stream_psd(stream, problem);
}

static Status impacts_fill(const Request *request, const TableFormat **format, TableStream *stream,
                           Problem *problem) {
    ImpactWindow window;
    char text[32], text_to[32];
    if (stream->outcome->response.is_unlisted)
        return problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts);
    if (request->query_count == 0)
        return table_stream_impacts(stream, *format, NULL, problem);
    TRY(request_number(request, "from", 0, 1e12, 0, &window.from, problem));
    TRY(request_number(request, "to", 0, 1e12, 1e12, &window.to, problem));
    TRY(request_count(request, "first", 1, 1000000000, 1, &window.first, problem));
    TRY(request_count(request, "limit", 1, 1000000000, 1000000000, &window.limit, problem));
    if (window.from > window.to)
        return problem_set(problem, STATUS_USAGE, "\"from\" is %s s, behind \"to\" at %s s",
                           text_real(text, window.from), text_real(text_to, window.to));
    return table_stream_impacts(stream, *format, &window, problem);
}

// One object, no table.
static const TableFormat energy_json = {.extension = "json", .content_type = type_json};

static Status energy_fill(const Request *request, const TableFormat **format, TableStream *stream,
                          Problem *problem) {
    const Energy *energy = &stream->outcome->response.energy;
    Bytes bytes = {.most = 0};
    (void)request;
    if (*format != &format_json)
        return table_stream_records(stream, energy_fields, energy, 1, sizeof *energy, problem);
    document_energy(&bytes, energy);
    bytes_text(&bytes, "\n");
    segments_text(&stream->segments, &bytes);
    *format = &energy_json;
    return STATUS_OK;
}

typedef struct ResultPart {
    const char *name;
    bool has_chart;
    Status (*fill)(const Request *request, const TableFormat **format, TableStream *stream,
                   Problem *problem);
} ResultPart;

static const ResultPart parts[] = {{"series", true, series_fill},
                                   {"psd", true, psd_fill},
                                   {"impacts", false, impacts_fill},
                                   {"energy", false, energy_fill}};

// The path ends with the part's name. Series alone may have to be computed again.
Status results_part(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *id = request->parameters[0], *name = strrchr(request->route->pattern, '/') + 1;
    const ResultPart *part = parts;
    const TableFormat *format = NULL;
    Outcome *outcome = NULL;
    char tag[104];
    while (strncmp(part->name, name, strlen(part->name)) != 0)
        part++;
    const bool is_series = part == &parts[0];
    TRY(columns_format(request, 1, part->has_chart ? table_formats : table_formats_without_chart,
                       reply, &format, problem));
    snprintf(tag, sizeof tag, "%.72s-%s.%s", id, part->name, format->extension);
    if (is_series) {
        // Nothing is computed again for a client that has it.
        if (request->if_none_match != NULL && !db_result_exists(app->db, id))
            return problem_set(problem, STATUS_NOT_FOUND, "there is no result %.80s", id);
        if (reply_immutable(reply, request, tag))
            return STATUS_OK;
        TRY(columns_outcome(app, request, reply, &outcome, problem));
        if (outcome == NULL)
            return STATUS_OK;
    } else {
        TRY(jobs_outcome_stored(app->manager, id, &outcome, problem));
    }
    TableStream *stream = table_stream_new(outcome);
    const Status status = stream != NULL
                              ? part->fill(request, &format, stream, problem)
                              : problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    if (status == STATUS_OK && (is_series || !reply_immutable(reply, request, tag)))
        return columns_reply(app, reply, format, stream, problem);
    table_stream_free(stream);
    return status;
}
