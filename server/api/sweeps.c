// Sweeps: the table of rows, also while they come, one point of it, and failed points once more.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_json.h"
#include "server/api/studies.h"
#include "server/formats/charts.h"
#include "server/formats/encoding.h"
#include "server/formats/study_formats.h"
#include "server/formats/sweep_columns.h"
#include "server/formats/sweep_table.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/jobs/sweep.h"
#include "server/json/encode.h"
#include "server/util/base_path.h"

// Up to so many bytes a text is made at once.
enum { WHOLE_MAX = 4 << 20 };

// A path begins with a result, or with the job that makes it.
static bool is_of_job(const Request *request) {
    static const char jobs[] = "/v1/jobs/";
    return strncmp(base_path_strip(request->path), jobs, sizeof jobs - 1) == 0;
}

// Rows come, and failed ones may be made again: only a table without either never changes.
static bool is_known(const Request *request, Reply *reply, const SweepView *show,
                     const char *extension) {
    char tag[112];
    snprintf(tag, sizeof tag, "%.72s-t%zu-%llu.%.5s", show->row.result, show->chunks.count,
             (unsigned long long)show->row.retries, extension);
    if (show->is_complete && show->sweep->table.failed == 0)
        return reply_immutable(reply, request, tag);
    if (show->is_complete)
        return reply_tagged(reply, request, tag);
    snprintf(reply->cache_control, sizeof reply->cache_control, "no-store");
    return false;
}

// A table on its way: a text as far as it is made, or an archive whose every byte has its place.
typedef struct Sending {
    SweepView show;
    SweepSource source;
    bool (*next)(SweepText *text, Bytes *bytes); // NULL: an archive
    SweepText text;
    Bytes made;
    size_t taken; // of that
    bool is_last;
    const TableFormat *encoder; // of an archive; NULL: NPZ
    SweepArchive archive;
    Encoding *encoding;
} Sending;

static void sending_free(void *context) {
    Sending *sending = context;
    encoding_close(sending->encoding);
    bytes_clear(&sending->made);
    sweep_view_clear(&sending->show);
    free(sending);
}

static ptrdiff_t text_next(void *context, char *target, size_t size) {
    Sending *sending = context;
    Bytes *made = &sending->made;
    size_t sent = 0;
    while (sent < size) {
        if (sending->taken == made->count) {
            if (sending->is_last)
                break;
            made->count = sending->taken = 0;
            sending->is_last = !sending->next(&sending->text, made);
            if (sending->text.is_broken || made->is_failed)
                return STREAM_BROKEN;
        }
        sent += bytes_hand(made, &sending->taken, target + sent, size - sent);
    }
    return sent > 0 ? (ptrdiff_t)sent : STREAM_END;
}

static ptrdiff_t archive_next(void *context, char *target, size_t size) {
    Sending *sending = context;
    const size_t count = encoding_next(sending->encoding, target, size);
    return sending->archive.is_broken ? STREAM_BROKEN : count > 0 ? (ptrdiff_t)count : STREAM_END;
}

static void archive_cut(void *context, uint64_t first, uint64_t size) {
    encoding_cut(((Sending *)context)->encoding, first, size);
}

static Status refuse_changed(Problem *problem) {
    return problem_set(
        problem, STATUS_BUSY,
        "the sweep's rows were deleted or made anew while they were read; ask again");
}

// The beginning at once: where that is all it can be kept, and compressed.
static Status begin_text(Sending *sending, Problem *problem) {
    Bytes *made = &sending->made;
    while (!sending->is_last && made->count < WHOLE_MAX && !made->is_failed)
        sending->is_last = !sending->next(&sending->text, made);
    return sending->text.is_broken ? refuse_changed(problem)
           : made->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the table")
                             : STATUS_OK;
}

static Status begin_archive(Sending *sending, Problem *problem) {
    Segments layout = {0};
    const Status status =
        sending->encoder != NULL
            ? sweep_columns_lay(&sending->archive, sending->encoder, &layout, problem)
            : sweep_npz_lay(&sending->archive, &layout, problem);
    if (status != STATUS_OK) {
        segments_clear(&layout);
        return status == STATUS_CONFLICT ? refuse_changed(problem) : status;
    }
    return encoding_open_layout(&layout, &sending->encoding, problem);
}

