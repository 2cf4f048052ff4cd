// Studies: the answer as JSON, as a chart and what other formats it has. All are made of what was
// kept when the study was, so that they never change.
#include "server/api/studies.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/formats/study_formats.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/parse.h"

Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    *answer = (StudyAnswer){NULL};
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    const Status status =
        json_parse(row->study, strlen(row->study), study_answer_fields, answer, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "the stored study cannot be read: %s", fault->detail);
    free(fault);
    return status == STATUS_OK ? STATUS_OK : STATUS_INTERNAL;
}

static Status refuse_other(const StudyKind *kind, Problem *problem) {
    return problem_set(problem, STATUS_NOT_FOUND,
                       "the scene asked for no study \"%s\": submit it with a member study",
                       kind->kind.name);
}

static Status answer_read(const ResultRow *row, const StudyKind *kind, StudyAnswer *answer,
                          Problem *problem) {
    *answer = (StudyAnswer){NULL};
    if (row->study == NULL)
        return refuse_other(kind, problem);
    TRY(study_read(row, answer, problem));
    return answer->study->kind == kind->answer ? STATUS_OK : refuse_other(kind, problem);
}

static Status choose_format(const Request *request, const StudyFormat *formats, Reply *reply,
                            const StudyFormat **format, Problem *problem) {
    const char *extension = request->parameters[1], *types[STUDY_FORMATS_MAX] = {NULL};
    char names[64];
    study_formats_names(formats, "", names, sizeof names);
    reply->varies_by_accept = extension == NULL;
    if (extension != NULL) {
        *format = study_format_find(formats, extension);
        return *format != NULL
                   ? STATUS_OK
                   : problem_set(problem, STATUS_NOT_FOUND,
                                 "there is no format \"%.20s\"; there are %s", extension, names);
    }
    for (size_t i = 0; formats[i].extension != NULL; i++)
        types[i] = formats[i].content_type;
    const int choice = header_accept(request->accept, types);
    if (choice < 0)
        return problem_set(problem, STATUS_NOT_ACCEPTABLE,
                           "none of the formats fits Accept; there are %s, by extension too",
                           names);
    *format = &formats[choice];
    return STATUS_OK;
}

Status study_format(const Request *request, const StudyFormat *formats, Reply *reply,
                    const StudyFormat **format, Problem *problem) {
    TRY(choose_format(request, formats, reply, format, problem));
    if ((*format)->content_type == chart_type)
        reply->policy = reply_drawing_policy;
    return STATUS_OK;
}

static Status show(App *app, const Request *request, const StudyKind *kind, Reply *reply,
                   Problem *problem) {
    const StudyFormat *format;
    TRY(study_format(request, study_formats(kind->answer), reply, &format, problem));
    ResultRow row = {0};
    StudyAnswer answer = {NULL};
    Bytes bytes = {.most = app->reply_most};
    char tag[128];
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK)
        status = answer_read(&row, kind, &answer, problem);
    if (status == STATUS_OK) {
        snprintf(tag, sizeof tag, "%.72s-%s.%s", row.id, kind->kind.name, format->extension);
        if (!reply_immutable(reply, request, tag)) {
            study_format_write(format, answer.study, &bytes);
            status = reply_bytes(reply, 200, format->content_type, &bytes, problem);
        }
    }
    fields_clear(study_answer_fields, &answer);
    bytes_clear(&bytes);
    result_row_clear(&row);
    return status;
}

Status results_tradeoff(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, &study_tradeoff, reply, problem);
}

Status results_ensemble(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, &study_ensemble, reply, problem);
}

Status results_compare(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, &study_compare, reply, problem);
}

Status results_sensitivity(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, &study_sensitivity, reply, problem);
}
