// A sweep's rows: what is to be done is written down before any of it runs, what the store has is
// done. Its chunk i holds the points i, i + chunks, i + 2 chunks ...
#include <stdlib.h>
#include <string.h>

#include "server/jobs/study_sink.h"
#include "server/jobs/sweep.h"
#include "server/util/clock.h"

enum { PILOT = 16 };
static const double pilot_seconds = 0.2;
enum { REASONS = 1000, REASON = 160 }; // kept of a chunk's failed rows, and bytes of one

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep");
}

// CPU that a point takes, about, by some of them [s].
static Status fly_pilot(Worker *worker, StudyRun *run, double *seconds, Problem *problem) {
    const Progress watch = {run, study_continues};
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    const size_t points = run->work->members, most = points < PILOT ? points : PILOT;
    const int64_t began_ns = clock_thread_cpu_ns();
    Status status = STATUS_OK;
    size_t made = 0;
    while (made < most && status == STATUS_OK) {
        StudyPart *part = NULL;
        status = study_part_make(run->work, (points - 1) * made / (most > 1 ? most - 1 : 1), &tools,
                                 &part, problem);
        study_part_free(run->work, part);
        made++;
        *seconds = 1e-9 * (double)(clock_thread_cpu_ns() - began_ns) / (double)made;
        if (*seconds * (double)made > pilot_seconds)
            break;
    }
    return status;
}

// Intent is durable before anything runs; an earlier one stands.
static Status rows_open(Worker *worker, StudyRun *run, Problem *problem) {
    Db *db = worker->manager->db;
    const Task *task = run->task;
    const SweepStudy *study = (const SweepStudy *)(const void *)task->inquiry.study;
    const uint64_t points = run->work->members, metrics = study->metrics.count;
    const Status known = db_sweep_load(db, task->result, &run->row, NULL);
    if (known != STATUS_OK && known != STATUS_NOT_FOUND)
        return problem_set(problem, known, "the sweeps could not be searched");
    if (known == STATUS_NOT_FOUND) {
        ExecutorLimits limits;
        double seconds = 0;
        TRY(run->executor->probe(worker->manager, &limits, problem));
        TRY(fly_pilot(worker, run, &seconds, problem));
        text_fit(run->row.result, sizeof run->row.result, task->result);
        run->row.scene = strdup(task->scene);
        if (run->row.scene == NULL)
            return no_memory(problem);
        run->row.metrics = metrics;
        run->row.points = points;
        run->row.chunks = executor_chunks(&limits, (size_t)points, seconds);
        run->row.created_unix_ms = clock_unix_ms();
    }
    // Also what is there: it may be on the way out, with the last job before this one.
    TRY(db_sweep_begin(db, &run->row, problem));
    if (run->row.points != points || run->row.metrics != metrics)
        return problem_set(problem, STATUS_INTERNAL,
                           "the stored sweep no longer stands for this scene");
    return STATUS_OK;
}

// With the lock held.
static void set_left(StudyRun *run, size_t left) {
    run->left = left;
    if (left == 0)
        atomic_store(&run->is_over, true);
}

static Chunk chunk_of(const SweepRow *row, size_t index) {
    return chunk_deal(0, (size_t)row->points, (size_t)row->chunks, index);
}

// Chunks that the store has not and that nobody is at. `chunks` has room for all.
static size_t list_missing(StudyRun *run, const SweepChunkRows *there, Chunk *chunks) {
    size_t count = 0, next = 0, left = 0;
    for (size_t i = 0; i < run->row.chunks; i++) {
        const SweepChunkRow *row =
            next < there->count && there->at[next].chunk == i ? &there->at[next++] : NULL;
        const Chunk chunk = chunk_of(&run->row, i);
        if (row != NULL) {
            const size_t done = row->is_open ? chunk.count - (size_t)row->failed : chunk.count;
            atomic_fetch_add(&run->rows_done, done);
            atomic_fetch_add(&run->rows_failed, row->is_open ? 0 : (size_t)row->failed);
            study_count(run, done);
        }
        if (row != NULL && !row->is_open)
            continue;
        left++;
        if (run->executor->poll(run, &chunk) == CHUNK_DEAD)
            chunks[count++] = chunk;
    }
    pthread_mutex_lock(&run->manager->lock);
    set_left(run, left);
    pthread_mutex_unlock(&run->manager->lock);
    return count;
}

