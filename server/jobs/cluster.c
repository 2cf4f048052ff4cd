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
};
static const double scan_least = 0.2, scan_most = 2; // [s] between looks at the folder
static const double poll_most = 60;                  // [s] between questions to Slurm
static const double facts_each = 5;                  // [s]
static const double chunk_target = 60;               // [s] of CPU
static const double audit_share = 0.02;              // of the time since the study began

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
    char name[64], folder[PATH_MAX];
    ClusterChunk *chunks;
    size_t first;  // all before it are done
    size_t window; // tasks that Slurm takes at once, as far as is known
    bool is_known; // Slurm told what it has since the start
    bool is_full;  // there was no space for a chunk
    int64_t began_ns, scan_ns, poll_ns, submit_ns;
    double scan_pause, poll_pause, submit_pause, audit_seconds;
    // Under the manager's lock:
    size_t done, queued, running;
    char reason[240];
} ClusterStudy;

struct Cluster {
    JobManager *manager;
    const ClusterSettings *settings;
    char program[PATH_MAX];
    pthread_t thread;
    bool is_started;
    Worker worker;         // ends studies
    ClusterStudy *studies; // under the manager's lock
    SlurmFacts facts;      // of the thread alone
    int64_t facts_ns;
    atomic_size_t slots;
};

static SlurmSettings cluster_slurm(const Cluster *cluster) {
    return (SlurmSettings){cluster->settings->partition, &cluster->settings->options};
}

static int64_t seconds_ns(double seconds) {
    return (int64_t)(1e9 * seconds);
}

static void cluster_log(const ClusterStudy *study, const char *what) {
    Bytes line = {.most = 1024};
    bytes_format(&line, "the study %.20s on the cluster: %s", study->run->task->result, what);
    log_write(&line);
    bytes_clear(&line);
}

// What its readers see; "": nothing is wrong.
static bool study_set_reason(ClusterStudy *study, const char *reason) {
    JobManager *manager = study->cluster->manager;
    pthread_mutex_lock(&manager->lock);
    const bool is_new = strcmp(study->reason, reason) != 0;
    text_fit(study->reason, sizeof study->reason, reason);
    pthread_mutex_unlock(&manager->lock);
    return is_new;
}

// What went wrong, which is logged too.
static void study_explain(ClusterStudy *study, const char *reason) {
    if (study_set_reason(study, reason))
        cluster_log(study, reason);
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
    cluster->facts_ns = now_ns;
    if (slurm_facts(&slurm, &cluster->facts, NULL) == STATUS_OK && cluster->facts.slots > 0)
        atomic_store(&cluster->slots, cluster->facts.slots);
}

static size_t cluster_slots(const Cluster *cluster) {
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
    double chunks = fmax(ceil(task->queued.seconds / chunk_target), (double)(4 * slots));
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
                            .began_ns = clock_monotonic_ns(),
                            .scan_pause = scan_least,
                            .poll_pause = poll,
                            .submit_pause = poll};
    snprintf(study->name, sizeof study->name, "impactd-%.34s-%llu", run->task->result,
             (unsigned long long)run->sweep.retries);
    snprintf(study->folder, sizeof study->folder, "%.3000s/%s-%llu", settings->shared,
             run->task->result, (unsigned long long)run->sweep.retries);
    TRY(study_plan(study, cluster_slots(cluster), problem));
    TRY(chunk_folder_make(study->folder, &study->plan, &run->task->inquiry, run->manager->db,
                          &study->key, problem));
    study->chunks = calloc((size_t)study->plan.chunks, sizeof *study->chunks);
    if (study->chunks == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    if (run->is_sweep)
        for (size_t i = 0; i < study->plan.chunks; i++)
            study->chunks[i].state = CHUNK_DONE; // unless it is to be made
    for (SweepChunk *rows; (rows = run->chunks) != NULL;) {
        run->chunks = rows->next;
        study->chunks[rows->row.chunk] = (ClusterChunk){.rows = rows, .state = CHUNK_TO_DO};
    }
    for (size_t i = 0; i < study->plan.chunks; i++)
        study->done += study->chunks[i].state == CHUNK_DONE;
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
// give results that depend on where they were made. A run that failed is not tried.
static bool chunk_is_ours(ClusterStudy *study, size_t chunk, size_t place, const char *bytes,
                          size_t size) {
    StudyWork *work = study->run->work;
    const StudyTools tools = {.limits = work->limits,
                              .workspace = &study->cluster->worker.workspace};
    const int64_t began_ns = clock_thread_cpu_ns();
    StudyPart *part = NULL;
    Bytes own = {0};
    Problem problem = {.status = STATUS_OK};
    const size_t member = chunk_plan_member(&study->plan, chunk, place);
    bool is_same = true;
    if (study_part_make(work, member, &tools, &part, &problem) == STATUS_OK) {
        part_blob_write(&own, part);
        is_same = own.is_failed || (own.count == size && memcmp(own.at, bytes, size) == 0);
    }
    study_part_free(work, part);
    bytes_clear(&own);
    study->audit_seconds += 1e-9 * (double)(clock_thread_cpu_ns() - began_ns);
    return is_same;
}

static bool study_has_time_to_audit(const ClusterStudy *study) {
    const double passed = 1e-9 * (double)(clock_monotonic_ns() - study->began_ns);
    return study->audit_seconds <= audit_share * passed;
}

// Why the parts cannot be those of the chunk; NULL: they can.
static const char *chunk_audit(ClusterStudy *study, size_t chunk, ChunkFile *file) {
    const ChunkFile begin = *file;
    const size_t count = chunk_plan_count(&study->plan, chunk), audited = (chunk * 7919) % count;
    const char *bytes, *fault = NULL;
    size_t size;
    for (size_t place = 0; fault == NULL && chunk_next(file, &bytes, &size); place++) {
        StudyPart *part = part_blob_read(study->run->work, bytes, size);
        if (part == NULL)
            fault = "has a part that cannot be read";
        else if (place == audited && part->run.status == STATUS_OK &&
                 study_has_time_to_audit(study) && !chunk_is_ours(study, chunk, place, bytes, size))
            fault = "has other digits than this machine computes: give the cluster's machines the "
                    "same impactd, or choose others by --sbatch-option";
        study_part_free(study->run->work, part);
    }
    *file = begin;
    return fault;
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
        StudyPart *part = part_blob_read(run->work, bytes, size);
        if (part == NULL)
            return study_result(STATUS_NO_MEMORY, problem);
        if (!run->is_sweep) {
            if (atomic_load(&run->engine.is_over))
                study_part_free(run->work, part);
            else
                status = study_engine_fold(
                    &run->engine, chunk_plan_member(&study->plan, chunk, place), part, problem);
            continue;
        }
        sweep_chunk_put(run, of->rows, part);
        study_part_free(run->work, part);
    }
    if (status == STATUS_OK && run->is_sweep)
        status = sweep_chunk_save(run, of->rows, problem);
    if (status == STATUS_OK && run->is_sweep) {
        run->rows_made += of->rows->count;
        run->rows_failed += (size_t)of->rows->row.failed;
    }
    return status;
}

