#define _XOPEN_SOURCE 700 // realpath
#include "server/jobs/cluster.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/jobs/chunk_file.h"
#include "server/jobs/slurm.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"
#include "server/util/process.h"

enum {
    ATTEMPTS = 5,
    GUESSED_SLOTS = 16,
    PROBE_BYTES = 1 << 20,
    WINDOW_MOST = 4096, // tasks of a study that Slurm has at once
    CHUNK_BYTES = 64 << 20,
    NAME_SIZE = 120,
    RESULT_SIZE = 66, // of a result's id
};
static const char prefix[] = "impactd-", gone[] = ".gone"; // of the name of a study, after it
static const double scan_least = 0.2, scan_most = 2;       // [s] between looks at the folder
static const double poll_most = 60;                        // [s] between questions to Slurm
static const double facts_each = 5;                        // [s]
static const double tidy_each = 1;                         // [s]
static const double audit_share = 0.02;                    // of the time since the study began

typedef enum ChunkState { CHUNK_TO_DO, CHUNK_SUBMITTED, CHUNK_DONE } ChunkState;

typedef struct ClusterChunk {
    SweepChunk *rows; // of a sweep
    ChunkState state;
    unsigned attempts;
    bool has_file, is_live, was_missing;
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
    bool is_known;   // Slurm told what it has since the start
    bool is_full;    // there was no space for a chunk
    bool is_probed;  // whether there is, since Slurm was asked
    int64_t began_ns, scan_ns, poll_ns, submit_ns;
    double scan_pause, poll_pause, submit_pause, audit_seconds;
    // Under the manager's lock:
    size_t done, queued, running;
    char reason[240], logged[240];
} ClusterStudy;

struct Cluster {
    JobManager *manager;
    const ClusterSettings *settings;
    char program[PATH_MAX], id[9];
    pthread_mutex_t folders; // no study's folder is made and deleted at once
    pthread_t thread;
    bool is_started;
    Worker worker;         // ends studies
    ClusterStudy *studies; // under the manager's lock
    SlurmFacts facts;      // of the thread alone
    int64_t facts_ns, tidy_ns;
    atomic_size_t slots;
};

static SlurmSettings cluster_slurm(const Cluster *cluster) {
    return (SlurmSettings){cluster->settings->partition, &cluster->settings->options};
}

static int64_t seconds_ns(double seconds) {
    return (int64_t)(1e9 * seconds);
}

// What its readers see; "": nothing is wrong.
static void study_set_reason(ClusterStudy *study, const char *reason) {
    JobManager *manager = study->cluster->manager;
    pthread_mutex_lock(&manager->lock);
    text_fit(study->reason, sizeof study->reason, reason);
    pthread_mutex_unlock(&manager->lock);
}

// What went wrong, which is logged too.
static void study_explain(ClusterStudy *study, const char *reason) {
    Bytes line = {.most = 1024};
    study_set_reason(study, reason);
    if (strcmp(study->logged, study->reason) == 0)
        return;
    text_fit(study->logged, sizeof study->logged, reason);
    bytes_format(&line, "the study %.20s on the cluster: %s", study->run->task->result, reason);
    log_write(&line);
    bytes_clear(&line);
}

static bool cluster_wants(const Cluster *cluster, const StudyKind *kind, double seconds) {
    return seconds >= cluster->settings->seconds &&
           (kind == &study_sweep || kind == &study_ensemble || kind == &study_fragility);
}

// Asks Slurm, if that was not done lately.
static void cluster_look(Cluster *cluster) {
    const SlurmSettings slurm = cluster_slurm(cluster);
    const int64_t now_ns = clock_monotonic_ns();
    if (cluster->facts_ns > 0 && now_ns - cluster->facts_ns < seconds_ns(facts_each))
        return;
    SlurmFacts facts;
    if (slurm_facts(&slurm, &facts, NULL) != STATUS_OK)
        return;
    cluster->facts = facts;
    cluster->facts_ns = now_ns;
    if (facts.slots > 0)
        atomic_store(&cluster->slots, facts.slots);
}

