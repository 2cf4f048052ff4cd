// impactd check --executor slurm: whether a cluster can make studies, step by step.
#ifndef SERVER_CLI_CLUSTER_CHECK_H
#define SERVER_CLI_CLUSTER_CHECK_H

#include "core/base/field.h"
#include "server/jobs/jobs.h"

enum { EXECUTOR_THREADS, EXECUTOR_SLURM };
extern const char *const executor_names[];

// The rows of settings with these members, of the commands serve and check.
// clang-format off
#define CLUSTER_ROWS(Type, what_) \
    FIELD_CHOICE(Type, executor, executor_names, EXECUTOR_THREADS, what_), \
    FIELD_TEXT(Type, shared, 2000, PRESENCE_OPTIONAL, 0, "folder that this machine and all nodes see under the same path, for the chunks of studies"), \
    FIELD_TEXT(Type, partition, 100, PRESENCE_OPTIONAL, 0, "Slurm's partition (its default)"), \
    FIELD_TEXTS(Type, sbatch_option, NULL, NULL, 32, PRESENCE_OPTIONAL, 0, "further option for sbatch, as --sbatch-option=--account=lab; repeatable")
// clang-format on

// STATUS_USAGE unless the folder is there and only this user may write to it.
Status cluster_check_folder(const char *shared, Problem *problem);

// Prints each step and what it found; the last one makes a chunk on a node. The problem says what
// is to be done.
Status cluster_check(const ClusterSettings *cluster, Problem *problem);

#endif
