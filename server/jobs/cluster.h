// Studies whose members a cluster makes. A thread of its own hands chunks to Slurm and takes the
// files that come back; it alone decides what is done, by the files, and what is worth waiting for,
// by Slurm.
#ifndef SERVER_JOBS_CLUSTER_H
#define SERVER_JOBS_CLUSTER_H

#include "server/jobs/jobs_private.h"

typedef struct Cluster Cluster;
struct ClusterStudy;

// Opens what the settings describe. Borrows them.
Status cluster_open(JobManager *manager, const ClusterSettings *settings, Cluster **cluster,
                    Problem *problem);
// Ends the thread; what runs on the cluster goes on, and is taken up after the next start.
void cluster_stop(Cluster *cluster); // NULL is fine, as for the next
void cluster_close(Cluster *cluster);

// Whether it makes the members of a study of this kind and predicted CPU time.
bool cluster_wants(const Cluster *cluster, const StudyKind *kind, double seconds);
// How many tasks run at once, at most, as Slurm says; a guess while it does not answer.
size_t cluster_slots(Cluster *cluster);

// Prepares a begun study, of a sweep with its chunks. STATUS_FULL, STATUS_IO: the folder cannot be
// written now.
Status cluster_prepare(Cluster *cluster, struct StudyRun *run, Problem *problem);
// With the manager's lock held: takes a prepared study, with a turn of it, to its end.
void cluster_take(struct StudyRun *run);
// With the manager's lock held.
void cluster_view(const struct ClusterStudy *study, ClusterView *view);
void cluster_study_free(struct ClusterStudy *study); // NULL is fine

#endif
