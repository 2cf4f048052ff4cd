// A request sent twice under one Idempotency-Key is done once. Not the key's place in the database.
// Used by submit.c.
#ifndef SERVER_JOBS_IDEMPOTENCY_H
#define SERVER_JOBS_IDEMPOTENCY_H

#include "server/jobs/jobs_private.h"

enum { KEY_MAX = 255 };

// Lies on the stack of whoever submits, between idempotency_begin and idempotency_end.
typedef struct IdempotencyHold {
    struct IdempotencyHold *next;
    const char *client; // "" for nobody in particular
    char key[KEY_MAX + 1];
    char request[65]; // SHA-256 of the body
    bool is_held;
} IdempotencyHold;

// Waits for others who submit under the same key. Then *job is the job of an earlier request, or
// NULL and the key is this submission's until idempotency_end, which must follow in any case.
// STATUS_USAGE for a key that is none, STATUS_REUSED.
Status idempotency_begin(JobManager *manager, const Submission *submission, IdempotencyHold *hold,
                         Job **job, Problem *problem);
// The job of a new submission: found from now on, also before the store has it.
void idempotency_remember(JobManager *manager, const IdempotencyHold *hold, Job *job);
void idempotency_end(JobManager *manager, IdempotencyHold *hold);

#endif