// Takes `sending`, also when it fails.
static Status send(Reply *reply, const char *content_type, Sending *sending, Problem *problem) {
    Status status;
    sending->source = (SweepSource){sending->show.rows, sweep_view_read, &sending->show};
    sending->text = (SweepText){.sweep = sending->show.sweep,
                                .source = &sending->source,
                                .result = sending->show.row.result};
    sending->archive = (SweepArchive){.sweep = sending->show.sweep, .source = &sending->source};
    status = sending->next != NULL ? begin_text(sending, problem) : begin_archive(sending, problem);
    if (status == STATUS_OK && sending->next != NULL && sending->is_last) {
        status = reply_bytes(reply, 200, content_type, &sending->made, problem);
        sending_free(sending);
        return status;
    }
    if (status != STATUS_OK) {
        sending_free(sending);
        return status;
    }
    reply_borrow(reply, 200, content_type, NULL, 0);
    // Of rows that still come there is no part that fits the next.
    reply->accepts_ranges = sending->encoding != NULL && sending->show.is_complete;
    reply->stream = sending->encoding != NULL ? (Stream){.next = archive_next,
                                                         .size = encoding_size(sending->encoding),
                                                         .cut = archive_cut}
                                              : (Stream){.next = text_next, .size = UINT64_MAX};
    reply->release = sending_free;
    reply->context = sending;
    return STATUS_OK;
}

static Status send_chart(App *app, Reply *reply, const char *content_type, Sending *sending,
                         Problem *problem) {
    const SweepSource source = {sending->show.rows, sweep_view_read, &sending->show};
    Bytes bytes = {.most = app->reply_most};
    Status status = charts_sweep(sending->show.sweep, &source, &bytes)
                        ? reply_bytes(reply, 200, content_type, &bytes, problem)
                        : refuse_changed(problem);
    bytes_clear(&bytes);
    sending_free(sending);
    return status;
}

Status sweeps_table(App *app, const Request *request, Reply *reply, Problem *problem) {
    const StudyFormat *format;
    TRY(study_format(request, study_formats(study_sweep.answer), reply, &format, problem));
    Sending *sending = calloc(1, sizeof *sending);
    if (sending == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    const Status status = sweep_view_load(app->db, request->parameters[0], is_of_job(request), true,
                                          &sending->show, problem);
    if (status != STATUS_OK || is_known(request, reply, &sending->show, format->extension)) {
        sending_free(sending);
        return status;
    }
    if (strcmp(format->extension, "svg") == 0)
        return send_chart(app, reply, format->content_type, sending, problem);
    sending->next = strcmp(format->extension, "json") == 0  ? sweep_json_next
                    : strcmp(format->extension, "csv") == 0 ? sweep_csv_next
                                                            : NULL;
    if (strcmp(format->extension, "npz") != 0)
        sending->encoder = format_find(format->extension);
    return send(reply, format->content_type, sending, problem);
}

static Status read_index(const Request *request, uint64_t *index, Problem *problem) {
    const char *text = request->parameters[1];
    const size_t length = strlen(text);
    if (length == 0 || length > 15 || strspn(text, "0123456789") != length)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "a point is a whole number from 0, \"%.40s\" is none", text);
    *index = strtoull(text, NULL, 10);
    return STATUS_OK;
}

static void put_point(Bytes *bytes, const SweepView *show, uint64_t index,
                      const SweepPoint *point) {
    const Sweep *sweep = show->sweep;
    bytes_format(bytes, "{\"index\": %llu, \"result\": \"%s\", \"status\": \"%s\", \"why\": ",
                 (unsigned long long)index, show->row.result, sweep_status_names[point->status]);
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
    const char *base = base_path(), *id = show->row.result;
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/points/%llu\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/%llu/scene\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"table\": \"%s/v1/results/%s/table.json\"}}\n", base, id);
}

static Status show_point(App *app, const Request *request, Reply *reply, bool is_scene,
                         Problem *problem) {
    uint64_t index = 0;
    SweepView show = {.sweep = NULL};
    SweepPoint point = {.status = SWEEP_PENDING};
    TRY(read_index(request, &index, problem));
    Status status = sweep_view_load(app->db, request->parameters[0], false, false, &show, problem);
    if (status == STATUS_OK)
        status = sweep_point_load(&show, index, &point, problem);
    if (status == STATUS_OK) {
        Bytes bytes = {.most = app->reply_most};
        if (is_scene) {
            document_scene(&bytes, &point.scene);
            bytes_text(&bytes, "\n");
        } else {
            put_point(&bytes, &show, index, &point);
        }
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    study_request_clear(&point.scene);
    sweep_view_clear(&show);
    return status;
}

Status sweeps_point(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show_point(app, request, reply, false, problem);
}

Status sweeps_scene(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show_point(app, request, reply, true, problem);
}
