#include "server/api/columns.h"
#include "server/api/results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/downsample.h"
#include "server/formats/svg.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/util/clock.h"
#include "server/util/dtoa.h"

// Up to so many bytes an answer is made at once: then it can be kept, and compressed.
enum { WHOLE_MAX = 4 << 20 };

static const double outcome_wait_most = 60; // [s]

void column_reply_clear(ColumnReply *column_reply) {
    encoding_close(column_reply->encoding);
    free(column_reply->chosen);
    columns_clear(&column_reply->own);
    outcome_unref(column_reply->outcome);
    *column_reply = (ColumnReply){.encoding = NULL};
}

Status column_reply_make(ColumnReply *column_reply, size_t count, Problem *problem) {
    column_reply->chosen = calloc(count + 1, sizeof *column_reply->chosen);
    column_reply->table.columns = column_reply->chosen;
    return column_reply->chosen != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for columns");
}

Status column_reply_own(ColumnReply *column_reply, Problem *problem) {
    free(column_reply->chosen);
    TRY(column_reply_make(column_reply, column_reply->own.count, problem));
    column_reply->table.column_count = column_reply->own.count;
    column_reply->table.count = column_reply->own.rows;
    for (size_t i = 0; i < column_reply->own.count; i++)
        column_reply->chosen[i] = &column_reply->own.at[i];
    return STATUS_OK;
}

Status column_reply_own_axis(ColumnReply *column_reply, Problem *problem) {
    TRY(column_reply_own(column_reply, problem));
    Table *table = &column_reply->table;
    const Column *axis = &column_reply->own.at[0];
    table->axis_name = axis->name;
    table->axis_unit = axis->unit;
    table->axis = axis->values;
    table->columns = column_reply->chosen + 1;
    table->column_count--;
    return STATUS_OK;
}

Status columns_window(const Request *request, size_t count, Table *table, Problem *problem) {
    // The half of a rounding on either side keeps a sample that stands at the very time asked for.
    const double rate = table->axis_rate, end = (double)(count - 1) / rate;
    double from, to;
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
    return STATUS_OK;
}

Status columns_downsample(const Request *request, ColumnReply *column_reply, Problem *problem) {
    Table *table = &column_reply->table;
    Columns buckets;
    size_t most;
    if (request_query(request, "points") == NULL)
        return STATUS_OK;
    TRY(request_count(request, "points", 1, 1000000000, 1, &most, problem));
    const size_t samples = table->count;
    const size_t bucket = (samples + most - 1) / most;
    TRY(downsample(table->columns, table->column_count, table->first, samples, bucket, &buckets,
                   problem));
    columns_clear(&column_reply->own);
    column_reply->own = buckets;
    TRY(column_reply_own(column_reply, problem));
    // Without channels too there is a time for each.
    table->count = (samples + bucket - 1) / bucket;
    table->bucket = bucket;
    table->samples = samples;
    return STATUS_OK;
}

Status columns_format(const Request *request, size_t parameter, bool has_chart, Reply *reply,
                      const TableFormat **encoder, Problem *problem) {
    const char *extension = request->parameters[parameter];
    char known[96] = "";
    const char *types[16] = {NULL};
    const TableFormat *offered[16];
    size_t count = 0;
    int choice = -1;
    for (size_t i = 0; encoders[i] != NULL && count + 1 < COUNT(types); i++) {
        if (encoders[i] == &encoder_svg && !has_chart)
            continue;
        text_list(known, sizeof known, encoders[i]->extension);
        if (extension != NULL && strcmp(extension, encoders[i]->extension) == 0)
            choice = (int)count;
        offered[count] = encoders[i];
        types[count++] = encoders[i]->content_type;
    }
    if (extension == NULL) {
        reply->varies_by_accept = true;
        choice = header_accept(request->accept, types);
    }
    if (choice < 0)
        return extension != NULL
                   ? problem_set(problem, STATUS_NOT_FOUND,
                                 "there is no format \"%.20s\"; there are %s", extension, known)
                   : problem_set(problem, STATUS_NOT_ACCEPTABLE,
                                 "none of the formats fits Accept; there are %s, by extension too",
                                 known);
    *encoder = offered[choice];
    if (*encoder == &encoder_svg)
        reply->policy = reply_drawing_policy;
    return STATUS_OK;
}

