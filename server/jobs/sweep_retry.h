// Failed points of a sweep once more: their chunks are opened in the store, and the same scene is
// submitted again, which finds them so. Not their computing (sweep.h). Used by submit.c.
#ifndef SERVER_JOBS_SWEEP_RETRY_H
#define SERVER_JOBS_SWEEP_RETRY_H

#include "server/jobs/jobs_private.h"

// Without the intake's lock, with that of its retries, until the scene was submitted. The sweep of
// the job `id`, judged and opened; to be cleared in any case.
Status sweep_retry_open(JobManager *manager, const char *id, SweepRow *row, Problem *problem);

#endif
