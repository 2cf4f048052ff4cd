// A request sent twice under one Idempotency-Key is done once.
#ifndef SERVER_JOBS_IDEMPOTENCY_H
#define SERVER_JOBS_IDEMPOTENCY_H

#include "server/jobs/jobs.h"

enum { KEY_MAX = 255 };

typedef struct IdempotencyKey {
    const char *client;    // NULL: a client without a token
    char key[KEY_MAX + 1]; // "": none
    char request[65];      // SHA-256 of the body
} IdempotencyKey;

// That of the submission. STATUS_USAGE for a malformed one.
Status idempotency_read(const Submission *submission, IdempotencyKey *key, Problem *problem);
// *job is a reference to the job of an earlier request, or NULL. STATUS_REUSED for another body.
Status idempotency_find(JobManager *manager, const IdempotencyKey *key, Job **job,
                        Problem *problem);

#endif
