// impactd check --executor slurm: whether a cluster can make studies, step by step. The last one is
// a small study, made as the server's are.
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/jobs/jobs.h"
#include "server/jobs/sweep.h"

enum { WAIT_S = 120, END_S = 10, PER_S = 20 };
static const struct timespec trial_pause = {0, 1000000000 / PER_S};

const char *const executor_names[] = {"threads", "slurm", NULL};

static const char trial[] =
    "{\"structure\": {\"mass\": 1, \"stiffness\": 900}, \"excitation\": {\"kind\": \"free\", "
    "\"displacement\": 0.01}, \"duration\": 1, \"sample_rate\": 100, \"study\": {\"kind\": "
    "\"sweep\", \"axes\": [{\"pointer\": \"/structure/mass\", \"values\": [1]}]}}";

Status cluster_check_folder(const char *shared, Problem *problem) {
    struct stat facts;
    if (shared == NULL || shared[0] != '/' || strpbrk(shared, "%\\\n") != NULL)
        return problem_add(problem, STATUS_USAGE, "--shared",
                           "must be the absolute path, without %% and \\, of a folder that this "
                           "machine and all nodes see, for --executor slurm");
    if (stat(shared, &facts) != 0)
        return problem_add(problem, STATUS_USAGE, "--shared", "%.300s: %s", shared,
                           strerror(errno));
    if (!S_ISDIR(facts.st_mode) || access(shared, W_OK) != 0 || facts.st_uid != geteuid() ||
        (facts.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return problem_add(problem, STATUS_USAGE, "--shared",
                           "%.300s must be a folder of this user, to which no other may write and "
                           "thus change results: chown it, chmod 700 it",
                           shared);
    return STATUS_OK;
}

// Whether the row is there, or else why not.
static Status trial_result(Db *db, const char *result, Problem *problem) {
    SweepView view;
    Status status = sweep_view_load(db, result, false, true, &view, problem);
    if (status == STATUS_OK && view.sweep->table.failures.count > 0)
        status = problem_set(problem, STATUS_IO, "a node did not make a study: %s",
                             view.sweep->table.failures.at[0].detail);
    sweep_view_clear(&view);
    return status;
}

// The job to its end, or cancelled.
static Status trial_wait(JobManager *manager, Db *db, Job *job, Problem *problem) {
    char shown[240] = "it has not begun";
    JobView view;
    for (int i = 0; i < WAIT_S * PER_S; i++, nanosleep(&trial_pause, NULL)) {
        Status status = job_view(job, &view);
        const bool is_final = job_state_is_final(view.row.state);
        if (view.cluster.reason[0] != '\0')
            text_fit(shown, sizeof shown, view.cluster.reason);
        if (status == STATUS_OK && view.row.state == JOB_FAILED)
            status = problem_set(problem, STATUS_IO, "%s", shown);
        else if (status == STATUS_OK && is_final)
            status = trial_result(db, view.row.result, problem);
        else if (i + 1 == WAIT_S * PER_S &&
                 jobs_cancel(manager, view.row.id, &job, NULL) == STATUS_OK)
            job_unref(job);
        job_view_clear(&view);
        if (status != STATUS_OK || is_final)
            return status;
    }
    return problem_set(problem, STATUS_TIMEOUT, "no node made a study within %d s: %s", WAIT_S,
                       shown);
}

static Status trial_run(const ClusterSettings *cluster, Problem *problem) {
    const JobManagerSettings settings = {.workers = 1,
                                         .queue_most = 1,
                                         .limits = {.samples = 1 << 20, .impacts = 1 << 20},
                                         .cluster = *cluster};
    const Submission submission = {.text = trial, .size = strlen(trial)};
    Db *db = NULL;
    JobManager *manager = NULL;
    Job *job = NULL;
    Status status = db_open(NULL, &db, problem);
    if (status == STATUS_OK)
        status = jobs_open(db, &settings, &manager, problem);
    if (status == STATUS_OK)
        status = jobs_submit(manager, &submission, &job, problem);
    if (status == STATUS_OK)
        status = trial_wait(manager, db, job, problem);
    job_unref(job);
    // The study's folder is deleted when Slurm has none of its tasks.
    for (int i = 0; job != NULL && i < END_S * PER_S && rmdir(cluster->shared) != 0; i++)
        (void)nanosleep(&trial_pause, NULL);
    jobs_close(manager);
    db_close(db);
    return status;
}

Status cluster_check(const ClusterSettings *cluster, Problem *problem) {
    ClusterSettings own = *cluster;
    SlurmFacts facts;
    char folder[2100];
    TRY(cluster_check_folder(cluster->shared, problem));
    printf("ok    folder       %s: only this user may write to it\n", cluster->shared);
    TRY(slurm_facts(&cluster->slurm, &facts, problem));
    if (facts.reason[0] != '\0')
        return problem_set(problem, STATUS_BUSY, "no node of the partition takes jobs: %s",
                           facts.reason);
    printf("ok    Slurm        answers; %zu processors take jobs\n", facts.slots);
    (void)fflush(stdout);
    snprintf(folder, sizeof folder, "%s/check-%ld", cluster->shared, (long)getpid());
    if (mkdir(folder, 0700) != 0)
        return problem_set(problem, STATUS_IO, "%.300s: %s", folder, strerror(errno));
    own.shared = own.data = folder;
    own.poll_seconds = 0.5;
    own.attempts = 1;
    const Status status = trial_run(&own, problem);
    (void)rmdir(folder);
    TRY(status);
    printf("ok    a study      was made by a node with the engine %s\n", engine_version);
    return STATUS_OK;
}
