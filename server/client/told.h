// What a daemon tells of jobs and problems, as plain structs. What is not known is skipped, and
// what is missing is empty: the other end may be newer, older or no impactd at all. Used by
// command/.
#ifndef SERVER_CLIENT_TOLD_H
#define SERVER_CLIENT_TOLD_H

#include "core/base/field.h"
#include "server/client/http.h"

typedef struct ProblemTold {
    char *type, *title, *detail;
    List errors; // told.c's own
    uint64_t more;
} ProblemTold;

typedef struct JobTold {
    char *id, *status, *result;
    double progress; // [%], NAN: not told
    bool cached;
    ProblemTold problem; // of a failed job
} JobTold;

// STATUS_UNREACHABLE if the answer is no job. Cleared by job_told_clear in any case.
Status job_told_read(const HttpAnswer *answer, JobTold *job, Problem *problem);
// The same of the data of an event of progress, which names no job: it is `id`. False if it is
// none.
bool job_told_event(const char *text, size_t size, const char *id, JobTold *job);
void job_told_clear(JobTold *job);
bool job_told_is_final(const JobTold *job);

// The problem document of an answer that is none of 200 to 202 and 206, as if it had been found
// here: "pointer: detail (did you mean)". Always returns a status that is not OK.
Status problem_told_read(const HttpAnswer *answer, Problem *problem);
// The same for the cause of a failed job.
void problem_told_put(const ProblemTold *told, Status status, Problem *problem);

#endif
