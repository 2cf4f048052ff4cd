// Studies whose members a cluster makes. A thread of its own hands chunks to Slurm and takes the
// files that come back. The files alone decide what is done; Slurm says what is worth waiting for.
#ifndef SERVER_JOBS_CLUSTER_H
#define SERVER_JOBS_CLUSTER_H

#include "server/jobs/jobs_private.h"

// Makes Slurm the executor of long studies, as the manager's settings say. What runs on the cluster
// when the manager is closed continues, and is taken up after the next start.
Status cluster_open(JobManager *manager, Problem *problem);

#endif