static void chunk_is_lost(ClusterStudy *study, ClusterChunk *chunk) {
    chunk->state = CHUNK_TO_DO;
    chunk->has_file = chunk->was_missing = false;
    chunk->attempts++;
    study->submit_ns = 0;
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
    const char *fault = status == STATUS_OK ? chunk_audit(study, chunk, &file) : NULL;
    if (fault != NULL)
        status = problem_set(problem, STATUS_INVALID, "chunk %zu %s", chunk, fault);
    if (status == STATUS_OK)
        status = chunk_fold(study, chunk, &file, problem);
    bytes_clear(&file.bytes);
    if (status == STATUS_NOT_FOUND || status == STATUS_INVALID) {
        study_explain(study, problem->detail);
        (void)unlink(path);
        chunk_is_lost(study, of);
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
        const unsigned long chunk = strtoul(entry->d_name, &end, 10);
        if (end != entry->d_name && *end == '\0' && chunk < study->plan.chunks)
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

// The end of what a chunk's worker printed.
static void chunk_log(const ClusterStudy *study, size_t chunk, char text[160]) {
    char path[PATH_MAX], tail[512] = "";
    snprintf(path, sizeof path, "%.3000s/log/%zu", study->folder,
             chunk % study->cluster->facts.array_max);
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

// No machine can make the chunk: its members are runs that failed.
static void chunk_give_up(ClusterStudy *study, size_t chunk, const char *end, Problem *problem) {
    const size_t count = chunk_plan_count(&study->plan, chunk);
    char why[240], printed[160];
    StudyPart part = {.run = {.status = STATUS_IO, .why = why, .steps = (double)NAN}};
    Bytes bytes = {0}, one = {0};
    chunk_log(study, chunk, printed);
    snprintf(why, sizeof why, "the cluster could not run it (%.60s)%s%.120s", end,
             printed[0] != '\0' ? ": " : "", printed);
    study_explain(study, why);
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

// A task of this chunk ended without a file that is seen here. The folder may show it late.
static void chunk_ended(ClusterStudy *study, size_t chunk, const SlurmTask *task,
                        Problem *problem) {
    ClusterChunk *of = &study->chunks[chunk];
    char end[120];
    if (!of->was_missing) {
        of->was_missing = true;
        return;
    }
    if (task == NULL)
        snprintf(end, sizeof end, "Slurm does not know it any more");
    else
        snprintf(end, sizeof end, "%.60s, exit code %d", task->reason, task->exit_code);
    if (task != NULL && task->exit_code == CHUNK_FULL) {
        of->state = CHUNK_TO_DO;
        study->is_full = true;
        study_explain(study, "the shared folder is full: the study continues when there is space");
        return;
    }
    chunk_is_lost(study, of);
    if (of->attempts >= ATTEMPTS || (task != NULL && task->exit_code == CHUNK_BAD))
        chunk_give_up(study, chunk, end, problem);
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
        if (last != NULL)
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
    (void)study_look(study);
    for (size_t i = study->first; i < study->plan.chunks; i++) {
        const ClusterChunk *chunk = &study->chunks[i];
        if (chunk->state == CHUNK_SUBMITTED && !chunk->is_live && !chunk->has_file)
            chunk_ended(study, i, last != NULL ? last[i] : NULL, problem);
    }
    free(last);
    pthread_mutex_lock(&manager->lock);
    const bool is_same = study->queued == queued && study->running == running;
    study->queued = queued;
    study->running = running;
    pthread_mutex_unlock(&manager->lock);
    if (running > 0) {
        (void)study_set_reason(study, "");
    } else if (queued > 0) {
        const SlurmFacts *facts = &study->cluster->facts;
        cluster_look(study->cluster);
        (void)study_set_reason(study, facts->reason[0] != '\0' ? facts->reason : reason);
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
    study->poll_ns = now_ns + seconds_ns(fmax(study->poll_pause, 5 * cost));
}

// --- what is sent ---

// Whether there is space again for chunks.
static bool study_has_space(ClusterStudy *study) {
    char path[PATH_MAX];
    Bytes bytes = {0};
    snprintf(path, sizeof path, "%.3000s/probe", study->folder);
    if (!study->is_full)
        return true;
    FILE *file = fopen(path, "we");
    bool is_written = file != NULL && bytes_reserve(&bytes, PROBE_BYTES);
    if (is_written) {
        memset(bytes.at, 1, PROBE_BYTES);
        is_written = fwrite(bytes.at, 1, PROBE_BYTES, file) == PROBE_BYTES;
    }
    is_written = file != NULL && fclose(file) == 0 && is_written;
    (void)unlink(path);
    bytes_clear(&bytes);
    study->is_full = !is_written;
    study->submit_ns = clock_monotonic_ns() + seconds_ns(study->cluster->settings->poll_seconds);
    return is_written;
}

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

static void study_refused(ClusterStudy *study, Status status, size_t count,
                          const Problem *problem) {
    study_explain(study, problem->detail);
    if (status == STATUS_TIMEOUT) { // it may have the job all the same
        study->is_known = false;
        study->poll_ns = 0;
    }
    study->window = count > 1 ? count / 2 : 1;
    study->submit_ns = clock_monotonic_ns() + seconds_ns(study->submit_pause);
    study->submit_pause = fmin(2 * study->submit_pause, poll_most);
}

static void study_submit(ClusterStudy *study, Problem *problem) {
    Cluster *cluster = study->cluster;
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
                                  .seconds = 3 * seconds};
        Status status = STATUS_OK;
        if (count > 0)
            status = tasks.is_failed ? STATUS_NO_MEMORY : slurm_submit(&slurm, &array, problem);
        bytes_clear(&tasks);
        if (status != STATUS_OK) {
            study_refused(study, status, count, problem);
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

// It is in no list any more. What runs for a study that is over is cancelled; a daemon that ends
// leaves it.
static void study_close(ClusterStudy *study, bool is_closing, Problem *problem) {
    Cluster *cluster = study->cluster;
    StudyRun *run = study->run;
    const bool is_stopped = atomic_load(&run->task->is_stopped);
    if (!is_closing || !is_stopped) {
        if (!study->is_known || study->queued + study->running > 0 ||
            study->done < study->plan.chunks)
            (void)slurm_cancel(study->name, false, NULL);
        chunk_folder_remove(study->folder);
    }
    problem_clear(problem);
    study_leave(&cluster->worker, run, problem);
}

static void *cluster_main(void *context) {
    Cluster *cluster = context;
    JobManager *manager = cluster->manager;
    Problem problem;
    cluster_look(cluster);
    pthread_mutex_lock(&manager->lock);
    while (!manager->is_closing || cluster->studies != NULL) {
        for (ClusterStudy **at = &cluster->studies; *at != NULL;) {
            ClusterStudy *study = *at;
            const bool is_closing = manager->is_closing;
            if (study_is_at_end(study) || is_closing) {
                *at = study->next;
                pthread_mutex_unlock(&manager->lock);
                study_close(study, is_closing, &problem);
                pthread_mutex_lock(&manager->lock);
                at = &cluster->studies; // others may have joined meanwhile
                continue;
            }
            pthread_mutex_unlock(&manager->lock);
            study_step(study, &problem);
            pthread_mutex_lock(&manager->lock);
            at = &study->next; // only this thread removes studies; new ones come before
        }
        const int64_t end_ns =
            clock_monotonic_ns() + seconds_ns(cluster->studies != NULL ? scan_least : poll_most);
        const struct timespec end = {(time_t)(end_ns / 1000000000), (long)(end_ns % 1000000000)};
        if (!manager->is_closing)
            (void)pthread_cond_timedwait(&manager->stopping, &manager->lock, &end);
    }
    pthread_mutex_unlock(&manager->lock);
    workspace_clear(&cluster->worker.workspace);
    return NULL;
}

static void cluster_close(Cluster *cluster) {
    if (cluster != NULL && cluster->is_started)
        (void)pthread_join(cluster->thread, NULL);
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
