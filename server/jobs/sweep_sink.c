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
    const StudyTools tools = {.limits = &worker->intake->settings.limits,
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
    Db *store = worker->intake->store;
    const Task *computation = run->computation;
    const SweepStudy *study = (const SweepStudy *)(const void *)computation->inquiry.study;
    const uint64_t points = run->work->members, metrics = study->metrics.count;
    const Status known = db_sweep_load(store, computation->result, &run->row, NULL);
    if (known != STATUS_OK && known != STATUS_NOT_FOUND)
        return problem_set(problem, known, "the sweeps could not be searched");
    if (known == STATUS_NOT_FOUND) {
        ExecutorLimits limits;
        double seconds = 0;
        TRY(run->executor->probe(worker->intake, &limits, problem));
        TRY(fly_pilot(worker, run, &seconds, problem));
        text_fit(run->row.result, sizeof run->row.result, computation->result);
        run->row.scene = strdup(computation->scene);
        if (run->row.scene == NULL)
            return no_memory(problem);
        run->row.metrics = metrics;
        run->row.points = points;
        run->row.chunks = executor_chunks(&limits, (size_t)points, seconds);
        run->row.created_unix_ms = clock_unix_ms();
    }
    // Also what is there: it may be on the way out, with the last job before this one.
    TRY(db_sweep_begin(store, &run->row, problem));
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
    pthread_mutex_lock(&run->intake->lock);
    set_left(run, left);
    pthread_mutex_unlock(&run->intake->lock);
    return count;
}

static Status rows_submit(StudyRun *run, Problem *problem) {
    SweepChunkRows there = {NULL, 0};
    TRY(db_sweep_chunks(run->intake->store, run->row.number, &there, problem));
    Chunk *chunks = calloc(run->row.chunks, sizeof *chunks);
    Status status = chunks != NULL ? STATUS_OK : no_memory(problem);
    if (status == STATUS_OK)
        status = run->executor->submit(run, chunks, list_missing(run, &there, chunks), problem);
    sweep_chunk_rows_clear(&there);
    free(chunks);
    return status;
}

// Room for the rows; those that are there already where only failed ones are made again.
static Status rows_begin(StudyRun *run, ChunkRun *shift, Problem *problem) {
    const size_t rows = shift->chunk.count, size = rows * sweep_row_size(&run->row);
    if (run->row.retries > 0) {
        const Status known = db_sweep_chunk(run->intake->store, run->row.number, shift->chunk.first,
                                            &shift->row, problem);
        shift->is_again = known == STATUS_OK && shift->row.rows.size == size;
        if (known != STATUS_OK && known != STATUS_NOT_FOUND)
            return known;
        problem_clear(problem);
    }
    if (!shift->is_again) {
        sweep_chunk_row_clear(&shift->row);
        shift->row.rows = (StoredBytes){calloc(rows, sweep_row_size(&run->row)), size};
    }
    free(shift->row.reasons);
    shift->row.reasons = NULL;
    shift->row.sweep = run->row.number;
    shift->row.chunk = shift->chunk.first;
    shift->row.failed = 0;
    shift->row.is_open = false;
    if (shift->row.rows.at == NULL)
        shift->row.rows.size = 0;
    return shift->row.rows.at == NULL ? no_memory(problem) : STATUS_OK;
}

static bool rows_has(const StudyRun *run, const ChunkRun *shift) {
    return shift->is_again && sweep_row_status(&run->row, &shift->row, shift->done) == SWEEP_MADE;
}

static void keep_reason(ChunkRun *shift, const char *why) {
    char line[REASON];
    if (shift->row.failed++ >= REASONS)
        return;
    text_fit(line, sizeof line, why);
    for (char *c = line; *c != '\0'; c++)
        if (*c == '\n')
            *c = ' ';
    bytes_format(&shift->reasons, "%zu %s\n", shift->done, line);
}

static Status rows_take(StudyRun *run, ChunkRun *shift, StudyPart *part, Problem *problem) {
    const SweepStudy *study = run->work->study;
    double values[SWEEP_METRICS];
    (void)problem;
    sweep_values(&study->metrics, &part->run, values);
    sweep_row_put(&run->row, &shift->row, shift->done, sweep_status(part->run.status), values);
    if (part->run.why != NULL) {
        keep_reason(shift, part->run.why);
        atomic_fetch_add(&run->rows_failed, 1);
    }
    atomic_fetch_add(&run->rows_done, 1);
    study_part_free(run->work, part);
    return STATUS_OK;
}

static Status rows_end(StudyRun *run, ChunkRun *shift, Problem *problem) {
    if (shift->reasons.count > 0 &&
        (shift->row.reasons = bytes_take(&shift->reasons, NULL)) == NULL)
        return no_memory(problem);
    TRY(db_sweep_take(run->intake->store, &shift->row, problem));
    pthread_mutex_lock(&run->intake->lock);
    set_left(run, run->left - 1);
    pthread_mutex_unlock(&run->intake->lock);
    return STATUS_OK;
}

static void rows_drop(ChunkRun *shift) {
    sweep_chunk_row_clear(&shift->row);
    bytes_clear(&shift->reasons);
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
