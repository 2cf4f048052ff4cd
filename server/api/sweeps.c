// Sweeps: the table of rows, also while they are made, and one point of it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/api/studies.h"
#include "server/formats/charts.h"
#include "server/formats/study_formats.h"
#include "server/formats/sweep.h"
#include "server/formats/table_stream.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/jobs/sweep.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"

// Up to so many bytes a text is made at once.
enum { WHOLE_MAX = 4 << 20 };

// A path begins with a result, or with the job that makes it.
static bool sweep_is_of_job(const Request *request) {
    static const char jobs[] = "/v1/jobs/";
    return strncmp(base_path_strip(request->path), jobs, sizeof jobs - 1) == 0;
}

// Rows come, and failed ones may be made again: only a table without either never changes. True:
// the client has it.
static bool sweep_is_unchanged(const Request *request, Reply *reply, const SweepView *view,
                               const char *extension) {
    char tag[112];
    snprintf(tag, sizeof tag, "%.72s-t%zu-%llu.%.5s", view->row.result, view->chunks.count,
             (unsigned long long)view->row.retries, extension);
    if (view->is_complete && view->sweep->table.failed == 0)
        return reply_immutable(reply, request, tag);
    if (view->is_complete)
        return reply_tagged(reply, request, tag);
    snprintf(reply->cache_control, sizeof reply->cache_control, "no-store");
    return false;
}

// A table being sent: a text as far as it is made, or an archive of known size.
typedef struct SweepReply {
    SweepView view;
    SweepSource source;
    SweepDocument document;
    SweepNext next; // NULL: an archive
    Bytes made;
    size_t taken; // of that
    bool is_last;
    TableStream *stream;
} SweepReply;

static void sweep_reply_free(void *context) {
    SweepReply *sending = context;
    table_stream_free(sending->stream);
    bytes_clear(&sending->made);
    sweep_view_clear(&sending->view);
    free(sending);
}

static ptrdiff_t sweep_reply_text(void *context, char *target, size_t size) {
    SweepReply *sending = context;
    Bytes *made = &sending->made;
    size_t sent = 0;
    while (sent < size) {
        if (sending->taken == made->count) {
            if (sending->is_last)
                break;
            made->count = sending->taken = 0;
            sending->is_last = !sending->next(&sending->document, made);
            if (sending->document.is_broken || made->is_failed)
                return STREAM_BROKEN;
        }
        sent += bytes_hand(made, &sending->taken, target + sent, size - sent);
    }
    return sent > 0 ? (ptrdiff_t)sent : STREAM_END;
}

static ptrdiff_t sweep_reply_archive(void *context, char *target, size_t size) {
    SweepReply *sending = context;
    const ptrdiff_t count = table_stream_next(sending->stream, target, size);
    return sending->document.is_broken || count < 0 ? STREAM_BROKEN
           : count > 0                              ? count
                                                    : STREAM_END;
}

static void sweep_reply_cut(void *context, uint64_t first, uint64_t size) {
    table_stream_cut(((SweepReply *)context)->stream, first, size);
}

static Status sweep_error_changed(Problem *problem) {
    return problem_set(
        problem, STATUS_BUSY,
        "the sweep's rows were deleted or made anew while they were read; ask again");
}

// Makes the beginning: a text that ends in it can be kept and compressed.
static Status sweep_reply_begin_text(SweepReply *sending, Problem *problem) {
    Bytes *made = &sending->made;
    while (!sending->is_last && made->count < WHOLE_MAX && !made->is_failed)
        sending->is_last = !sending->next(&sending->document, made);
    return sending->document.is_broken ? sweep_error_changed(problem)
           : made->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the table")
                             : STATUS_OK;
}

