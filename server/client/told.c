#include "server/client/told.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/codec/listing.h"
#include "server/codec/read.h"

typedef struct FaultTold {
    char *pointer, *detail, *unit, *did_you_mean;
    uint64_t row;
    char *column;
} FaultTold;

// clang-format off
static const Field fault_fields[] = {
    FIELD_TEXT(FaultTold, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(FaultTold, detail, 0, PRESENCE_OPTIONAL, 0, "what is wrong"),
    FIELD_TEXT(FaultTold, unit, 0, PRESENCE_OPTIONAL, 0, "unit"),
    FIELD_TEXT(FaultTold, did_you_mean, 0, PRESENCE_OPTIONAL, 0, "suggestion"),
    FIELD_COUNT(FaultTold, row, NULL, ANY, OPTIONAL, "of a table"),
    FIELD_TEXT(FaultTold, column, 0, PRESENCE_OPTIONAL, 0, "of that row"),
    FIELD_END,
};
static const Field problem_fields[] = {
    FIELD_TEXT(ProblemTold, type, 0, PRESENCE_OPTIONAL, 0, "kind"),
    FIELD_TEXT(ProblemTold, title, 0, PRESENCE_OPTIONAL, 0, "in short"),
    FIELD_TEXT(ProblemTold, detail, 0, PRESENCE_OPTIONAL, 0, "sentence"),
    {.name = "errors", .kind = FIELD_KIND_LIST, .offset = offsetof(ProblemTold, errors),
     .fields = fault_fields, .size = sizeof(FaultTold), .presence = PRESENCE_OPTIONAL, .doc = "faults"},
    FIELD_COUNT(ProblemTold, more, NULL, ANY, 0, "faults beyond those"),
    FIELD_END,
};
static const Field job_fields[] = {
    FIELD_TEXT(JobTold, id, 0, PRESENCE_OPTIONAL, 0, "id"),
    FIELD_TEXT(JobTold, status, 0, PRESENCE_OPTIONAL, 0, "state"),
    FIELD_TEXT(JobTold, result, 0, PRESENCE_OPTIONAL, 0, "result"),
    FIELD_REAL(JobTold, progress, "%", ANY, OPTIONAL, "progress"),
    FIELD_FLAG(JobTold, cached, false, "nothing was computed"),
    FIELD_ITEM_OR_NULL(JobTold, problem, problem_fields, PRESENCE_OPTIONAL, "cause"),
    FIELD_END,
};
// clang-format on

Status job_told_read(const HttpAnswer *answer, JobTold *job, Problem *problem) {
    // Members that are not known here are no faults, so nobody listens to the reader.
    (void)read_json(answer->body.at, answer->body.count, job_fields, job, NULL);
    if (job->id == NULL || job->status == NULL || strlen(job->id) > 80 || strlen(job->status) > 40)
        return problem_set(problem, STATUS_UNREACHABLE,
                           "the answer is no job: what answers there is no impactd");
    text_make_printable(job->id);
    text_make_printable(job->status);
    text_make_printable(job->result);
    return STATUS_OK;
}

bool job_told_event(const char *text, size_t size, const char *id, JobTold *job) {
    (void)read_json(text, size, job_fields, job, NULL);
    free(job->id);
    job->id = strdup(id);
    if (job->id == NULL || job->status == NULL || strlen(job->status) > 40)
        return false;
    text_make_printable(job->status);
    return true;
}

void job_told_clear(JobTold *job) {
    fields_clear(job_fields, job);
}

bool job_told_is_final(const JobTold *job) {
    return strcmp(job->status, "accepted") != 0 && strcmp(job->status, "running") != 0;
}

static void text_put(char *target, size_t size, const char *text) {
    text_fit(target, size, text != NULL ? text : "");
    text_make_printable(target);
}

// A cell of a table is what people look for, not its place in a document.
static void place_put(Fault *fault, const FaultTold *told) {
    const bool has_column = told->column != NULL && told->column[0] != '\0';
    char place[sizeof fault->pointer];
    if (told->row == COUNT_ABSENT) {
        text_put(fault->pointer, sizeof fault->pointer, told->pointer);
        return;
    }
    snprintf(place, sizeof place, "row %llu%s%.100s", (unsigned long long)told->row,
             has_column ? ", column " : "", has_column ? told->column : "");
    text_put(fault->pointer, sizeof fault->pointer, place);
}

void problem_told_put(const ProblemTold *told, Status status, Problem *problem) {
    const FaultTold *faults = told->errors.at;
    for (size_t i = 0; i < told->errors.count && problem != NULL; i++) {
        Fault fault = {0};
        place_put(&fault, &faults[i]);
        text_put(fault.detail, sizeof fault.detail, faults[i].detail);
        text_put(fault.unit, sizeof fault.unit, faults[i].unit);
        text_put(fault.did_you_mean, sizeof fault.did_you_mean, faults[i].did_you_mean);
        (void)problem_add_fault(problem, status, &fault);
    }
    if (problem != NULL && told->more < 1000000000)
        problem->count += problem->count > 0 ? told->more : 0;
    char detail[400];
    text_put(detail, sizeof detail, told->detail != NULL ? told->detail : told->title);
    (void)problem_set(problem, status, "%s", detail[0] != '\0' ? detail : "no reason is told");
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

Status problem_told_read(const HttpAnswer *answer, Problem *problem) {
    ProblemTold told = {0};
    (void)read_json(answer->body.at, answer->body.count, problem_fields, &told, NULL);
    const Status status = status_of(answer->code, told.type);
    if (told.detail != NULL || told.title != NULL || told.errors.count > 0)
        problem_told_put(&told, status, problem);
    else
        (void)problem_set(problem, status, "the server answers %d and does not say why",
                          answer->code);
    fields_clear(problem_fields, &told);
    return status;
}
