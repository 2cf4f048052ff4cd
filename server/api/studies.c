// Studies of a result: the answer as JSON, as a chart and in other formats, made of what was
// stored, so that they never change; of sweeps the table of rows, also while they are made, and one
// point.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/axis.h"
#include "server/api/app.h"
#include "server/jobs/documents.h"
#include "server/jobs/sweep.h"
#include "server/util/base_path.h"

Status study_load(App *app, const Request *request, const StudyKind *kind, ResultRow *row,
                  StudyAnswer *answer, Problem *problem) {
    *answer = (StudyAnswer){NULL};
    TRY(db_result_load(app->db, request->parameters[0], row, problem));
    if (row->study != NULL)
        TRY(study_read(row, answer, problem));
    if (answer->study != NULL && answer->study->kind == kind->answer)
        return STATUS_OK;
    const StudyKind *own = answer->study != NULL ? study_of_answer(answer->study->kind) : NULL;
    return own == NULL
               ? problem_set(problem, STATUS_NOT_FOUND,
                             "the scene asked for no study \"%s\": submit it with a member study",
                             kind->kind.name)
               : problem_set(problem, STATUS_NOT_FOUND,
                             "the scene asked for the study \"%s\", not for \"%s\": its answer is "
                             "%s.json",
                             own->kind.name, kind->kind.name, study_document_name(own));
}

// The name of the kind's document follows the result in the path.
static const StudyKind *study_of_route(const Request *request) {
    const char *name = strstr(request->route->pattern, "{id}/") + 5;
    const size_t length = strcspn(name, "./");
    size_t i = 0;
    while (strncmp(study_document_name(studies[i]), name, length) != 0 ||
           study_document_name(studies[i])[length] != '\0')
        i++;
    return studies[i];
}

Status results_study(App *app, const Request *request, Reply *reply, Problem *problem) {
    const StudyKind *kind = study_of_route(request);
    const TableFormat *format;
    TRY(columns_format(request, 1, study_formats(kind->answer), reply, &format, problem));
    ResultRow row = {0};
    StudyAnswer answer = {NULL};
    Bytes bytes = {.most = app->reply_most};
    char tag[128];
    Status status = study_load(app, request, kind, &row, &answer, problem);
    if (status == STATUS_OK) {
        snprintf(tag, sizeof tag, "%.72s-%s.%s", row.id, kind->kind.name, format->extension);
        if (!reply_immutable(reply, request, tag)) {
            study_format_write(format, &(StudyDocument){answer.study, row.id, row.scene}, &bytes);
            status = reply_bytes(reply, 200, format->content_type, &bytes, problem);
        }
    }
    fields_clear(study_answer_fields, &answer);
    bytes_clear(&bytes);
    result_row_clear(&row);
    return status;
}

// The scene of the request with the values that its study found.
static Status study_make_solution(const StudyRequest *request, const Variant *answer,
                                  Simulation *scene, Problem *problem) {
    const StudyKind *kind = study_kind(request->study);
    StudyReferences references = {.axes = NULL};
    StudyValue values[STUDY_AXES];
    kind->references(request->study, &references);
    TRY(kind->solution(request->study, answer, values, problem));
    TRY(study_scene_make(&request->simulation, references.axes, values, references.names, false,
                         NULL, scene, problem));
    scene->output.reduction = request->simulation.output.reduction;
    return STATUS_OK;
}

Status results_solution(App *app, const Request *request, Reply *reply, Problem *problem) {
    ResultRow row = {0};
    StudyAnswer answer = {NULL};
    StudyRequest given = {.study = NULL}, found = {.study = NULL};
    Warnings warnings = {NULL, 0};
    Bytes bytes = {.most = app->reply_most};
    Status status = study_load(app, request, study_of_route(request), &row, &answer, problem);
    if (status == STATUS_OK)
        status =
            jobs_prepare(app->db, row.scene, strlen(row.scene), NULL, &given, &warnings, problem);
    if (status == STATUS_OK &&
        (given.study == NULL || study_kind(given.study) != study_of_route(request)))
        status = problem_set(problem, STATUS_INTERNAL,
                             "the result %.20s is damaged: its scene has not the study that it "
                             "answers",
                             row.id);
    if (status == STATUS_OK)
        status = study_make_solution(&given, answer.study, &found.simulation, problem);
    if (status == STATUS_OK) {
        document_scene(&bytes, &found);
        bytes_text(&bytes, "\n");
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    }
    bytes_clear(&bytes);
    warnings_clear(&warnings);
    study_request_clear(&given);
    study_request_clear(&found);
    fields_clear(study_answer_fields, &answer);
    result_row_clear(&row);
    return status;
}

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