static Status sweep_reply_begin_archive(SweepReply *sending, const char *extension,
                                        Problem *problem) {
    static const TableFormat filled = {.is_binary = true};
    sending->stream = table_stream_new(NULL);
    if (sending->stream == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    const Status status =
        sweep_lay(&sending->document, extension, &sending->stream->segments, problem);
    if (status != STATUS_OK)
        return status == STATUS_CONFLICT ? sweep_error_changed(problem) : status;
    return table_stream_open(sending->stream, &filled, problem);
}

// Takes `sending` if it succeeds.
static Status sweep_reply_send(Reply *reply, const StudyFormat *format, SweepReply *sending,
                               Problem *problem) {
    sending->next = sweep_text(format->extension);
    if (sending->next != NULL)
        TRY(sweep_reply_begin_text(sending, problem));
    else
        TRY(sweep_reply_begin_archive(sending, format->extension, problem));
    if (sending->is_last) {
        TRY(reply_bytes(reply, 200, format->content_type, &sending->made, problem));
        sweep_reply_free(sending);
        return STATUS_OK;
    }
    reply_borrow(reply, 200, format->content_type, NULL, 0);
    // As long as rows come, no part of one document fits the next.
    reply->accepts_ranges = sending->stream != NULL && sending->view.is_complete;
    reply->stream = sending->stream != NULL
                        ? (Stream){.next = sweep_reply_archive,
                                   .size = table_stream_size(sending->stream),
                                   .cut = sweep_reply_cut}
                        : (Stream){.next = sweep_reply_text, .size = UINT64_MAX};
    reply->release = sweep_reply_free;
    reply->context = sending;
    return STATUS_OK;
}

static Status sweep_reply_chart(App *app, Reply *reply, const StudyFormat *format,
                                SweepReply *sending, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    const Status status = charts_sweep(sending->view.sweep, &sending->source, &bytes)
                              ? reply_bytes(reply, 200, format->content_type, &bytes, problem)
                              : sweep_error_changed(problem);
    bytes_clear(&bytes);
    if (status == STATUS_OK)
        sweep_reply_free(sending);
    return status;
}

Status sweeps_table(App *app, const Request *request, Reply *reply, Problem *problem) {
    const StudyFormat *format;
    TRY(study_format(request, study_formats(study_sweep.answer), reply, &format, problem));
    SweepReply *sending = calloc(1, sizeof *sending);
    if (sending == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    SweepView *view = &sending->view;
    Status status = sweep_view_load(app->db, request->parameters[0], sweep_is_of_job(request), true,
                                    view, problem);
    if (status == STATUS_OK && sweep_is_unchanged(request, reply, view, format->extension)) {
        sweep_reply_free(sending);
        return STATUS_OK;
    }
    sending->source = (SweepSource){view->rows, sweep_view_read, view};
    sending->document = (SweepDocument){
        .sweep = view->sweep, .source = &sending->source, .result = view->row.result};
    if (status == STATUS_OK)
        status = strcmp(format->extension, "svg") == 0
                     ? sweep_reply_chart(app, reply, format, sending, problem)
                     : sweep_reply_send(reply, format, sending, problem);
    if (status != STATUS_OK)
        sweep_reply_free(sending);
    return status;
}

static Status sweep_read_index(const Request *request, uint64_t *index, Problem *problem) {
    const char *text = request->parameters[1];
    const size_t length = strlen(text);
    if (length == 0 || length > 15 || strspn(text, "0123456789") != length)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "a point is a whole number from 0, \"%.40s\" is none", text);
    *index = strtoull(text, NULL, 10);
    return STATUS_OK;
}

static void sweep_put_point(Bytes *bytes, const SweepView *view, uint64_t index,
                            const SweepPoint *point) {
    const Sweep *sweep = view->sweep;
    bytes_format(bytes, "{\"index\": %llu, \"result\": \"%s\", \"status\": \"%s\", \"why\": ",
                 (unsigned long long)index, view->row.result, sweep_status_names[point->status]);
    bytes_json_string(bytes, point->why[0] != '\0' ? point->why : NULL);
    bytes_text(bytes, ", \"values\": {");
    for (size_t i = 0; i < sweep->axes.count; i++) {
        bytes_text(bytes, i > 0 ? ", " : "");
        bytes_json_string(bytes, sweep->axes.at[i].pointer);
        bytes_format(bytes, ": %s",
                     sweep->axes.at[i].values.at[sweep_value_index(sweep, i, (size_t)index)]);
    }
    bytes_text(bytes, "}, \"metrics\": {");
    for (size_t i = 0; i < sweep->metrics.count; i++) {
        bytes_format(bytes, "%s\"%s\": ", i > 0 ? ", " : "", sweep->metrics.at[i]);
        bytes_real(bytes, point->values[i]);
    }
    bytes_text(bytes, "}, \"scene\": ");
    document_scene(bytes, &point->scene);
    const char *base = base_path(), *id = view->row.result;
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/points/%llu\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/%llu/scene\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"table\": \"%s/v1/results/%s/table.json\"}}\n", base, id);
}

static Status sweep_show_point(App *app, const Request *request, Reply *reply, bool is_scene,
                               Problem *problem) {
    uint64_t index = 0;
    SweepView view = {.sweep = NULL};
    SweepPoint point = {.status = SWEEP_PENDING};
    TRY(sweep_read_index(request, &index, problem));
    Status status = sweep_view_load(app->db, request->parameters[0], false, false, &view, problem);
    if (status == STATUS_OK)
        status = sweep_point_load(&view, index, &point, problem);
    if (status == STATUS_OK) {
        Bytes bytes = {.most = app->reply_most};
        if (is_scene) {
            document_scene(&bytes, &point.scene);
            bytes_text(&bytes, "\n");
        } else {
            sweep_put_point(&bytes, &view, index, &point);
        }
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    study_request_clear(&point.scene);
    sweep_view_clear(&view);
    return status;
}

Status sweeps_point(App *app, const Request *request, Reply *reply, Problem *problem) {
    return sweep_show_point(app, request, reply, false, problem);
}

Status sweeps_scene(App *app, const Request *request, Reply *reply, Problem *problem) {
    return sweep_show_point(app, request, reply, true, problem);
}
