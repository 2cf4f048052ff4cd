#define _XOPEN_SOURCE 700 // realpath
#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/jobs/chunk_file.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/slurm.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"
#include "server/util/process.h"
#include "server/util/thread_pool.h"

enum {
    GUESSED_SLOTS = 16,
    PROBE_BYTES = 1 << 20,
    WINDOW_MOST = 4096, // tasks of a study that Slurm has at once
    TASKS_BYTES = 7000, // of a list of tasks
    NAME_SIZE = 120,
    RESULT_SIZE = 66, // of a result's id
};
static const char prefix[] = "impactd-"; // of the name of a study
static const double turn_each = 0.2;     // [s] between turns of the thread
static const double scan_each = 0.5;     // [s] between looks at the folder
static const double poll_most = 60;      // [s] between questions to Slurm
static const double facts_each = 5;      // [s] between questions about its nodes
static const double tidy_each = 1;       // [s]
static const double audit_share = 0.02;  // of the time since the study began

typedef enum ChunkState { CHUNK_TO_DO, CHUNK_SUBMITTED, CHUNK_DONE } ChunkState;

typedef struct ClusterChunk {
    SweepChunk *rows; // of a sweep
    ChunkState state;
    unsigned attempts;
    bool has_file, is_verified, is_live, was_missing;
    const SlurmTask *last; // while Slurm's list is read; NULL: it knows none
} ClusterChunk;

typedef struct ClusterStudy {
    struct ClusterStudy *next;
    Cluster *cluster;
    StudyRun *run;
    ChunkPlan plan;
    ChunkKey key;
    char name[NAME_SIZE]; // of its folder, and of its jobs
    char folder[PATH_MAX];
    ClusterChunk *chunks;
    size_t first;    // all before it are done
    double patience; // times the predicted time of a chunk, that are asked for it
    size_t window;   // tasks that Slurm takes at once, as far as is known
    bool is_blocked; // the folder could not be written to
    int64_t began_ns, scan_ns, poll_ns;
    double poll_pause, audit_seconds;
    char logged[240];
} ClusterStudy;

struct Cluster {
    JobManager *manager;
    const ClusterSettings *settings;
    char program[PATH_MAX], id[9];
    ino_t shared;         // number of the folder
    pthread_mutex_t lock; // no study's folder is made and deleted at once; of the facts
    pthread_t thread;
    bool is_started;
    Worker worker;         // ends studies
    ClusterStudy *studies; // under the manager's lock
    SlurmFacts facts;
    int64_t facts_ns, tidy_ns;
};

static int64_t seconds_ns(double seconds) {
    return (int64_t)(1e9 * seconds);
}

// What went wrong, for its readers and the log.
static void study_explain(ClusterStudy *study, const char *reason) {
    JobManager *manager = study->cluster->manager;
    Bytes line = {.most = 1024};
    pthread_mutex_lock(&manager->lock);
    text_fit(study->run->view.reason, sizeof study->run->view.reason, reason);
    pthread_mutex_unlock(&manager->lock);
    if (strcmp(study->logged, study->run->view.reason) == 0)
        return;
    text_fit(study->logged, sizeof study->logged, reason);
    bytes_format(&line, "the study %.20s on the cluster:", study->run->task->result);
    log_put(&line, "reason", study->logged, sizeof study->logged);
    log_write(&line);
    bytes_clear(&line);
}

// What the cluster has, as Slurm said lately or says now.
static SlurmFacts cluster_facts(Cluster *cluster) {
    SlurmFacts facts;
    pthread_mutex_lock(&cluster->lock);
    if (clock_monotonic_ns() >= cluster->facts_ns) {
        if (slurm_facts(&cluster->settings->slurm, &facts, NULL) == STATUS_OK)
            cluster->facts = facts;
        cluster->facts_ns = clock_monotonic_ns() + seconds_ns(facts_each);
    }
    facts = cluster->facts;
    pthread_mutex_unlock(&cluster->lock);
    return facts;
}

