#include "server/cli/reply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/json/parse.h"
#include "server/json/table.h"

typedef struct FaultReply {
    char *pointer, *detail, *unit, *did_you_mean;
    uint64_t row;
    char *column;
} FaultReply;

// clang-format off
static const Field fault_fields[] = {
    FIELD_TEXT(FaultReply, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(FaultReply, detail, 0, PRESENCE_OPTIONAL, 0, "what is wrong"),
    FIELD_TEXT(FaultReply, unit, 0, PRESENCE_OPTIONAL, 0, "unit"),
    FIELD_TEXT(FaultReply, did_you_mean, 0, PRESENCE_OPTIONAL, 0, "suggestion"),
    FIELD_COUNT(FaultReply, row, NULL, ANY, OPTIONAL, "of a table"),
    FIELD_TEXT(FaultReply, column, 0, PRESENCE_OPTIONAL, 0, "of that row"),
    FIELD_END,
};
static const Field problem_fields[] = {
    FIELD_TEXT(ProblemReply, type, 0, PRESENCE_OPTIONAL, 0, "kind"),
    FIELD_TEXT(ProblemReply, title, 0, PRESENCE_OPTIONAL, 0, "in short"),
    FIELD_TEXT(ProblemReply, detail, 0, PRESENCE_OPTIONAL, 0, "sentence"),
    {.name = "errors", .kind = FIELD_KIND_LIST, .offset = offsetof(ProblemReply, errors),
     .fields = fault_fields, .size = sizeof(FaultReply), .presence = PRESENCE_OPTIONAL, .doc = "faults"},
    FIELD_COUNT(ProblemReply, more, NULL, ANY, 0, "faults beyond those"),
    FIELD_END,
};
static const Field job_fields[] = {
    FIELD_TEXT(JobReply, id, 0, PRESENCE_OPTIONAL, 0, "id"),
    FIELD_TEXT(JobReply, status, 0, PRESENCE_OPTIONAL, 0, "state"),
    FIELD_TEXT(JobReply, result, 0, PRESENCE_OPTIONAL, 0, "result"),
    FIELD_REAL(JobReply, progress, "%", ANY, OPTIONAL, "progress"),
    FIELD_FLAG(JobReply, cached, false, "nothing was computed"),
    FIELD_ITEM_OR_NULL(JobReply, problem, problem_fields, PRESENCE_OPTIONAL, "cause"),
    FIELD_END,
};
// clang-format on

Status job_reply_read(const HttpAnswer *answer, JobReply *job, Problem *problem) {
    // Unknown members are no faults: the reader's problem is not used.
    (void)json_parse(answer->body.at, answer->body.count, job_fields, job, NULL);
    if (job->id == NULL || job->status == NULL || strlen(job->id) > 80 || strlen(job->status) > 40)
        return problem_set(problem, STATUS_UNREACHABLE,
                           "the answer is no job: what answers there is no impactd");
    text_make_printable(job->id);
    text_make_printable(job->status);
    text_make_printable(job->result);
    return STATUS_OK;
}

bool job_reply_event(const char *text, size_t size, const char *id, JobReply *job) {
    (void)json_parse(text, size, job_fields, job, NULL);
    free(job->id);
    job->id = strdup(id);
    if (job->id == NULL || job->status == NULL || strlen(job->status) > 40)
        return false;
    text_make_printable(job->status);
    return true;
}

void job_reply_clear(JobReply *job) {
    fields_clear(job_fields, job);
}

bool job_reply_is_final(const JobReply *job) {
    return strcmp(job->status, "accepted") != 0 && strcmp(job->status, "running") != 0;
}

static void text_put(char *target, size_t size, const char *text) {
    text_fit(target, size, text != NULL ? text : "");
    text_make_printable(target);
}

// A cell of a table is what people look for, not its place in a document.
static void place_put(Fault *fault, const FaultReply *reply) {
    const bool has_column = reply->column != NULL && reply->column[0] != '\0';
    char place[sizeof fault->pointer];
    if (reply->row == COUNT_ABSENT) {
        text_put(fault->pointer, sizeof fault->pointer, reply->pointer);
        return;
    }
    snprintf(place, sizeof place, "row %llu%s%.100s", (unsigned long long)reply->row,
             has_column ? ", column " : "", has_column ? reply->column : "");
    text_put(fault->pointer, sizeof fault->pointer, place);
}

void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem) {
    const FaultReply *faults = reply->errors.at;
    for (size_t i = 0; i < reply->errors.count && problem != NULL; i++) {
        Fault fault = {0};
        place_put(&fault, &faults[i]);
        text_put(fault.detail, sizeof fault.detail, faults[i].detail);
        text_put(fault.unit, sizeof fault.unit, faults[i].unit);
        text_put(fault.did_you_mean, sizeof fault.did_you_mean, faults[i].did_you_mean);
        (void)problem_add_fault(problem, status, &fault);
    }
    if (problem != NULL && reply->more < 1000000000)
        problem->count += problem->count > 0 ? reply->more : 0;
    char detail[400];
    text_put(detail, sizeof detail, reply->detail != NULL ? reply->detail : reply->title);
    (void)problem_set(problem, status, "%s", detail[0] != '\0' ? detail : "no reason is given");
}

// What an HTTP status means to a shell.
static Status status_of(int code, const char *type) {
    switch (code) {
    case 400:
        return type != NULL && strstr(type, "unreadable") != NULL ? STATUS_UNREADABLE
                                                                  : STATUS_USAGE;
    case 401:
    case 403:
        return STATUS_FORBIDDEN;
    case 404:
    case 410:
        return STATUS_NOT_FOUND;
    case 413:
    case 415:
    case 422:
        return STATUS_INVALID;
    case 429:
    case 502:
    case 503:
    case 504:
        return STATUS_UNREACHABLE;
    case 409:
        return STATUS_CONFLICT;
    case 412:
        return STATUS_STALE;
    default:
        return STATUS_INTERNAL;
    }
}

Status problem_reply_read(const HttpAnswer *answer, Problem *problem) {
    ProblemReply reply = {0};
    (void)json_parse(answer->body.at, answer->body.count, problem_fields, &reply, NULL);
    const Status status = status_of(answer->code, reply.type);
    if (reply.detail != NULL || reply.title != NULL || reply.errors.count > 0)
        problem_reply_put(&reply, status, problem);
    else
        (void)problem_set(problem, status, "the server answers %d and does not say why",
                          answer->code);
    fields_clear(problem_fields, &reply);
    return status;
}
