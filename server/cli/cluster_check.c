// impactd check --executor slurm: whether a cluster can make studies, step by step.
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "server/cli/command.h"
#include "server/jobs/chunk_file.h"
#include "server/jobs/jobs.h"
#include "server/jobs/slurm.h"
#include "server/util/clock.h"

enum { WAIT_S = 120 };

const char *const executor_names[] = {"threads", "slurm", NULL};

static const char trial[] =
    "{\"structure\": {\"kind\": \"sdof\", \"mass\": 1.35, \"stiffness\": 865}, \"dampers\": "
    "[{\"mass\": 0.1, \"clearance\": 0.01, \"buffer\": {\"restitution\": 0.6, \"contact_time\": "
    "0.02}}], \"excitation\": {\"kind\": \"free\", \"displacement\": 0.015}, \"duration\": 1, "
    "\"sample_rate\": 100, "
    "\"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/dampers/0/clearance\", "
    "\"values\": [0.01, 0.02]}]}}";

Status cluster_check_folder(const char *shared, Problem *problem) {
    struct stat facts;
    if (shared == NULL || shared[0] != '/')
        return problem_add(problem, STATUS_USAGE, "--shared",
                           "must be the absolute path of a folder that this machine and all nodes "
                           "see, for --executor slurm");
    if (stat(shared, &facts) != 0)
        return problem_add(problem, STATUS_USAGE, "--shared", "%.300s: %s", shared,
                           strerror(errno));
    if (!S_ISDIR(facts.st_mode) || access(shared, W_OK) != 0)
        return problem_add(problem, STATUS_USAGE, "--shared",
                           "%.300s must be a folder that this user may write to", shared);
    if ((facts.st_mode & (S_IWGRP | S_IWOTH)) != 0)
        return problem_add(problem, STATUS_USAGE, "--shared",
                           "others may write to %.300s, and thus change results; chmod go-w it",
                           shared);
    return STATUS_OK;
}

static void step_print(const char *what, const char *format, const char *value) {
    printf("ok    %-12s ", what);
    printf(format, value);
    printf("\n");
    (void)fflush(stdout);
}

// The file that the node made, while it is waited for.
static Status trial_wait(const char *folder, const ChunkPlan *plan, const ChunkKey *key,
                         const char *name, Problem *problem) {
    const int64_t end_ns = clock_monotonic_ns() + (int64_t)WAIT_S * 1000000000;
    const struct timespec pause = {1, 0};
    char shown[80] = "";
    for (bool has_ended = false;;) {
        ChunkFile file;
        SlurmTasks tasks;
        const Status found = chunk_read(folder, plan, key, 0, &file, NULL);
        bytes_clear(&file.bytes);
        if (found == STATUS_OK)
            return STATUS_OK;
        if (found != STATUS_NOT_FOUND)
            return problem_set(problem, found, "the file that the node wrote is not right");
        if (has_ended)
            return problem_set(
                problem, STATUS_IO,
                "the node wrote no file that is seen here (%s); %.300s/log/0 has what "
                "it printed. Is %s there at the same path, and the folder too?",
                shown, folder, "impactd");
        TRY(slurm_tasks(name, &tasks, problem));
        const SlurmTask *task = tasks.count > 0 ? &tasks.at[0] : NULL;
        has_ended = task == NULL || task->state == SLURM_ENDED;
        text_fit(shown, sizeof shown, task != NULL ? task->reason : "Slurm does not know the job");
        free(tasks.at);
        if (clock_monotonic_ns() > end_ns)
            return problem_set(problem, STATUS_TIMEOUT, "the job did not run within %d s: %s",
                               WAIT_S, shown);
        (void)nanosleep(&pause, NULL);
    }
}

// A study of two runs, made by a node.
static Status trial_run(const ClusterSettings *cluster, const char *folder, Problem *problem) {
    const SimulationLimits limits = {.samples = 1 << 20,
                                     .impacts = 1 << 20,
                                     .steps = 1e9,
                                     .bytes = SIMULATION_BYTES,
                                     .document_bytes = DOCUMENT_BYTES};
    char program[PATH_MAX] = "", name[64], result[72];
    Db *db = NULL;
    StudyRequest request;
    Warnings warnings = {NULL, 0};
    ChunkKey key;
    ChunkPlan plan = {.engine = NULL};
    TRY(db_open(NULL, &db, problem));
    Status status = jobs_prepare(db, trial, strlen(trial), &limits, &request, &warnings, problem);
    if (status == STATUS_OK)
        status = jobs_result_id(&request, result, problem);
    if (status == STATUS_OK)
        status = chunk_plan_make(&plan, &request, result, &limits, problem);
    plan.members = 2;
    plan.chunks = 1;
    plan.is_strided = true;
    if (status == STATUS_OK)
        status = chunk_folder_make(folder, &plan, &request, db, &key, problem);
    if (status == STATUS_OK)
        status = slurm_make_start(folder, problem);
    (void)!readlink("/proc/self/exe", program, sizeof program - 1);
    snprintf(name, sizeof name, "impactd-check-%ld", (long)getpid());
    const SlurmSettings slurm = {cluster->partition, &cluster->options};
    const SlurmArray array = {.name = name, .folder = folder, .program = program, .tasks = "0"};
    if (status == STATUS_OK)
        status = slurm_submit(&slurm, &array, problem);
    if (status == STATUS_OK)
        status = trial_wait(folder, &plan, &key, name, problem);
    if (status != STATUS_OK)
        (void)slurm_cancel(name, false, NULL);
    chunk_plan_clear(&plan);
    warnings_clear(&warnings);
    study_request_clear(&request);
    db_close(db);
    return status;
}

Status cluster_check(const ClusterSettings *cluster, Problem *problem) {
    const SlurmSettings slurm = {cluster->partition, &cluster->options};
    SlurmFacts facts;
    char folder[PATH_MAX], log[PATH_MAX], slots[24];
    TRY(cluster_check_folder(cluster->shared, problem));
    step_print("folder", "%s: only this user may write to it", cluster->shared);
    TRY(slurm_facts(&slurm, &facts, problem));
    if (facts.reason[0] != '\0')
        return problem_set(problem, STATUS_BUSY, "no node of the partition takes jobs: %s",
                           facts.reason);
    snprintf(slots, sizeof slots, "%zu", facts.slots);
    step_print("Slurm", "answers; %s processors take jobs", slots);
    snprintf(folder, sizeof folder, "%.2000s/check-%ld", cluster->shared, (long)getpid());
    const Status status = trial_run(cluster, folder, problem);
    snprintf(log, sizeof log, "%.2100s/log/0", folder);
    if (status == STATUS_OK || access(log, F_OK) != 0) // else it has what is to be read
        chunk_folder_remove(folder);
    TRY(status);
    step_print("a chunk", "was made on a node with the engine %s", engine_version);
    return STATUS_OK;
}