static size_t cluster_slots(Cluster *cluster, const StudyKind *kind, double seconds) {
    if (seconds < cluster->settings->seconds ||
        (kind != &study_sweep && kind != &study_ensemble && kind != &study_fragility))
        return 0;
    const size_t slots = cluster_facts(cluster).slots;
    return slots > 0 ? slots : GUESSED_SLOTS;
}

// --- a study ---

static void cluster_study_free(ClusterStudy *study) {
    if (study == NULL)
        return;
    for (size_t i = 0; study->chunks != NULL && i < study->plan.chunks; i++)
        sweep_chunk_free(study->chunks[i].rows);
    free(study->chunks);
    chunk_plan_clear(&study->plan);
    free(study);
}

// Writes what is to be made, as far as it is not in the folder. Where the file system of the shared
// folder is not mounted, no node would see what is written, and no file of theirs be seen here.
static Status study_write(ClusterStudy *study, Problem *problem) {
    const char *shared = study->cluster->settings->shared;
    struct stat facts;
    if (stat(shared, &facts) != 0 || facts.st_ino != study->cluster->shared)
        return problem_set(problem, STATUS_IO,
                           "%.160s is not the folder that it was when the server started: mount "
                           "it, or start the server again",
                           shared);
    pthread_mutex_lock(&study->cluster->lock);
    Status status = chunk_folder_make(study->folder, &study->plan, &study->key, problem);
    if (status == STATUS_OK)
        status =
            chunk_folder_put(study->folder, "start", slurm_start, strlen(slurm_start), problem);
    pthread_mutex_unlock(&study->cluster->lock);
    return status;
}

