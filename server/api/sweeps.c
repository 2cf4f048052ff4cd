// Sweeps: the table of rows, also while they come, one point of it, and failed points once more.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/job_document.h"
#include "server/api/studies.h"
#include "server/base/link.h"
#include "server/codec/write.h"
#include "server/encode/answer.h"
#include "server/encode/sweep_table.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/jobs/sweep_rows.h"

// A path begins with a result, or with the job that makes it.
static bool is_of_job(const Request *request) {
    static const char jobs[] = "/v1/jobs/";
    return strncmp(link_inside(request->path), jobs, sizeof jobs - 1) == 0;
}

// Rows come, and failed ones may be made again: only a table without either never changes.
static bool is_known(const Request *request, Reply *reply, const SweepShow *show,
                     const char *extension) {
    char tag[112];
    snprintf(tag, sizeof tag, "%.72s-t%llu-%llu.%.5s", show->row.result,
             (unsigned long long)show->chunks_done, (unsigned long long)show->row.retries,
             extension);
    if (show->is_complete && show->sweep->table.failed == 0)
        return reply_immutable(reply, request, tag);
    if (show->is_complete)
        return reply_tagged(reply, request, tag);
    snprintf(reply->cache_control, sizeof reply->cache_control, "no-store");
    return false;
}

Status sweeps_table(App *app, const Request *request, Reply *reply, Problem *problem) {
    const AnswerFormat *format;
    SweepShow show = {.sweep = NULL};
    TRY(study_format(request, answer_formats(study_sweep.answer), reply, &format, problem));
    Status status = sweep_show_load(app->store, request->parameters[0], is_of_job(request), true,
                                    &show, problem);
    if (status == STATUS_OK && !is_known(request, reply, &show, format->extension)) {
        Bytes bytes = {.most = app->reply_most};
        if (format == answer_formats(study_sweep.answer))
            sweep_json(show.sweep, show.row.result, &bytes);
        else
            format->write((const Variant *)(const void *)show.sweep, &bytes);
        status = reply_bytes(reply, 200, format->content_type, &bytes, problem);
        // Of rows that still come there is no part that fits the next.
        reply->accepts_ranges = format->is_binary && show.is_complete;
    }
    sweep_show_clear(&show);
    return status;
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

static void put_point(Bytes *bytes, const SweepShow *show, uint64_t index,
                      const SweepPointShow *point) {
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
    const char *base = link_base(), *id = show->row.result;
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/points/%llu\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/%llu/scene\"", base, id,
                 (unsigned long long)index);
    bytes_format(bytes, ", \"table\": \"%s/v1/results/%s/table.json\"}}\n", base, id);
}

static Status show_point(App *app, const Request *request, Reply *reply, bool is_scene,
                         Problem *problem) {
    uint64_t index = 0;
    SweepShow show = {.sweep = NULL};
    SweepPointShow point = {.values = NULL};
    TRY(read_index(request, &index, problem));
    Status status =
        sweep_show_load(app->store, request->parameters[0], false, false, &show, problem);
    if (status == STATUS_OK)
        status = sweep_point_load(app->store, &show, index, &point, problem);
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
    free(point.values);
    inquiry_clear(&point.scene);
    sweep_show_clear(&show);
    return status;
}

Status sweeps_point(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show_point(app, request, reply, false, problem);
}

Status sweeps_scene(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show_point(app, request, reply, true, problem);
}
