// Studies: the answer as JSON and as a chart. Both are drawn of what was kept when it was measured,
// so that they never change.
#include "server/api/studies.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/tradeoff.h"
#include "server/api/app.h"
#include "server/codec/read.h"
#include "server/encode/chart.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"

Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    *answer = (StudyAnswer){NULL};
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    const Status status =
        read_json(row->study, strlen(row->study), study_answer_fields, answer, fault);
    // A fault here is ours, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "the stored study cannot be read: %s", fault->detail);
    free(fault);
    return status == STATUS_OK ? STATUS_OK : STATUS_INTERNAL;
}

static Status write_tradeoff(const ResultRow *row, bool is_chart, Bytes *bytes, Problem *problem) {
    StudyAnswer answer;
    if (row->study == NULL)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the scene asked for no study \"tradeoff\": submit it with a member "
                           "study");
    const Status status = study_read(row, &answer, problem);
    if (status == STATUS_OK && is_chart)
        chart_tradeoff((const Tradeoff *)(const void *)answer.study, bytes);
    else if (status == STATUS_OK) {
        document_answer(bytes, answer.study);
        bytes_text(bytes, "\n");
    }
    fields_clear(study_answer_fields, &answer);
    return status;
}

Status results_tradeoff(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char *const types[] = {"application/json", chart_type, NULL};
    const char *extension = request->parameters[1];
    const int choice = extension == NULL                ? header_accept(request->accept, types)
                       : strcmp(extension, "json") == 0 ? 0
                       : strcmp(extension, "svg") == 0  ? 1
                                                        : -2;
    reply->varies_by_accept = extension == NULL;
    if (choice == -2)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no format \"%.20s\"; there are json, svg", extension);
    if (choice == -1)
        return problem_set(
            problem, STATUS_NOT_ACCEPTABLE,
            "none of the formats fits Accept; there are json, svg, by extension too");
    ResultRow row = {0};
    Bytes bytes = {.most = app->reply_most};
    char tag[104];
    Status status = store_result_load(app->store, request->parameters[0], &row, problem);
    if (status == STATUS_OK) {
        snprintf(tag, sizeof tag, "%.72s-tradeoff.%s", row.id, choice == 0 ? "json" : "svg");
        if (row.study == NULL || !reply_immutable(reply, request, tag)) {
            status = write_tradeoff(&row, choice == 1, &bytes, problem);
            if (status == STATUS_OK)
                status = reply_bytes(reply, 200, types[choice], &bytes, problem);
        }
    }
    bytes_clear(&bytes);
    result_row_clear(&row);
    return status;
}
