// What one client may have and when a place will be free. Not the queue's order. Used by submit.c
// and intake.c.
#ifndef SERVER_JOBS_LIMITS_H
#define SERVER_JOBS_LIMITS_H

#include "server/jobs/jobs_private.h"

// With the lock held. Counts one more submission of `client` against the jobs a minute, or
// STATUS_QUOTA.
Status limits_add(JobManager *manager, QueueClient *client, Problem *problem);
// With the lock held. Whether it may have one more unfinished job.
Status limits_check(const JobManager *manager, const QueueClient *client, Problem *problem);

#endif