static size_t cluster_slots(Cluster *cluster) {
    SlurmFacts facts;
    const SlurmSettings slurm = cluster_slurm(cluster);
    if (atomic_load(&cluster->slots) == 0 && slurm_facts(&slurm, &facts, NULL) == STATUS_OK)
        atomic_store(&cluster->slots, facts.slots);
    const size_t slots = atomic_load(&cluster->slots);
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

static Status study_plan(ClusterStudy *study, size_t slots, Problem *problem) {
    StudyRun *run = study->run;
    const Task *task = run->task;
    ChunkPlan *plan = &study->plan;
    TRY(chunk_plan_make(plan, &task->inquiry, task->result, &run->manager->settings.limits,
                        problem));
    plan->members = run->work->members;
    plan->is_strided = run->is_sweep;
    const double members = (double)plan->members;
    double chunks = (double)study_count_chunks(run, run->work->members, slots);
    chunks = fmax(chunks, ceil(members * (double)run->work->part_bytes / CHUNK_BYTES));
    chunks = fmin(chunks, members);
    // As many as have members.
    plan->chunks = (uint64_t)ceil(members / ceil(members / chunks));
    if (run->is_sweep)
        plan->chunks = run->sweep.chunks;
    return STATUS_OK;
}

static Status cluster_prepare(Cluster *cluster, StudyRun *run, Problem *problem) {
    const ClusterSettings *settings = cluster->settings;
    const double poll = settings->poll_seconds;
    ClusterStudy *study = run->cluster = calloc(1, sizeof *study);
    if (study == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    *study = (ClusterStudy){.cluster = cluster,
                            .run = run,
                            .window = WINDOW_MOST,
                            .patience = 3,
                            .began_ns = clock_monotonic_ns(),
                            .scan_pause = scan_least,
                            .poll_pause = poll,
                            .submit_pause = poll};
    snprintf(study->name, sizeof study->name, "%s%s-%s-%llu", prefix, run->task->result,
             cluster->id, (unsigned long long)run->sweep.retries);
    snprintf(study->folder, sizeof study->folder, "%.3000s/%s", settings->shared, study->name);
    TRY(study_plan(study, cluster_slots(cluster), problem));
    pthread_mutex_lock(&cluster->folders);
    const Status made = chunk_folder_make(study->folder, &study->plan, &run->task->inquiry,
                                          run->manager->db, &study->key, problem);
    pthread_mutex_unlock(&cluster->folders);
    TRY(made);
    study->chunks = calloc((size_t)study->plan.chunks, sizeof *study->chunks);
    if (study->chunks == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    if (run->is_sweep)
        for (size_t i = 0; i < study->plan.chunks; i++)
            study->chunks[i].state = CHUNK_DONE; // unless it is to be made
    study->done = run->is_sweep ? study->plan.chunks : 0;
    for (SweepChunk *rows; (rows = run->chunks) != NULL;) {
        run->chunks = rows->next;
        study->chunks[rows->row.chunk] = (ClusterChunk){.rows = rows, .state = CHUNK_TO_DO};
        study->done--;
    }
    return slurm_make_start(study->folder, problem);
}

static void cluster_take(StudyRun *run) {
    ClusterStudy *study = run->cluster;
    Cluster *cluster = study->cluster;
    run->task->workers++;
    study->next = cluster->studies;
    cluster->studies = study;
    pthread_cond_broadcast(&run->manager->stopping);
}

static void cluster_view(const ClusterStudy *study, ClusterView *view) {
    *view = (ClusterView){.chunks = study->plan.chunks,
                          .done = study->done,
                          .queued = study->queued,
                          .running = study->running};
    text_fit(view->reason, sizeof view->reason, study->reason);
}

// --- files that came back ---

// Makes one of the members here and compares the bytes: a node that computes other digits would
// give results that depend on where they were made. Not of a run that failed, and only while this
// takes little of the time.
static bool chunk_is_ours(ClusterStudy *study, size_t chunk, ChunkFile file) {
    StudyWork *work = study->run->work;
    const StudyTools tools = {.limits = work->limits,
                              .workspace = &study->cluster->worker.workspace};
    const size_t place = (chunk * 7919) % chunk_plan_count(&study->plan, chunk);
    const size_t member = chunk_plan_member(&study->plan, chunk, place);
    const int64_t began_ns = clock_thread_cpu_ns();
    const char *bytes = NULL;
    size_t size = 0;
    Bytes own = {0};
    Problem problem = {.status = STATUS_OK};
    if (study->audit_seconds >
        audit_share * 1e-9 * (double)(clock_monotonic_ns() - study->began_ns))
        return true;
    for (size_t i = 0; i <= place; i++)
        (void)chunk_next(&file, &bytes, &size);
    StudyPart *theirs = part_blob_read(work, bytes, size), *ours = NULL;
    bool is_same = theirs == NULL || theirs->run.status != STATUS_OK ||
                   study_part_make(work, member, &tools, &ours, &problem) != STATUS_OK;
    if (!is_same) {
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

// No machine can make the chunk: its members are runs that failed.
static void chunk_give_up(ClusterStudy *study, size_t chunk, char *why, Problem *problem) {
    const size_t count = chunk_plan_count(&study->plan, chunk);
    StudyPart part = {.run = {.status = STATUS_IO, .why = why, .steps = (double)NAN}};
    Bytes bytes = {0}, one = {0};
    (void)fields_default(summary_fields, &part.run.summary);
    (void)fields_default(reduction_fields, &part.run.reduction);
    part_blob_write(&one, &part);
    chunk_begin(&bytes, &study->key, chunk, count);
    for (size_t i = 0; i < count; i++)
        chunk_add(&bytes, one.at, one.count);
    study->chunks[chunk].has_file = chunk_save(study->folder, chunk, &bytes, problem) == STATUS_OK;
    if (!study->chunks[chunk].has_file)
        study_explain(study, problem->detail);
    bytes_clear(&bytes);
    bytes_clear(&one);
}

// It is made again, if it may be and was not tried too often.
static void chunk_is_lost(ClusterStudy *study, size_t chunk, bool is_final, const char *why,
                          Problem *problem) {
    ClusterChunk *of = &study->chunks[chunk];
    char copy[240];
    text_fit(copy, sizeof copy, why);
    of->state = CHUNK_TO_DO;
    of->has_file = of->was_missing = false;
    study->submit_ns = 0;
    study_explain(study, copy);
    study->patience = fmax(study->patience, 3 * exp2(++of->attempts)); // it may have been slow
    if (of->attempts >= ATTEMPTS || is_final)
        chunk_give_up(study, chunk, copy, problem);
}

// Takes a chunk whose file is there. A file that is not right is made again. A failure is the
// daemon's, and may pass.
static Status chunk_ingest(ClusterStudy *study, size_t chunk, Problem *problem) {
    JobManager *manager = study->cluster->manager;
    ClusterChunk *of = &study->chunks[chunk];
    char path[PATH_MAX];
    ChunkFile file;
    snprintf(path, sizeof path, "%.3000s/chunks/%zu", study->folder, chunk);
    Status status = chunk_read(study->folder, &study->plan, &study->key, chunk, &file, problem);
    if (status == STATUS_OK && !chunk_is_ours(study, chunk, file))
        status = problem_set(problem, STATUS_INVALID,
                             "chunk %zu has other digits than this machine computes: give the "
                             "cluster's machines the same impactd, or choose others by "
                             "--sbatch-option",
                             chunk);
    if (status == STATUS_OK)
        status = chunk_fold(study, chunk, &file, problem);
    bytes_clear(&file.bytes);
    if (status ==
        STATUS_NOT_FOUND) { // it was there a moment ago; Slurm says what became of its task
        of->has_file = false;
        return STATUS_OK;
    }
    if (status == STATUS_INVALID) {
        (void)unlink(path);
        chunk_is_lost(study, chunk, false, problem->detail, problem);
        return STATUS_OK;
    }
    TRY(status);
    study_engine_count(&study->run->engine, chunk_plan_count(&study->plan, chunk));
    if (study->run->is_sweep) { // the database has its rows
        (void)unlink(path);
        sweep_chunk_free(of->rows);
        of->rows = NULL;
    }
    of->state = CHUNK_DONE;
    pthread_mutex_lock(&manager->lock);
    study->done++;
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

// Looks which chunks have files. False: the folder cannot be read.
static bool study_look(ClusterStudy *study) {
    char path[PATH_MAX], *end;
    snprintf(path, sizeof path, "%.3000s/chunks", study->folder);
    DIR *list = opendir(path);
    const struct dirent *entry;
    if (list == NULL)
        return false;
    while ((entry = readdir(list)) != NULL) {
        const bool is_number = entry->d_name[0] >= '0' && entry->d_name[0] <= '9';
        const unsigned long chunk = strtoul(entry->d_name, &end, 10);
        if (is_number && *end == '\0' && chunk < study->plan.chunks)
            study->chunks[chunk].has_file = true;
    }
    (void)closedir(list);
    return true;
}

static void study_scan(ClusterStudy *study, Problem *problem) {
    Status status = STATUS_OK;
    const size_t done = study->done;
    const bool in_order = !study->run->is_sweep;
    if (!study_look(study)) {
        char text[240];
        snprintf(text, sizeof text, "the shared folder cannot be read: %s", strerror(errno));
        study_explain(study, text);
    }
    for (size_t i = study->first; status == STATUS_OK && i < study->plan.chunks; i++) {
        const ClusterChunk *chunk = &study->chunks[i];
        if (atomic_load(&study->run->engine.is_over) || atomic_load(&study->run->task->is_stopped))
            break;
        if (chunk->state != CHUNK_DONE && chunk->has_file)
            status = chunk_ingest(study, i, problem);
        if (chunk->state == CHUNK_DONE && i == study->first)
            study->first++;
        else if (chunk->state != CHUNK_DONE && in_order)
            break;
    }
    if (status != STATUS_OK && !status_is_transient(status) && status != STATUS_CANCELLED)
        study_run_fail(study->run, status, problem);
    else if (status != STATUS_OK)
        study_explain(study, problem->detail);
    const bool has_news = study->done > done;
    study->scan_pause = has_news ? scan_least : fmin(1.5 * study->scan_pause, scan_most);
    study->scan_ns = clock_monotonic_ns() + seconds_ns(study->scan_pause);
}

// --- what Slurm knows ---

// The last line that a task printed.
static void task_log(const ClusterStudy *study, const SlurmTask *task, char text[160]) {
    char path[PATH_MAX], tail[512] = "";
    snprintf(path, sizeof path, "%.3000s/log/%s", study->folder, task->id);
    FILE *file = fopen(path, "re");
    if (file != NULL) {
        if (fseek(file, -(long)sizeof tail + 1, SEEK_END) != 0)
            (void)fseek(file, 0, SEEK_SET);
        tail[fread(tail, 1, sizeof tail - 1, file)] = '\0';
        (void)fclose(file);
    }
    for (size_t length = strlen(tail); length > 0 && tail[length - 1] == '\n';)
        tail[--length] = '\0';
    const char *line = strrchr(tail, '\n');
    text_fit(text, 160, line != NULL ? line + 1 : tail);
}

// Whether there is space for chunks, where there was none. What lies in the folder is seen afresh.
static bool study_has_space(ClusterStudy *study) {
    static const char block[1 << 16] = {1};
    const size_t chunk = chunk_plan_count(&study->plan, 0) * study->run->work->part_bytes;
    const size_t size = chunk > PROBE_BYTES ? chunk : PROBE_BYTES;
    char path[PATH_MAX];
    if (!study->is_full)
        return true;
    snprintf(path, sizeof path, "%.3000s/chunks/probe", study->folder);
    FILE *file = fopen(path, "we");
    bool is_written = file != NULL;
    for (size_t i = 0; is_written && i < size; i += sizeof block)
        is_written = fwrite(block, 1, sizeof block, file) == sizeof block;
    is_written = file != NULL && fclose(file) == 0 && is_written;
    (void)unlink(path);
    study->is_full = !is_written;
    study->submit_ns = clock_monotonic_ns() + seconds_ns(study->cluster->settings->poll_seconds);
    return is_written;
}

// The last task of this chunk (NULL: Slurm knows none any more) ended, and no file of it is seen
// here: the folder may show it late.
static void chunk_ended(ClusterStudy *study, size_t chunk, const SlurmTask *task,
                        Problem *problem) {
    ClusterChunk *of = &study->chunks[chunk];
    char printed[160] = "", why[240], path[PATH_MAX];
    const int code = task != NULL ? task->exit_code : 0;
    if (!of->was_missing) {
        of->was_missing = true;
        return;
    }
    // Without space Slurm cannot even begin a task.
    if (!study->is_probed && !study->is_full) {
        study->is_full = study->is_probed = true;
        (void)study_has_space(study);
    }
    study->is_full = study->is_full || code == CHUNK_FULL;
    snprintf(path, sizeof path, "%.3000s/chunks/%zu", study->folder, chunk);
    if (access(path, F_OK) == 0) {
        of->has_file = true;
    } else if (study->is_full) {
        of->state = CHUNK_TO_DO;
        of->was_missing = false;
        study_explain(study, "the shared folder is full: the study continues when there is space");
    } else {
        if (task != NULL)
            task_log(study, task, printed);
        snprintf(why, sizeof why, "the cluster could not run it (%.60s, exit code %d)%s%.120s",
                 task != NULL ? task->reason : "Slurm does not know it any more", code,
                 printed[0] != '\0' ? ": " : "", printed);
        chunk_is_lost(study, chunk, code == CHUNK_BAD, why, problem);
    }
}

static void study_apply_tasks(ClusterStudy *study, const SlurmTasks *tasks, Problem *problem) {
    JobManager *manager = study->cluster->manager;
    size_t queued = 0, running = 0;
    const char *reason = NULL;
    const SlurmTask **last = calloc((size_t)study->plan.chunks, sizeof *last);
    for (size_t i = 0; i < study->plan.chunks; i++)
        study->chunks[i].is_live = false;
    for (size_t i = 0; i < tasks->count; i++) {
        const SlurmTask *task = &tasks->at[i];
        if (task->chunk >= study->plan.chunks)
            continue;
        ClusterChunk *chunk = &study->chunks[task->chunk];
        if (last != NULL && (last[task->chunk] == NULL || last[task->chunk]->job <= task->job))
            last[task->chunk] = task;
        if (task->state == SLURM_HELD)
            (void)slurm_cancel(task->id, true, NULL);
        if (task->state != SLURM_QUEUED && task->state != SLURM_RUNNING)
            continue;
        chunk->is_live = true;
        chunk->was_missing = false;
        if (chunk->state == CHUNK_TO_DO)
            chunk->state = CHUNK_SUBMITTED;
        running += task->state == SLURM_RUNNING;
        queued += task->state == SLURM_QUEUED;
        if (task->state == SLURM_QUEUED && reason == NULL)
            reason = task->reason;
    }
    const bool is_seen = study_look(study);
    bool is_same = true;
    study->is_probed = false;
    for (size_t i = study->first; is_seen && last != NULL && i < study->plan.chunks; i++) {
        const ClusterChunk *chunk = &study->chunks[i];
        if (chunk->state == CHUNK_SUBMITTED && !chunk->is_live && !chunk->has_file) {
            chunk_ended(study, i, last[i], problem);
            is_same = false;
        }
    }
    free(last);
    pthread_mutex_lock(&manager->lock);
    is_same = is_same && study->queued == queued && study->running == running;
    study->queued = queued;
    study->running = running;
    pthread_mutex_unlock(&manager->lock);
    if (running > 0) {
        study_set_reason(study, "");
    } else if (queued > 0) {
        const SlurmFacts *facts = &study->cluster->facts;
        cluster_look(study->cluster);
        study_set_reason(study, facts->reason[0] != '\0' ? facts->reason : reason);
    }
    const double least = study->cluster->settings->poll_seconds;
    study->poll_pause = is_same ? fmin(1.5 * study->poll_pause, fmax(poll_most, least)) : least;
}

static void study_poll(ClusterStudy *study, Problem *problem) {
    SlurmTasks tasks;
    const int64_t began_ns = clock_monotonic_ns();
    const Status status = slurm_tasks(study->name, &tasks, problem);
    if (status == STATUS_OK) {
        study->is_known = true;
        study_apply_tasks(study, &tasks, problem);
    } else {
        // Nothing is known, so nothing is sent again.
        study->is_known = false;
        study_explain(study, problem->detail);
        study->poll_pause = fmin(2 * study->poll_pause, poll_most);
    }
    free(tasks.at);
    const int64_t now_ns = clock_monotonic_ns();
    const double cost = 1e-9 * (double)(now_ns - began_ns);
    study->poll_ns = now_ns + seconds_ns(fmax(study->poll_pause, fmin(5 * cost, poll_most)));
}

// --- what is sent ---

// Members beyond those that are expected may not be wanted.
static bool study_wants_chunk(const ClusterStudy *study, size_t chunk) {
    return study->run->is_sweep ||
           chunk_plan_member(&study->plan, chunk, 0) < atomic_load(&study->run->engine.expected);
}

// The chunks from `from` on that are to be sent with one array, at most `most`: "0-99,105" of their
// tasks. Returns how many; *end is behind the last.
static size_t study_choose(const ClusterStudy *study, size_t from, size_t most, size_t first,
                           size_t *end, Bytes *tasks) {
    const size_t beyond = first + study->cluster->facts.array_max;
    size_t count = 0, begin = 0, last = SIZE_MAX;
    size_t i = from;
    for (; i < study->plan.chunks && i < beyond && count < most && tasks->count < 7000; i++) {
        const ClusterChunk *chunk = &study->chunks[i];
        if (chunk->state != CHUNK_TO_DO || chunk->has_file || !study_wants_chunk(study, i))
            continue;
        if (last != SIZE_MAX && i == last + 1) {
            last = i;
        } else {
            if (last != SIZE_MAX)
                bytes_format(tasks, "%zu-%zu,", begin - first, last - first);
            begin = last = i;
        }
        count++;
    }
    if (last != SIZE_MAX)
        bytes_format(tasks, "%zu-%zu", begin - first, last - first);
    *end = i;
    return count;
}

// Slurm may have the job all the same: it is asked before the next.
static void study_refused(ClusterStudy *study, size_t live, size_t count, const Problem *problem) {
    study_explain(study, problem->detail);
    study->is_known = false;
    study->window = live + count / 2 > 0 ? live + count / 2 : 1;
    study->submit_ns = study->poll_ns = clock_monotonic_ns() + seconds_ns(study->submit_pause);
    study->submit_pause = fmin(2 * study->submit_pause, poll_most);
}

static void study_submit(ClusterStudy *study, Problem *problem) {
    Cluster *cluster = study->cluster;
    cluster_look(cluster);
    const size_t each = cluster->facts.array_max;
    const SlurmSettings slurm = cluster_slurm(cluster);
    const double seconds = study->run->task->queued.seconds / (double)study->plan.chunks;
    size_t live = 0;
    for (size_t i = study->first; i < study->plan.chunks; i++)
        live += study->chunks[i].state == CHUNK_SUBMITTED;
    for (size_t at = study->first, end; at < study->plan.chunks && live < study->window; at = end) {
        Bytes tasks = {0};
        const size_t first = at / each * each;
        const size_t count = study_choose(study, at, study->window - live, first, &end, &tasks);
        const SlurmArray array = {.name = study->name,
                                  .folder = study->folder,
                                  .program = cluster->program,
                                  .tasks = tasks.at,
                                  .first = first,
                                  .seconds = study->patience * seconds};
        Status status = STATUS_OK;
        if (count > 0)
            status = tasks.is_failed ? STATUS_NO_MEMORY : slurm_submit(&slurm, &array, problem);
        bytes_clear(&tasks);
        if (status != STATUS_OK) {
            study_refused(study, live, count, problem);
            return;
        }
        for (size_t i = at; count > 0 && i < end; i++)
            if (study->chunks[i].state == CHUNK_TO_DO && !study->chunks[i].has_file &&
                study_wants_chunk(study, i))
                study->chunks[i].state = CHUNK_SUBMITTED;
        live += count;
        if (count > 0) {
            study->submit_pause = study->poll_pause = cluster->settings->poll_seconds;
            study->poll_ns = clock_monotonic_ns() + seconds_ns(study->poll_pause);
        }
    }
    study->window =
        study->window < WINDOW_MOST ? study->window + 1 + study->window / 8 : WINDOW_MOST;
    study->submit_ns = clock_monotonic_ns() + seconds_ns(cluster->settings->poll_seconds);
}

// --- the thread ---

static bool study_is_at_end(const ClusterStudy *study) {
    return atomic_load(&study->run->engine.is_over) || atomic_load(&study->run->task->is_stopped);
}

static void study_step(ClusterStudy *study, Problem *problem) {
    int64_t now_ns = clock_monotonic_ns();
    problem_clear(problem);
    task_count_cpu();
    if (now_ns >= study->scan_ns)
        study_scan(study, problem);
    problem_clear(problem);
    now_ns = clock_monotonic_ns();
    if (now_ns >= study->poll_ns && !study_is_at_end(study))
        study_poll(study, problem);
    problem_clear(problem);
    if (study->is_known && now_ns >= study->submit_ns && !study_is_at_end(study) &&
        study_has_space(study))
        study_submit(study, problem);
}

// Cancels and deletes what is left of studies that no job wants any more. Names are taken away
// first, so that no worker writes there meanwhile. Returns whether anything is left.
static bool cluster_tidy_one(Cluster *cluster, const char *entry) {
    const char *shared = cluster->settings->shared, *end = strstr(entry, gone);
    JobManager *manager = cluster->manager;
    char path[PATH_MAX], away[PATH_MAX], name[NAME_SIZE], result[RESULT_SIZE + 1];
    snprintf(name, sizeof name, "%.*s", (int)(end != NULL ? end - entry : NAME_SIZE - 1), entry);
    snprintf(path, sizeof path, "%.3000s/%s", shared, name);
    snprintf(away, sizeof away, "%.3000s/%s%s", shared, name, gone);
    snprintf(result, sizeof result, "%.66s", name + sizeof prefix - 1);
    if (end == NULL) {
        pthread_mutex_lock(&cluster->folders);
        pthread_mutex_lock(&manager->lock);
        const bool is_wanted = manager->is_closing || hashmap_find(manager->tasks, result) != NULL;
        pthread_mutex_unlock(&manager->lock);
        const bool is_away = !is_wanted && rename(path, away) == 0;
        pthread_mutex_unlock(&cluster->folders);
        if (!is_away)
            return true;
    }
    SlurmTasks tasks = {NULL, 0};
    bool is_left = slurm_cancel(name, false, NULL) != STATUS_OK ||
                   slurm_tasks(name, &tasks, NULL) != STATUS_OK;
    // One that was about to start may have escaped.
    for (size_t i = 0; i < tasks.count; i++)
        is_left = is_left || tasks.at[i].state != SLURM_ENDED;
    free(tasks.at);
    if (!is_left)
        chunk_folder_remove(away);
    return is_left;
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
    cluster_look(cluster);
    pthread_mutex_lock(&manager->lock);
    while (!manager->is_closing || cluster->studies != NULL) {
        for (ClusterStudy **at = &cluster->studies; *at != NULL;) {
            ClusterStudy *study = *at;
            const bool is_over = study_is_at_end(study) || manager->is_closing;
            if (is_over)
                *at = study->next;
            pthread_mutex_unlock(&manager->lock);
            problem_clear(&problem);
            if (is_over)
                study_leave(&cluster->worker, study->run, &problem);
            else
                study_step(study, &problem);
            pthread_mutex_lock(&manager->lock);
            // Only this thread removes studies; new ones come before.
            at = is_over ? &cluster->studies : &study->next;
            if (is_over)
                cluster->tidy_ns = 0;
        }
        if (manager->is_closing)
            continue;
        pthread_mutex_unlock(&manager->lock);
        if (clock_monotonic_ns() >= cluster->tidy_ns)
            cluster_tidy(cluster);
        pthread_mutex_lock(&manager->lock);
        const bool is_idle = cluster->studies == NULL && cluster->tidy_ns == INT64_MAX;
        const int64_t end_ns = clock_monotonic_ns() + seconds_ns(is_idle ? poll_most : scan_least);
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

static void cluster_close(Cluster *cluster) {
    if (cluster == NULL)
        return;
    if (cluster->is_started)
        (void)pthread_join(cluster->thread, NULL);
    pthread_mutex_destroy(&cluster->folders);
    free(cluster);
}

static const StudyExecutor cluster_executor = {.wants = cluster_wants,
                                               .slots = cluster_slots,
                                               .prepare = cluster_prepare,
                                               .take = cluster_take,
                                               .view = cluster_view,
                                               .free = cluster_study_free,
                                               .close = cluster_close};

Status cluster_open(JobManager *manager, Problem *problem) {
    const ClusterSettings *settings = &manager->settings.cluster;
    Cluster *cluster = manager->cluster = calloc(1, sizeof *cluster);
    manager->executor = &cluster_executor;
    if (cluster == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the cluster's studies");
    cluster->manager = cluster->worker.manager = manager;
    cluster->settings = settings;
    cluster->facts.array_max = 1001;
    cluster_set_id(cluster);
    pthread_mutex_init(&cluster->folders, NULL);
    const ssize_t length =
        readlink("/proc/self/exe", cluster->program, sizeof cluster->program - 1);
    if (length <= 0)
        return problem_set(problem, STATUS_IO, "the path of this program is not known: %s",
                           strerror(errno));
    cluster->program[length] = '\0';
    if (pthread_create(&cluster->thread, NULL, cluster_main, cluster) != 0)
        return problem_set(problem, STATUS_INTERNAL, "the cluster's thread cannot be started");
    cluster->is_started = true;
    return STATUS_OK;
}
