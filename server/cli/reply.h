// Jobs and problems in the answers of a daemon, as plain structs. Unknown members are skipped, and
// missing ones are empty: the other end may be newer, older or no impactd at all.
#ifndef SERVER_CLI_REPLY_H
#define SERVER_CLI_REPLY_H

#include "core/base/field.h"
#include "server/cli/http.h"

typedef struct ProblemReply {
    char *type, *title, *detail;
    List errors; // reply.c's own
    uint64_t more;
} ProblemReply;

typedef struct JobReply {
    char *id, *status, *result;
    double progress; // [%]; NAN: unknown
    bool cached;
    ProblemReply problem; // of a failed job
} JobReply;

// STATUS_UNREACHABLE if the answer is no job. Cleared by job_reply_clear in any case.
Status job_reply_read(const HttpAnswer *answer, JobReply *job, Problem *problem);
// The same of the data of an event of progress, which names no job: it is `id`. False if it is
// none.
bool job_reply_event(const char *text, size_t size, const char *id, JobReply *job);
void job_reply_clear(JobReply *job);
bool job_reply_is_final(const JobReply *job);

// The problem document of an answer that is none of 200 to 202 and 206, as if it had been found
// here: "pointer: detail (did you mean)". Always returns a status that is not OK.
Status problem_reply_read(const HttpAnswer *answer, Problem *problem);
// The same for the cause of a failed job.
void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem);

#endif