// What a table is read from as long as it is sent.
typedef struct SweepReply {
    SweepView view;
    SweepDocument document;
} SweepReply;

static void sweep_reply_free(void *context) {
    SweepReply *sent = context;
    sweep_view_clear(&sent->view);
    free(sent);
}

// Takes `sent`, also when it fails.
static Status sweep_reply_table(App *app, Reply *reply, const TableFormat *format, SweepReply *sent,
                                Problem *problem) {
    const bool is_complete = sent->view.is_complete;
    TableStream *stream = table_stream_new(NULL);
    if (stream == NULL) {
        sweep_reply_free(sent);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    }
    stream->table = sweep_document_table(&sent->document);
    stream->is_broken = &sent->document.is_broken;
    stream->release = sweep_reply_free;
    stream->source = sent;
    TRY(columns_reply(app, reply, format, stream, problem));
    // As long as rows come, no part of one document fits the next.
    reply->accepts_ranges = format->is_binary && is_complete;
    return STATUS_OK;
}

static Status sweep_reply_chart(App *app, Reply *reply, const TableFormat *format, SweepReply *sent,
                                Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    Chart chart;
    const bool is_whole = chart_sweep(&sent->document, &chart);
    chart_write(&chart, &bytes);
    sweep_reply_free(sent);
    if (is_whole)
        return reply_bytes(reply, 200, format->content_type, &bytes, problem);
    bytes_clear(&bytes);
    return problem_set(problem, STATUS_BUSY, "%s", sweep_rows_changed);
}

Status sweeps_table(App *app, const Request *request, Reply *reply, Problem *problem) {
    const TableFormat *format;
    TRY(columns_format(request, 1, study_formats(study_sweep.answer), reply, &format, problem));
    SweepReply *sent = calloc(1, sizeof *sent);
    if (sent == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    SweepView *view = &sent->view;
    const Status status = sweep_view_load(app->db, request->parameters[0], sweep_is_of_job(request),
                                          true, view, problem);
    if (status != STATUS_OK || sweep_is_unchanged(request, reply, view, format->extension)) {
        sweep_reply_free(sent);
        return status;
    }
    sent->document = (SweepDocument){.sweep = view->sweep,
                                     .result = view->row.result,
                                     .rows = view->rows,
                                     .read = sweep_view_read,
                                     .context = view};
    return format == &format_svg ? sweep_reply_chart(app, reply, format, sent, problem)
                                 : sweep_reply_table(app, reply, format, sent, problem);
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
    const char *base = base_path(), *id = view->row.result;
    const unsigned long long number = index;
    bytes_json(
        bytes, "{\"index\": %llu, \"result\": %s, \"status\": %s, \"why\": %s, \"values\": {",
        number, id, sweep_status_names[point->status], point->why[0] != '\0' ? point->why : NULL);
    for (size_t i = 0; i < sweep->axes.count; i++)
        bytes_json(bytes, "%p%s: %p", i > 0 ? ", " : "", sweep->axes.at[i].pointer,
                   sweep->axes.at[i].values.at[sweep_value_index(sweep, i, (size_t)index)]);
    bytes_text(bytes, "}, \"metrics\": {");
    for (size_t i = 0; i < sweep->metrics.count; i++)
        bytes_json(bytes, "%p%s: %g", i > 0 ? ", " : "", sweep->metrics.at[i], point->values[i]);
    bytes_text(bytes, "}, \"scene\": ");
    document_scene(bytes, &point->scene);
    bytes_json(bytes,
               ", \"links\": {\"self\": \"%s/v1/results/%s/points/%llu\", \"scene\": "
               "\"%s/v1/results/%s/points/%llu/scene\", \"table\": "
               "\"%s/v1/results/%s/table.json\"}}\n",
               base, id, number, base, id, number, base, id);
}

// Also its scene alone, where the path ends so.
Status sweeps_point(App *app, const Request *request, Reply *reply, Problem *problem) {
    const bool is_scene = strcmp(strrchr(request->route->pattern, '/'), "/scene") == 0;
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