static Status cluster_prepare(StudyRun *run, size_t slots, Problem *problem) {
    Cluster *cluster = run->manager->cluster;
    ClusterStudy *study = run->cluster = calloc(1, sizeof *study);
    if (study == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    *study = (ClusterStudy){.cluster = cluster,
                            .run = run,
                            .window = WINDOW_MOST,
                            .patience = 3,
                            .began_ns = clock_monotonic_ns(),
                            .poll_pause = cluster->settings->poll_seconds};
    snprintf(study->name, sizeof study->name, "%s%s-%s-%llu", prefix, run->task->result,
             cluster->id, (unsigned long long)run->sweep.retries);
    snprintf(study->folder, sizeof study->folder, "%.3000s/%s", cluster->settings->shared,
             study->name);
    ChunkPlan *plan = &study->plan;
    TRY(chunk_plan_make(plan, &run->task->inquiry, run->manager->db, &run->manager->settings.limits,
                        problem));
    plan->members = run->work->members;
    plan->is_strided = plan->is_made = run->is_sweep;
    plan->chunks = run->is_sweep ? run->sweep.chunks : study_count_chunks(run, slots);
    TRY(study_write(study, problem));
    study->chunks = calloc((size_t)plan->chunks, sizeof *study->chunks);
    if (study->chunks == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    for (SweepChunk *rows; (rows = run->chunks) != NULL; run->chunks = rows->next)
        study->chunks[rows->row.chunk].rows = rows;
    run->view.chunks = plan->chunks;
    for (size_t i = 0; run->is_sweep && i < plan->chunks; i++)
        if (study->chunks[i].rows == NULL) { // the database has them
            study->chunks[i].state = CHUNK_DONE;
            run->view.done++;
        }
    return STATUS_OK;
}

static void cluster_take(StudyRun *run) {
    ClusterStudy *study = run->cluster;
    Cluster *cluster = study->cluster;
    run->task->workers++;
    study->next = cluster->studies;
    cluster->studies = study;
    pthread_cond_broadcast(&run->manager->stopping);
}

// --- files that came back ---

// Makes one of the members here and compares the bytes: a node that computes other digits would
// give results that depend on where they were made. Not of a run that failed, and only while this
// takes little of the time.
static bool chunk_is_ours(ClusterStudy *study, size_t chunk, ChunkFile file) {
    StudyWork *work = study->run->work;
    const Progress watch = {study->run->task, task_is_wanted};
    const StudyTools tools = {
        .limits = work->limits, .progress = &watch, .workspace = &study->cluster->worker.workspace};
    const size_t place = (chunk * 7919) % chunk_plan_count(&study->plan, chunk);
    const int64_t began_ns = clock_thread_cpu_ns();
    const char *bytes = NULL;
    size_t size = 0;
    bool is_same = true;
    Bytes own = {0};
    Problem problem = {.status = STATUS_OK};
    if (study->audit_seconds >
        audit_share * 1e-9 * (double)(clock_monotonic_ns() - study->began_ns))
        return true;
    for (size_t i = 0; i <= place; i++)
        (void)chunk_next(&file, &bytes, &size);
    StudyPart *theirs = part_blob_read(work, bytes, size), *ours = NULL;
    if (theirs != NULL && theirs->run.status == STATUS_OK &&
        study_part_make(work, chunk_plan_member(&study->plan, chunk, place), &tools, &ours,
                        &problem) == STATUS_OK) {
        part_blob_write(&own, ours);
        is_same = own.is_failed || (own.count == size && memcmp(own.at, bytes, size) == 0);
    }
    study_part_free(work, theirs);
    study_part_free(work, ours);
    bytes_clear(&own);
    study->audit_seconds += 1e-9 * (double)(clock_thread_cpu_ns() - began_ns);
    return is_same;
}

static Status chunk_fold(ClusterStudy *study, size_t chunk, ChunkFile *file, Problem *problem) {
    StudyRun *run = study->run;
    ClusterChunk *of = &study->chunks[chunk];
    const char *bytes;
    size_t size;
    Status status = STATUS_OK;
    if (run->is_sweep)
        TRY(sweep_chunk_restart(run, of->rows, problem));
    for (size_t place = 0; status == STATUS_OK && chunk_next(file, &bytes, &size); place++) {
        const size_t member = chunk_plan_member(&study->plan, chunk, place);
        StudyPart *part = part_blob_read(run->work, bytes, size);
        if (part == NULL)
            return problem_set(problem, STATUS_INVALID, "chunk %zu cannot be read", chunk);
        // What was folded before a failure stays.
        if (!run->is_sweep && !atomic_load(&run->engine.is_over) && member >= run->engine.folded) {
            status = study_engine_fold(&run->engine, member, part, problem);
            continue;
        }
        if (run->is_sweep)
            sweep_chunk_put(run, of->rows, part);
        study_part_free(run->work, part);
    }
    if (status != STATUS_OK || !run->is_sweep)
        return status;
    TRY(sweep_chunk_save(run, of->rows, problem));
    run->rows_made += of->rows->count;
    run->rows_failed += (size_t)of->rows->row.failed;
    return STATUS_OK;
}

// It is made again, if it may be and was not tried too often; else its members are runs that
// failed.
static void chunk_is_lost(ClusterStudy *study, size_t chunk, bool is_final, const char *why,
                          Problem *problem) {
    ClusterChunk *of = &study->chunks[chunk];
    const size_t count = chunk_plan_count(&study->plan, chunk);
    char copy[240];
    Bytes bytes = {0};
    text_fit(copy, sizeof copy, why);
    problem_clear(problem);
    of->state = CHUNK_TO_DO;
    of->has_file = of->is_verified = of->was_missing = false;
    study->poll_ns = 0;
    study_explain(study, copy);
    study->patience = fmax(study->patience, 3 * exp2(++of->attempts)); // it may have been slow
    if (of->attempts < study->cluster->settings->attempts && !is_final)
        return;
    chunk_begin(&bytes, &study->key, chunk, count);
    for (size_t i = 0; i < count; i++)
        chunk_add_failure(&bytes, STATUS_IO, copy);
    of->has_file = chunk_save(study->folder, chunk, &bytes, problem) == STATUS_OK;
    if (!of->has_file)
        study_explain(study, problem->detail);
    bytes_clear(&bytes);
}

// Takes a chunk whose file is there. A file that is not right is made again. A failure is the
// daemon's, and may pass.
static Status chunk_ingest(ClusterStudy *study, size_t chunk, Problem *problem) {
    JobManager *manager = study->cluster->manager;
    ClusterChunk *of = &study->chunks[chunk];
    const bool is_early = !study->run->is_sweep && chunk != study->first;
    char path[PATH_MAX];
    ChunkFile file;
    snprintf(path, sizeof path, "%.3000s/chunks/%zu", study->folder, chunk);
    Status status = chunk_read(study->folder, &study->plan, &study->key, chunk, &file, problem);
    if (status == STATUS_OK && !of->is_verified && !chunk_is_ours(study, chunk, file))
        status = problem_set(problem, STATUS_INVALID,
                             "chunk %zu has other digits than this machine computes: give the "
                             "cluster's machines the same impactd, or choose others by "
                             "--sbatch-option",
                             chunk);
    of->is_verified = status == STATUS_OK;
    if (status == STATUS_OK && !is_early)
        status = chunk_fold(study, chunk, &file, problem);
    bytes_clear(&file.bytes);
    if (status == STATUS_INVALID) {
        (void)unlink(path);
        chunk_is_lost(study, chunk, false, problem->detail, problem);
    }
    if (status == STATUS_NOT_FOUND) // it was there a moment ago; its task says what happened
        of->has_file = false;
    if (status == STATUS_INVALID || status == STATUS_NOT_FOUND)
        return STATUS_OK;
    TRY(status);
    if (is_early)
        return STATUS_OK;
    study_engine_count(&study->run->engine, chunk_plan_count(&study->plan, chunk));
    if (study->run->is_sweep) { // the database has its rows
        (void)unlink(path);
        sweep_chunk_free(of->rows);
        of->rows = NULL;
    }
    of->state = CHUNK_DONE;
    pthread_mutex_lock(&manager->lock);
    study->run->view.done++;
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

// Looks which chunks have files. A folder that was deleted is made again, with what is to be made.
static Status study_look(ClusterStudy *study, Problem *problem) {
    char path[PATH_MAX], *end;
    snprintf(path, sizeof path, "%.3000s/chunks", study->folder);
    DIR *list = opendir(path);
    const struct dirent *entry;
    if (list == NULL && errno == ENOENT) {
        TRY(study_write(study, problem));
        list = opendir(path);
    }
    if (list == NULL)
        return problem_set(problem, STATUS_IO, "%.200s cannot be read: %s", path, strerror(errno));
    while ((entry = readdir(list)) != NULL) {
        const bool is_number = entry->d_name[0] >= '0' && entry->d_name[0] <= '9';
        const unsigned long chunk = strtoul(entry->d_name, &end, 10);
        if (is_number && *end == '\0' && chunk < study->plan.chunks)
            study->chunks[chunk].has_file = true;
    }
    (void)closedir(list);
    return STATUS_OK;
}

static bool study_is_at_end(const ClusterStudy *study) {
    return atomic_load(&study->run->engine.is_over) || atomic_load(&study->run->task->is_stopped);
}

// Members that are folded are taken in their order, but wrong files are seen at once.
static void study_scan(ClusterStudy *study, Problem *problem) {
    Status status = study_look(study, problem);
    for (size_t i = study->first;
         status == STATUS_OK && i < study->plan.chunks && !study_is_at_end(study); i++) {
        const ClusterChunk *chunk = &study->chunks[i];
        if (chunk->state != CHUNK_DONE && chunk->has_file &&
            (study->run->is_sweep || i == study->first || !chunk->is_verified))
            status = chunk_ingest(study, i, problem);
        if (chunk->state == CHUNK_DONE && i == study->first)
            study->first++;
    }
    if (status != STATUS_OK && !status_is_transient(status) && status != STATUS_CANCELLED)
        study_run_fail(study->run, status, problem);
    else if (status != STATUS_OK)
        study_explain(study, problem->detail);
    study->scan_ns = clock_monotonic_ns() + seconds_ns(scan_each);
}

// --- what Slurm knows ---

// The last line that a task printed.
static void task_log(const ClusterStudy *study, const SlurmTask *task, char text[160]) {
    char path[PATH_MAX], tail[512], *rest;
    snprintf(path, sizeof path, "%.3000s/log/%s", study->folder, task->id);
    FILE *file = fopen(path, "re");
    text[0] = '\0';
    if (file == NULL)
        return;
    (void)fseek(file, -(long)sizeof tail + 1, SEEK_END); // of a short one to its beginning
    tail[fread(tail, 1, sizeof tail - 1, file)] = '\0';
    (void)fclose(file);
    for (char *line = strtok_r(tail, "\n", &rest); line != NULL; line = strtok_r(NULL, "\n", &rest))
        text_fit(text, 160, line);
}

// Whether a chunk can be written.
static Status study_probe(ClusterStudy *study, Problem *problem) {
    const size_t chunk = chunk_plan_count(&study->plan, 0) * study->run->work->part_bytes;
    const size_t size = chunk > PROBE_BYTES ? chunk : PROBE_BYTES;
    void *zeros = calloc(1, size);
    char path[PATH_MAX];
    Status status = study_write(study, problem);
    if (status == STATUS_OK && zeros != NULL) {
        status = chunk_folder_put(study->folder, "chunks/probe", zeros, size, problem);
        snprintf(path, sizeof path, "%.3000s/chunks/probe", study->folder);
        (void)unlink(path); // what lies in the folder is seen afresh, too
    }
    free(zeros);
    study->is_blocked = status != STATUS_OK;
    return status;
}

// The last task of this chunk ended, and no file of it is seen here.
static void chunk_ended(ClusterStudy *study, size_t chunk, Problem *problem) {
    ClusterChunk *of = &study->chunks[chunk];
    const SlurmTask *task = of->last;
    char printed[160] = "", why[240];
    const int code = task != NULL ? task->exit_code : 0;
    if (study->is_blocked || code == CHUNK_FULL) { // no attempt
        of->state = CHUNK_TO_DO;
        of->was_missing = false;
        if (!study->is_blocked)
            study_explain(study, "a node found the shared folder full");
    } else {
        if (task != NULL)
            task_log(study, task, printed);
        snprintf(why, sizeof why, "the cluster could not run it (%.60s, exit code %d)%s%.120s",
                 task != NULL ? task->reason : "Slurm does not know it any more", code,
                 printed[0] != '\0' ? ": " : "", printed);
        chunk_is_lost(study, chunk, code == CHUNK_BAD, why, problem);
    }
}

// The chunks whose tasks ended without a file. The folder may show it late, so this is judged when
// Slurm is asked the next time. Without space Slurm cannot even begin a task.
static Status study_find_lost(ClusterStudy *study, Problem *problem) {
    Status status = STATUS_OK;
    bool is_probed = false;
    for (size_t i = study->first; i < study->plan.chunks; i++) {
        ClusterChunk *chunk = &study->chunks[i];
        if (chunk->state != CHUNK_SUBMITTED || chunk->is_live || chunk->has_file)
            continue;
        if (!chunk->was_missing) {
            chunk->was_missing = true;
            continue;
        }
        if (!is_probed) {
            status = study_probe(study, problem);
            (void)study_look(study, NULL);
        }
        is_probed = true;
        if (!chunk->has_file)
            chunk_ended(study, i, problem);
    }
    return status;
}

static Status study_apply_tasks(ClusterStudy *study, const SlurmTasks *tasks, Problem *problem) {
    ClusterView *view = &study->run->view;
    size_t counts[SLURM_ENDED + 1] = {0};
    const SlurmTask *waits = NULL;
    for (size_t i = 0; i < study->plan.chunks; i++) {
        study->chunks[i].is_live = false;
        study->chunks[i].last = NULL;
    }
    for (size_t i = 0; i < tasks->count; i++) {
        const SlurmTask *task = &tasks->at[i];
        if (task->chunk >= study->plan.chunks)
            continue;
        ClusterChunk *chunk = &study->chunks[task->chunk];
        if (chunk->last == NULL || chunk->last->job <= task->job)
            chunk->last = task;
        counts[task->state]++;
        if (task->state == SLURM_HELD)
            (void)slurm_cancel(task->id, true, NULL);
        if (task->state != SLURM_QUEUED && task->state != SLURM_RUNNING)
            continue;
        chunk->is_live = true;
        chunk->was_missing = false;
        if (chunk->state == CHUNK_TO_DO)
            chunk->state = CHUNK_SUBMITTED;
        if (task->state == SLURM_QUEUED && waits == NULL)
            waits = task;
    }
    Status status = study_look(study, problem);
    if (status == STATUS_OK)
        status = study_find_lost(study, problem);
    const size_t queued = counts[SLURM_QUEUED], running = counts[SLURM_RUNNING];
    const bool is_same = view->queued == queued && view->running == running;
    const SlurmFacts facts = cluster_facts(study->cluster);
    pthread_mutex_lock(&study->cluster->manager->lock);
    view->queued = queued;
    view->running = running;
    if (running > 0)
        view->reason[0] = '\0';
    else if (waits != NULL)
        text_fit(view->reason, sizeof view->reason,
                 facts.reason[0] != '\0' ? facts.reason : waits->reason);
    pthread_mutex_unlock(&study->cluster->manager->lock);
    const double least = study->cluster->settings->poll_seconds;
    study->poll_pause = is_same ? fmin(1.5 * study->poll_pause, fmax(poll_most, least)) : least;
    return status;
}

// Members beyond those that are expected may not be wanted.
static bool study_wants_chunk(const ClusterStudy *study, size_t chunk) {
    const ClusterChunk *of = &study->chunks[chunk];
    return of->state == CHUNK_TO_DO && !of->has_file &&
           (study->run->is_sweep ||
            chunk_plan_member(&study->plan, chunk, 0) < atomic_load(&study->run->engine.expected));
}

static Status study_send(ClusterStudy *study, size_t first, Bytes *tasks, Problem *problem) {
    const double seconds = study->run->task->queued.seconds / (double)study->plan.chunks;
    const SlurmArray array = {.name = study->name,
                              .folder = study->folder,
                              .program = study->cluster->program,
                              .tasks = tasks->at,
                              .first = first,
                              .seconds = study->patience * seconds};
    Status status = study_result(status_made(!tasks->is_failed), problem);
    if (status == STATUS_OK)
        status = study_write(study, problem);
    if (status == STATUS_OK)
        status = slurm_submit(&study->cluster->settings->slurm, &array, problem);
    bytes_clear(tasks);
    return status;
}

// Sends what is wanted and not sent, as much as Slurm takes at once. After a failure Slurm may have
// the tasks all the same: it is asked before anything is sent again.
static Status study_submit(ClusterStudy *study, Problem *problem) {
    const size_t each = cluster_facts(study->cluster).array_max;
    size_t live = 0;
    if (study->is_blocked)
        TRY(study_probe(study, problem));
    for (size_t i = study->first; i < study->plan.chunks; i++)
        live += study->chunks[i].state == CHUNK_SUBMITTED;
    for (size_t at = study->first; at < study->plan.chunks && live < study->window;) {
        Bytes tasks = {0}; // of one array, which begins at chunk `first`
        const size_t from = at, first = at / each * each;
        size_t count = 0;
        for (; at < study->plan.chunks && at < first + each && live + count < study->window &&
               tasks.count < TASKS_BYTES;
             at++)
            if (study_wants_chunk(study, at))
                bytes_format(&tasks, "%s%zu", count++ > 0 ? "," : "", at - first);
        if (count == 0)
            continue;
        const Status status = study_send(study, first, &tasks, problem);
        if (status != STATUS_OK) {
            study->window = live + count / 2 > 0 ? live + count / 2 : 1;
            return status;
        }
        for (size_t i = from; i < at; i++)
            if (study_wants_chunk(study, i))
                study->chunks[i].state = CHUNK_SUBMITTED;
        live += count;
        study->poll_pause = study->cluster->settings->poll_seconds;
    }
    study->window = study->window + 1 + study->window / 8;
    study->window = study->window < WINDOW_MOST ? study->window : WINDOW_MOST;
    return STATUS_OK;
}

// Asks Slurm, and sends what it does not have. While nothing is known nothing is sent.
static void study_poll(ClusterStudy *study, Problem *problem) {
    SlurmTasks tasks;
    const int64_t began_ns = clock_monotonic_ns();
    Status status = slurm_tasks(study->name, &tasks, problem);
    if (status == STATUS_OK)
        status = study_apply_tasks(study, &tasks, problem);
    if (status == STATUS_OK)
        status = study_submit(study, problem);
    free(tasks.at);
    if (status != STATUS_OK) {
        study_explain(study, problem->detail);
        study->poll_pause = fmin(2 * study->poll_pause, poll_most);
        if (study->cluster->settings->attempts == 1)
            study_run_fail(study->run, status, problem);
    }
    const int64_t now_ns = clock_monotonic_ns();
    const double cost = 1e-9 * (double)(now_ns - began_ns);
    study->poll_ns = now_ns + seconds_ns(fmax(study->poll_pause, fmin(5 * cost, poll_most)));
}

// --- the thread ---

static void study_step(ClusterStudy *study, Problem *problem) {
    task_count_cpu();
    if (clock_monotonic_ns() >= study->scan_ns)
        study_scan(study, problem);
    problem_clear(problem);
    if (clock_monotonic_ns() >= study->poll_ns && !study_is_at_end(study))
        study_poll(study, problem);
}

// Cancels and deletes what is left of a study that no job wants any more. Should it be wanted again
// meanwhile, it waits for the lock. Returns whether anything is left.
static bool cluster_tidy_one(Cluster *cluster, const char *name) {
    JobManager *manager = cluster->manager;
    char path[PATH_MAX], result[RESULT_SIZE + 1];
    SlurmTasks tasks = {NULL, 0};
    snprintf(path, sizeof path, "%.3000s/%s", cluster->settings->shared, name);
    snprintf(result, sizeof result, "%.66s", name + sizeof prefix - 1);
    pthread_mutex_lock(&cluster->lock);
    pthread_mutex_lock(&manager->lock);
    const bool is_wanted = manager->is_closing || hashmap_find(manager->tasks, result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    bool is_left = is_wanted || slurm_cancel(name, false, NULL) != STATUS_OK ||
                   slurm_tasks(name, &tasks, NULL) != STATUS_OK;
    // One that was about to start may have escaped.
    for (size_t i = 0; i < tasks.count; i++)
        is_left = is_left || tasks.at[i].state != SLURM_ENDED;
    free(tasks.at);
    if (!is_left)
        chunk_folder_remove(path);
    pthread_mutex_unlock(&cluster->lock);
    return is_left || access(path, F_OK) == 0;
}

static void cluster_tidy(Cluster *cluster) {
    const int64_t began_ns = clock_monotonic_ns();
    const struct dirent *entry;
    DIR *list = opendir(cluster->settings->shared);
    bool is_left = list == NULL;
    while (list != NULL && (entry = readdir(list)) != NULL) {
        const char *name = entry->d_name, *id = name + sizeof prefix - 1 + RESULT_SIZE + 1;
        if (strncmp(name, prefix, sizeof prefix - 1) == 0 &&
            strlen(name) > sizeof prefix + RESULT_SIZE && strncmp(id, cluster->id, 8) == 0)
            is_left = cluster_tidy_one(cluster, name) || is_left;
    }
    if (list != NULL)
        (void)closedir(list);
    const int64_t now_ns = clock_monotonic_ns(), cost_ns = now_ns - began_ns;
    cluster->tidy_ns = is_left ? now_ns + 5 * cost_ns + seconds_ns(tidy_each) : INT64_MAX;
}

// What runs for a study goes on when the daemon ends; when the study does, it is tidied up.
static void *cluster_main(void *context) {
    Cluster *cluster = context;
    JobManager *manager = cluster->manager;
    Problem problem;
    pthread_mutex_lock(&manager->lock);
    while (!manager->is_closing || cluster->studies != NULL) {
        // Only this thread removes studies; new ones come before.
        for (ClusterStudy **at = &cluster->studies, *study; (study = *at) != NULL;) {
            const bool is_over = study_is_at_end(study) || manager->is_closing;
            *at = is_over ? study->next : study;
            pthread_mutex_unlock(&manager->lock);
            problem_clear(&problem);
            if (is_over)
                study_leave(&cluster->worker, study->run, &problem);
            else
                study_step(study, &problem);
            cluster->tidy_ns = is_over ? 0 : cluster->tidy_ns;
            pthread_mutex_lock(&manager->lock);
            at = is_over ? &cluster->studies : &study->next;
        }
        if (manager->is_closing)
            continue;
        pthread_mutex_unlock(&manager->lock);
        if (clock_monotonic_ns() >= cluster->tidy_ns)
            cluster_tidy(cluster);
        pthread_mutex_lock(&manager->lock);
        const bool is_idle = cluster->studies == NULL && cluster->tidy_ns == INT64_MAX;
        const int64_t end_ns = clock_monotonic_ns() + seconds_ns(is_idle ? poll_most : turn_each);
        const struct timespec end = {(time_t)(end_ns / 1000000000), (long)(end_ns % 1000000000)};
        if (!manager->is_closing)
            (void)pthread_cond_timedwait(&manager->stopping, &manager->lock, &end);
    }
    pthread_mutex_unlock(&manager->lock);
    workspace_clear(&cluster->worker.workspace);
    return NULL;
}

// Servers that share a folder, or a scene, do not touch each other's.
static void cluster_set_id(Cluster *cluster) {
    char host[256] = "", text[PATH_MAX + 300], path[PATH_MAX], hex[65];
    unsigned char digest[DIGEST_BYTES];
    const char *data = cluster->settings->data != NULL ? cluster->settings->data : "";
    (void)gethostname(host, sizeof host - 1);
    snprintf(text, sizeof text, "%s:%s", host, realpath(data, path) != NULL ? path : data);
    sha256_sum(text, strlen(text), digest);
    sha256_hex(digest, hex);
    snprintf(cluster->id, sizeof cluster->id, "%.8s", hex);
}

void cluster_close(Cluster *cluster) {
    if (cluster == NULL)
        return;
    if (cluster->is_started)
        (void)pthread_join(cluster->thread, NULL);
    pthread_mutex_destroy(&cluster->lock);
    free(cluster);
}

Status cluster_open(JobManager *manager, Problem *problem) {
    static const StudyExecutor executor = {cluster_slots, cluster_prepare, cluster_take,
                                           cluster_study_free};
    const ClusterSettings *settings = &manager->settings.cluster;
    Cluster *cluster = manager->cluster = calloc(1, sizeof *cluster);
    struct stat facts;
    manager->executor = &executor;
    if (cluster == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the cluster's studies");
    cluster->manager = cluster->worker.manager = manager;
    cluster->settings = settings;
    cluster->facts.array_max = 1001; // until Slurm answers
    cluster_set_id(cluster);
    pthread_mutex_init(&cluster->lock, NULL);
    (void)signal(SIGCHLD, SIG_DFL); // ignored, Slurm's commands would have no exit code
    if (realpath("/proc/self/exe", cluster->program) == NULL || stat(settings->shared, &facts) != 0)
        return problem_set(problem, STATUS_IO, "/proc/self/exe, or %.300s: %s", settings->shared,
                           strerror(errno));
    cluster->shared = facts.st_ino;
    TRY(thread_start(&cluster->thread, cluster_main, cluster, "the cluster's thread", problem));
    cluster->is_started = true;
    return STATUS_OK;
}