static Status rows_submit(StudyRun *run, Problem *problem) {
    SweepChunkRows there = {NULL, 0};
    TRY(db_sweep_chunks(run->manager->db, run->row.number, &there, problem));
    Chunk *chunks = calloc(run->row.chunks, sizeof *chunks);
    Status status = chunks != NULL ? STATUS_OK : no_memory(problem);
    if (status == STATUS_OK)
        status = run->executor->submit(run, chunks, list_missing(run, &there, chunks), problem);
    sweep_chunk_rows_clear(&there);
    free(chunks);
    return status;
}

// Room for the rows; those that are there already where only failed ones are made again.
static Status rows_begin(StudyRun *run, ChunkRun *chunk_run, Problem *problem) {
    const size_t rows = chunk_run->chunk.count, size = rows * sweep_row_size(&run->row);
    if (run->row.retries > 0) {
        const Status known = db_sweep_chunk(run->manager->db, run->row.number,
                                            chunk_run->chunk.first, &chunk_run->row, problem);
        chunk_run->recompute_only = known == STATUS_OK && chunk_run->row.rows.size == size;
        if (known != STATUS_OK && known != STATUS_NOT_FOUND)
            return known;
        problem_clear(problem);
    }
    if (!chunk_run->recompute_only) {
        sweep_chunk_row_clear(&chunk_run->row);
        chunk_run->row.rows = (StoredBytes){calloc(rows, sweep_row_size(&run->row)), size};
    }
    free(chunk_run->row.reasons);
    chunk_run->row.reasons = NULL;
    chunk_run->row.sweep = run->row.number;
    chunk_run->row.chunk = chunk_run->chunk.first;
    chunk_run->row.failed = 0;
    chunk_run->row.is_open = false;
    if (chunk_run->row.rows.at == NULL)
        chunk_run->row.rows.size = 0;
    return chunk_run->row.rows.at == NULL ? no_memory(problem) : STATUS_OK;
}

static bool rows_has(const StudyRun *run, const ChunkRun *chunk_run) {
    return chunk_run->recompute_only &&
           sweep_row_status(&run->row, &chunk_run->row, chunk_run->done) == SWEEP_MADE;
}

static void keep_reason(ChunkRun *chunk_run, const char *why) {
    char line[REASON];
    if (chunk_run->row.failed++ >= REASONS)
        return;
    text_fit(line, sizeof line, why);
    for (char *c = line; *c != '\0'; c++)
        if (*c == '\n')
            *c = ' ';
    bytes_format(&chunk_run->reasons, "%zu %s\n", chunk_run->done, line);
}

static Status rows_take(StudyRun *run, ChunkRun *chunk_run, StudyPart *part, Problem *problem) {
    const SweepStudy *study = run->work->study;
    double values[SWEEP_METRICS];
    (void)problem;
    sweep_values(&study->metrics, &part->run, values);
    sweep_row_put(&run->row, &chunk_run->row, chunk_run->done, sweep_status(part->run.status),
                  values);
    if (part->run.why != NULL) {
        keep_reason(chunk_run, part->run.why);
        atomic_fetch_add(&run->rows_failed, 1);
    }
    atomic_fetch_add(&run->rows_done, 1);
    study_part_free(run->work, part);
    return STATUS_OK;
}

static Status rows_end(StudyRun *run, ChunkRun *chunk_run, Problem *problem) {
    if (chunk_run->reasons.count > 0 &&
        (chunk_run->row.reasons = bytes_take(&chunk_run->reasons, NULL)) == NULL)
        return no_memory(problem);
    TRY(db_sweep_take(run->manager->db, &chunk_run->row, problem));
    pthread_mutex_lock(&run->manager->lock);
    set_left(run, run->left - 1);
    pthread_mutex_unlock(&run->manager->lock);
    return STATUS_OK;
}

static void rows_drop(ChunkRun *chunk_run) {
    sweep_chunk_row_clear(&chunk_run->row);
    bytes_clear(&chunk_run->reasons);
}

static void rows_free(StudyRun *run) {
    sweep_row_clear(&run->row);
}

const StudySink gather_rows = {
    .is_kept = true,
    .open = rows_open,
    .submit = rows_submit,
    .begin = rows_begin,
    .has = rows_has,
    .take = rows_take,
    .end = rows_end,
    .drop = rows_drop,
    .free = rows_free,
};