Status columns_choose(App *app, const Request *request, Reply *reply, Outcome **outcome,
                      Problem *problem) {
    const char *id = request->parameters[0];
    const Status status = jobs_outcome(app->manager, id, request->callback, outcome, problem);
    if (status == STATUS_GONE)
        results_link_gone(id, reply);
    if (status == STATUS_BUSY)
        reply->retry_after = 2;
    if (status != STATUS_OK || *outcome != NULL)
        return status;
    const double left =
        outcome_wait_most - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (left <= 0 || request->is_expired) {
        reply->retry_after = 5;
        return problem_set(problem, STATUS_BUSY,
                           "the series is still being computed anew; ask again a little later");
    }
    reply_wait(reply, (int)(1000 * left) + 1, NULL, NULL);
    return STATUS_OK;
}

Status columns_outcome(App *app, const Request *request, Reply *reply, const char *what,
                       const char *extension, Outcome **outcome, Problem *problem) {
    const char *id = request->parameters[0];
    char tag[104];
    snprintf(tag, sizeof tag, "%.72s-%s.%s", id, what, extension);
    // Nothing is computed anew for a client who has it.
    if (request->if_none_match != NULL && !db_result_exists(app->db, id))
        return problem_set(problem, STATUS_NOT_FOUND, "there is no result %.80s", id);
    return reply_immutable(reply, request, tag)
               ? STATUS_OK
               : columns_choose(app, request, reply, outcome, problem);
}

static ptrdiff_t stream_next(void *context, char *target, size_t size) {
    const size_t count = encoding_next(((ColumnReply *)context)->encoding, target, size);
    return count > 0 ? (ptrdiff_t)count : STREAM_END;
}

static void stream_cut(void *context, uint64_t first, uint64_t size) {
    encoding_cut(((ColumnReply *)context)->encoding, first, size);
}

static void stream_release(void *context) {
    column_reply_clear(context);
    free(context);
}

// Takes what `sheet` holds, which has its encoding.
static Status reply_stream(Reply *reply, const char *content_type, ColumnReply *column_reply,
                           Problem *problem) {
    ColumnReply *kept = malloc(sizeof *kept);
    if (kept == NULL) {
        column_reply_clear(column_reply);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    }
    *kept = *column_reply;
    *column_reply = (ColumnReply){.encoding = NULL};
    reply_borrow(reply, 200, content_type, NULL, 0);
    reply->stream =
        (Stream){.next = stream_next, .size = encoding_size(kept->encoding), .cut = stream_cut};
    reply->release = stream_release;
    reply->context = kept;
    return STATUS_OK;
}

// Whether a text can be no longer than WHOLE_MAX.
static bool is_short(const Table *table) {
    const size_t most = WHOLE_MAX / (SHORTEST_SIZE + 1);
    return table->count <= most / (table->column_count + 1);
}

static Status reply_whole(App *app, Reply *reply, const char *content_type,
                          ColumnReply *column_reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    const size_t size = (size_t)encoding_size(column_reply->encoding);
    if (bytes_reserve(&bytes, size)) {
        bytes.count = encoding_next(column_reply->encoding, bytes.at, size);
        bytes.at[bytes.count] = '\0';
    }
    column_reply_clear(column_reply);
    return reply_bytes(reply, 200, content_type, &bytes, problem);
}

Status columns_reply(App *app, Reply *reply, const TableFormat *encoder, ColumnReply *column_reply,
                     Problem *problem) {
    reply->accepts_ranges = encoder->is_binary;
    if (!encoder->is_binary && is_short(&column_reply->table)) {
        Bytes bytes = {.most = app->reply_most};
        const Status status = encoding_write(encoder, &column_reply->table, &bytes, problem);
        column_reply_clear(column_reply);
        if (status == STATUS_OK)
            return reply_bytes(reply, 200, encoder->content_type, &bytes, problem);
        bytes_clear(&bytes);
        return status;
    }
    const Status status =
        encoding_open(encoder, &column_reply->table, &column_reply->encoding, problem);
    if (status != STATUS_OK) {
        column_reply_clear(column_reply);
        return status;
    }
    if (encoding_size(column_reply->encoding) <= WHOLE_MAX)
        return reply_whole(app, reply, encoder->content_type, column_reply, problem);
    return reply_stream(reply, encoder->content_type, column_reply, problem);
}

Status columns_reply_segments(App *app, Reply *reply, const char *content_type, Segments *layout,
                              ColumnReply *column_reply, Problem *problem) {
    reply->accepts_ranges = true;
    const Status status = encoding_open_layout(layout, &column_reply->encoding, problem);
    if (status != STATUS_OK) {
        column_reply_clear(column_reply);
        return status;
    }
    if (encoding_size(column_reply->encoding) <= WHOLE_MAX)
        return reply_whole(app, reply, content_type, column_reply, problem);
    return reply_stream(reply, content_type, column_reply, problem);
}
