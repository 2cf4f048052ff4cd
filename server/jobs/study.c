// Studies, made by several threads. Members are folded in their order, so that the answer has the
// same bytes for any number of threads. In the daemon:
//
//     a worker:    runs the scene, begins the study (a sweep's chunks are written down)
//     any worker:  takes a turn: makes members until the turn is over and other work waits
//     the last:    ends it: result and jobs, as of any task
//
// As long as there are members to be made, one turn of the study stands in the queue: the worker
// that takes it puts the next one behind the turns of others. A sweep whose rows the database
// cannot take is paused: the chunk waits in memory and is tried again.
#include "server/jobs/study.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/util/clock.h"
#include "server/util/process.h"

enum {
    WINDOW_BYTES = 32 << 20,
    WINDOW_PER_SLOT = 8,
    THREADS_MAX = 256,
    MILLION = 1000000,
    TURN_MS = 10,      // at least, of a turn
    LOOK_MS = 1,       // how often a turn looks whether other work waits
    CHUNKS_MAX = 4096, // unless one would have more rows than
    CHUNK_ROWS = 1 << 16,
    CHUNK_BYTES = 64 << 20, // of a file
    CHUNKS_PER_SLOT = 4,    // at least
    REASONS = 1000,         // kept of the failed rows of a chunk
    REASON_BYTES = 160,
};
// Short chunks let rows appear soon, and little is lost when the daemon is killed. On a cluster
// each has costs of its own.
static const double chunk_seconds = 0.25, cluster_chunk_seconds = 120;

Status study_engine_open(StudyEngine *engine, StudyWork *work, const SimulationLimits *limits,
                         const Progress *progress, size_t slots, Problem *problem) {
    const size_t by_bytes = WINDOW_BYTES / (work->part_bytes + 1);
    const size_t by_slots = WINDOW_PER_SLOT * slots;
    const size_t window = by_bytes > by_slots ? by_bytes : by_slots;
    *engine = (StudyEngine){.work = work,
                            .limits = limits,
                            .progress = *progress,
                            .window = window < work->members ? window : work->members + 1,
                            .wanted = work->wanted};
    atomic_store(&engine->expected, work->expected);
    atomic_store(&engine->is_over, work->wanted == 0);
    pthread_mutex_init(&engine->lock, NULL);
    pthread_cond_init(&engine->changed, NULL);
    if (slots == 0)
        return STATUS_OK;
    engine->parts = calloc(engine->window, sizeof *engine->parts);
    return study_result(status_made(engine->parts != NULL), problem);
}

void study_engine_close(StudyEngine *engine) {
    if (engine->work == NULL)
        return;
    for (size_t i = 0; engine->parts != NULL && i < engine->window; i++)
        study_part_free(engine->work, engine->parts[i]);
    free(engine->parts);
    pthread_cond_destroy(&engine->changed);
    pthread_mutex_destroy(&engine->lock);
}

// With the lock held.
static bool study_engine_is_open(const StudyEngine *engine) {
    const size_t room = engine->folded + engine->window;
    return !atomic_load(&engine->is_over) &&
           engine->begun < (engine->wanted < room ? engine->wanted : room);
}

bool study_engine_has_next(StudyEngine *engine) {
    pthread_mutex_lock(&engine->lock);
    const bool is_open = study_engine_is_open(engine);
    pthread_mutex_unlock(&engine->lock);
    return is_open;
}

bool study_engine_next(StudyEngine *engine, bool may_wait, size_t *member) {
    pthread_mutex_lock(&engine->lock);
    while (may_wait && !study_engine_is_open(engine) && !atomic_load(&engine->is_over))
        pthread_cond_wait(&engine->changed, &engine->lock);
    const bool is_open = study_engine_is_open(engine);
    *member = engine->begun;
    engine->begun += is_open;
    pthread_mutex_unlock(&engine->lock);
    return is_open;
}

static void study_engine_stop(StudyEngine *engine) {
    pthread_mutex_lock(&engine->lock);
    atomic_store(&engine->is_over, true);
    pthread_cond_broadcast(&engine->changed);
    pthread_mutex_unlock(&engine->lock);
}

// Reports progress; false: the study is over or its progress requests a stop.
static bool study_engine_continues(StudyEngine *engine) {
    const double expected = MILLION * (double)atomic_load(&engine->expected);
    const double share = fmin((double)atomic_load(&engine->millionths) / fmax(expected, 1), 1);
    return progress_advance(&engine->progress, share) && !atomic_load(&engine->is_over);
}

// A member that is being made.
typedef struct MemberProgress {
    StudyEngine *engine;
    uint_fast64_t counted; // millionths of it
} MemberProgress;

static bool study_engine_advance(void *context, double fraction) {
    MemberProgress *member = context;
    const uint_fast64_t done = (uint_fast64_t)(MILLION * fmax(0, fmin(fraction, 1)));
    if (done > member->counted) {
        atomic_fetch_add(&member->engine->millionths, done - member->counted);
        member->counted = done;
    }
    return study_engine_continues(member->engine);
}

void study_engine_count(StudyEngine *engine, size_t members) {
    atomic_fetch_add(&engine->millionths, (uint_fast64_t)members * MILLION);
    (void)study_engine_continues(engine);
}

// Makes a member. The part is freed by study_part_free in any case.
static Status study_engine_part(StudyEngine *engine, size_t member, Workspace *workspace,
                                StudyPart **part, Problem *problem) {
    MemberProgress made = {engine, 0};
    const Progress watch = {&made, study_engine_advance};
    const StudyTools tools = {.limits = engine->limits, .progress = &watch, .workspace = workspace};
    TRY(study_part_make(engine->work, member, &tools, part, problem));
    (void)study_engine_advance(&made, 1);
    return STATUS_OK;
}

// With the lock held, which is released while a part is folded: no other thread folds meanwhile.
static Status study_engine_fold_all(StudyEngine *engine, Problem *problem) {
    Status status = STATUS_OK;
    engine->is_folding = true;
    while (status == STATUS_OK && engine->folded < engine->wanted) {
        StudyPart **place = &engine->parts[engine->folded % engine->window], *part = *place;
        if (part == NULL)
            break;
        *place = NULL;
        pthread_mutex_unlock(&engine->lock);
        status = study_part_fold(engine->work, engine->folded, part, problem);
        study_part_free(engine->work, part);
        pthread_mutex_lock(&engine->lock);
        engine->folded++;
        // The fold may have changed what is wanted.
        engine->wanted = engine->work->wanted;
        atomic_store(&engine->expected, engine->work->expected);
        if (engine->folded >= engine->wanted)
            atomic_store(&engine->is_over, true);
        pthread_cond_broadcast(&engine->changed);
    }
    engine->is_folding = false;
    return status;
}

Status study_engine_fold(StudyEngine *engine, size_t member, StudyPart *part, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&engine->lock);
    engine->parts[member % engine->window] = part;
    if (!engine->is_folding && member == engine->folded)
        status = study_engine_fold_all(engine, problem);
    pthread_mutex_unlock(&engine->lock);
    return status;
}

// Makes a member and folds it. An error ends the study: the caller stops it.
static Status study_engine_make(StudyEngine *engine, size_t member, Workspace *workspace,
                                Problem *problem) {
    StudyPart *part = NULL;
    const Status status = study_engine_part(engine, member, workspace, &part, problem);
    if (status == STATUS_OK)
        return study_engine_fold(engine, member, part, problem);
    study_part_free(engine->work, part);
    return status;
}

// The task's progress, which never decreases. False: the task was stopped.
static bool study_advance_task(void *context, double fraction) {
    static const double begun = STUDY_OWN + (1 - STUDY_OWN) * STUDY_BEGUN;
    Task *task = context;
    const unsigned reached = (unsigned)(1e4 * (begun + (1 - begun) * fraction));
    unsigned last = atomic_load(&task->progress);
    while (last < reached && !atomic_compare_exchange_weak(&task->progress, &last, reached))
        ;
    return task_is_wanted(task, fraction);
}

static bool study_is_over(StudyRun *run) {
    return atomic_load(&run->engine.is_over) || atomic_load(&run->task->is_stopped);
}

size_t study_count_chunks(const StudyRun *run, size_t slots) {
    const double all = (double)run->work->members;
    const double each = run->is_clustered ? cluster_chunk_seconds : chunk_seconds;
    double chunks = fmin(ceil(run->task->queued.seconds / each), CHUNKS_MAX);
    chunks = fmax(chunks, ceil(all / CHUNK_ROWS));
    if (run->is_clustered && !run->is_sweep)
        chunks = fmax(chunks, ceil(all * (double)run->work->part_bytes / CHUNK_BYTES));
    chunks = fmax(chunks, (double)(CHUNKS_PER_SLOT * slots));
    chunks = ceil(chunks / (double)slots) * (double)slots; // all slots are busy to the end
    chunks = fmin(chunks, all);
    return (size_t)(run->is_sweep ? chunks : ceil(all / ceil(all / chunks))); // that have members
}

// What is to be done is durable before anything runs; what was written down before stays.
static Status sweep_begin(StudyRun *run, size_t slots, Problem *problem) {
    const StudyWork *work = run->work;
    const char *result = run->task->result;
    SweepRow *row = &run->sweep;
    Db *db = run->manager->db;
    const uint64_t points = work->members;
    const uint64_t metrics = ((const SweepStudy *)work->study)->metrics.count;
    const Status found = db_sweep_load(db, result, row, NULL);
    if (found != STATUS_OK && found != STATUS_NOT_FOUND)
        return problem_set(problem, found, "the sweeps could not be searched");
    if (found == STATUS_NOT_FOUND) {
        text_fit(row->result, sizeof row->result, result);
        row->scene = strdup(run->task->scene);
        if (row->scene == NULL)
            return study_result(STATUS_NO_MEMORY, problem);
        row->metrics = metrics;
        row->points = points;
        row->chunks = study_count_chunks(run, slots);
        row->created_unix_ms = clock_unix_ms();
    }
    // Also a row that is there: it may be about to be deleted with the last job before this one.
    TRY(db_sweep_begin(db, row, problem));
    if (row->points != points || row->metrics != metrics)
        return problem_set(problem, STATUS_INTERNAL,
                           "the stored sweep no longer belongs to this scene");
    return STATUS_OK;
}

// The chunks that the database does not have, or that are open.
static Status sweep_list(StudyRun *run, const SweepChunkRows *saved, Problem *problem) {
    size_t next = saved->count;
    for (size_t i = run->sweep.chunks; i-- > 0;) {
        const SweepChunkRow *row =
            next > 0 && saved->at[next - 1].chunk == i ? &saved->at[--next] : NULL;
        const size_t count = sweep_rows_of(&run->sweep, i);
        if (row != NULL) {
            // A cluster makes all rows of an open chunk again.
            const size_t made = !row->is_open       ? count
                                : run->is_clustered ? 0
                                                    : count - (size_t)row->failed;
            run->rows_made += made;
            run->rows_failed += row->is_open ? 0 : (size_t)row->failed;
            atomic_fetch_add(&run->engine.millionths, (uint_fast64_t)made * MILLION);
        }
        if (row != NULL && !row->is_open)
            continue;
        SweepChunk *chunk = calloc(1, sizeof *chunk);
        if (chunk == NULL)
            return study_result(STATUS_NO_MEMORY, problem);
        chunk->count = count;
        chunk->row.sweep = run->sweep.number;
        chunk->row.chunk = i;
        chunk->next = run->chunks;
        run->chunks = chunk;
        run->chunks_left++;
    }
    if (run->chunks_left == 0)
        study_engine_stop(&run->engine);
    return STATUS_OK;
}

// The sweep as it was begun before, or cut into chunks by its predicted cost. What is to be
// done is in the database before any of it runs, and what the database has is done.
static Status sweep_open(StudyRun *run, size_t slots, Problem *problem) {
    SweepChunkRows saved = {NULL, 0};
    TRY(sweep_begin(run, slots, problem));
    TRY(db_sweep_chunks(run->manager->db, run->sweep.number, &saved, problem));
    const Status status = sweep_list(run, &saved, problem);
    sweep_chunk_rows_clear(&saved);
    return status;
}

void sweep_chunk_free(SweepChunk *chunk) {
    if (chunk == NULL)
        return;
    sweep_chunk_row_clear(&chunk->row);
    bytes_clear(&chunk->reasons);
    free(chunk);
}

static Status sweep_chunk_load(StudyRun *run, SweepChunk *chunk, Problem *problem) {
    const size_t size = chunk->count * sweep_row_size(&run->sweep);
    SweepChunkRow saved = {0};
    if (chunk->is_loaded)
        return STATUS_OK;
    if (run->sweep.retries > 0) {
        const Status found =
            db_sweep_chunk(run->manager->db, run->sweep.number, chunk->row.chunk, &saved, problem);
        if (found != STATUS_OK && found != STATUS_NOT_FOUND)
            return found;
        problem_clear(problem);
    }
    chunk->is_retry = saved.rows.at != NULL && saved.rows.size == size;
    chunk->row.rows = chunk->is_retry ? saved.rows : (StoredBytes){calloc(1, size), size};
    if (chunk->is_retry)
        saved.rows = (StoredBytes){NULL, 0};
    sweep_chunk_row_clear(&saved);
    chunk->is_loaded = chunk->row.rows.at != NULL;
    return study_result(status_made(chunk->is_loaded), problem);
}

static void sweep_chunk_add_reason(SweepChunk *chunk, const char *why) {
    char line[REASON_BYTES];
    if (chunk->row.failed++ >= REASONS)
        return;
    text_fit(line, sizeof line, why);
    for (char *c = line; *c != '\0'; c++)
        if (*c == '\n')
            *c = ' ';
    bytes_format(&chunk->reasons, "%zu %s\n", chunk->done, line);
}

void sweep_chunk_put(const StudyRun *run, SweepChunk *chunk, const StudyPart *part) {
    double values[SWEEP_METRICS];
    sweep_values(&((const SweepStudy *)run->work->study)->metrics, &part->run, values);
    sweep_row_put(&run->sweep, &chunk->row, chunk->done, sweep_status(part->run.status), values);
    if (part->run.why != NULL)
        sweep_chunk_add_reason(chunk, part->run.why);
    chunk->done++;
}

Status sweep_chunk_restart(StudyRun *run, SweepChunk *chunk, Problem *problem) {
    TRY(sweep_chunk_load(run, chunk, problem));
    bytes_clear(&chunk->reasons);
    free(chunk->row.reasons);
    chunk->row.reasons = NULL;
    chunk->row.failed = 0;
    chunk->done = 0;
    return STATUS_OK;
}

static Status sweep_chunk_make(StudyRun *run, SweepChunk *chunk, Workspace *workspace,
                               Problem *problem) {
    double values[SWEEP_METRICS];
    StudyPart *part = NULL;
    if (chunk->is_retry &&
        sweep_row_get(&run->sweep, &chunk->row, chunk->done, values) == SWEEP_MADE) {
        chunk->done++;
        return STATUS_OK;
    }
    const size_t point = (size_t)(chunk->row.chunk + chunk->done * run->sweep.chunks);
    const Status status = study_engine_part(&run->engine, point, workspace, &part, problem);
    if (status == STATUS_OK) {
        sweep_chunk_put(run, chunk, part);
        run->rows_failed += part->run.why != NULL;
        run->rows_made++;
    }
    study_part_free(run->work, part);
    return status;
}

Status sweep_chunk_save(StudyRun *run, SweepChunk *chunk, Problem *problem) {
    if (chunk->reasons.count > 0 &&
        (chunk->row.reasons = bytes_take(&chunk->reasons, NULL)) == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    TRY(db_sweep_take(run->manager->db, &chunk->row, problem));
    chunk->is_saved = true;
    if (atomic_fetch_sub(&run->chunks_left, 1) == 1)
        study_engine_stop(&run->engine);
    return STATUS_OK;
}

void study_run_free(StudyRun *run) {
    if (run == NULL)
        return;
    for (SweepChunk *chunk; (chunk = run->chunks) != NULL;) {
        run->chunks = chunk->next;
        sweep_chunk_free(chunk);
    }
    if (run->is_clustered)
        run->manager->executor->free(run->cluster);
    sweep_row_clear(&run->sweep);
    study_engine_close(&run->engine);
    study_free(run->work);
    run_result_clear(&run->run_result);
    free(run);
}

// With the lock held: the next turn is in the queue if there is something to do.
static void study_enqueue(StudyRun *run) {
    QueueEntry *entry = &run->task->queued;
    const bool has_work = run->is_sweep ? run->chunks != NULL : study_engine_has_next(&run->engine);
    if (entry->number != 0 || !has_work || run->task->is_waiting || run->is_clustered)
        return;
    entry->is_turn = true;
    entry->seconds = fmax(run->member_seconds, 1e-3 * TURN_MS);
    entry->charge = 0;
    QueueClient *client = run->task->jobs != NULL ? run->task->jobs->client : entry->client;
    queue_put(run->manager->queue, entry, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(run->manager);
}

void jobs_call_waiting(JobManager *manager) {
    while (manager->waiting != NULL) {
        Task *task = manager->waiting;
        task_unwait(task);
        if (task->is_saving) {
            commit_continue(task);
        } else if (task->study != NULL) {
            study_enqueue(task->study);
        } else {
            queue_push_front(manager->queue, &task->queued);
            jobs_call_worker(manager);
        }
    }
}

void task_end(Task *task) {
    JobManager *manager = task->manager;
    if (!task->has_memory)
        return;
    task->has_memory = false;
    manager->memory -= task->bytes;
    jobs_call_waiting(manager);
}

static Status study_open(Worker *worker, StudyRun *run, StudyAnswer *answer, Problem *problem) {
    JobManager *manager = worker->manager;
    const JobManagerSettings *settings = &manager->settings;
    const StudyRequest *inquiry = &run->task->inquiry;
    ProgressRange range = {&(Progress){run->task, task_advance}, STUDY_OWN, 1 - STUDY_OWN, 0};
    const Progress begin = progress_range_view(&range);
    const Progress members = {run->task, study_advance_task};
    const StudyTools tools = {
        .limits = &settings->limits, .progress = &begin, .workspace = &worker->workspace};
    const StudyKind *kind = study_kind(inquiry->study);
    const StudyExecutor *executor = manager->executor;
    const size_t slots =
        executor != NULL ? executor->slots(manager->cluster, kind, run->task->queued.seconds) : 0;
    run->is_sweep = kind == &study_sweep;
    run->is_clustered = slots > 0;
    TRY(study_begin(inquiry->study, &inquiry->simulation, &tools, &answer->study, &run->work,
                    problem));
    TRY(study_engine_open(&run->engine, run->work, &settings->limits, &members,
                          run->is_sweep ? 0 : settings->workers, problem));
    if (run->is_sweep)
        TRY(sweep_open(run, run->is_clustered ? slots : settings->workers, problem));
    return run->is_clustered ? executor->prepare(run, slots, problem) : STATUS_OK;
}

Status study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
    JobManager *manager = worker->manager;
    StudyRun *run = calloc(1, sizeof *run);
    if (run == NULL)
        return study_result(STATUS_NO_MEMORY, problem);
    const int64_t began_ns = clock_thread_cpu_ns();
    run->manager = manager;
    run->task = task;
    const Status status = study_open(worker, run, &run_result->answer, problem);
    job_metrics_study(&manager->metrics, true, clock_thread_cpu_ns() - began_ns);
    if (status != STATUS_OK) {
        study_run_free(run);
        return status;
    }
    run->run_result = *run_result;
    *run_result = (RunResult){0};
    pthread_mutex_lock(&manager->lock);
    task->study = run;
    run->next = manager->studies;
    manager->studies = run;
    if (run->is_clustered)
        manager->executor->take(run);
    study_enqueue(run);
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

// With the lock held: ends a turn. True: the study is over and this was its last turn; it is in no
// list any more, and the caller ends it.
static bool study_release(StudyRun *run) {
    JobManager *manager = run->manager;
    if (!study_is_over(run) || run->task->workers > 1) {
        run->task->workers--;
        return false;
    }
    queue_remove(manager->queue, &run->task->queued);
    task_unwait(run->task);
    task_end(run->task);
    StudyRun **at = &manager->studies;
    while (*at != run)
        at = &(*at)->next;
    *at = run->next;
    return true;
}

bool study_take(StudyRun *run, StudyTurn *turn) {
    *turn = (StudyTurn){.run = run};
    run->task->workers++;
    if (study_is_over(run)) {
        turn->is_end = study_release(run);
        return turn->is_end;
    }
    bool is_taken;
    if (run->is_sweep) {
        is_taken = (turn->chunk = run->chunks) != NULL;
        run->chunks = is_taken ? turn->chunk->next : NULL;
    } else {
        is_taken = study_engine_next(&run->engine, false, &turn->member);
    }
    study_enqueue(run);
    if (!is_taken)
        run->task->workers--;
    return is_taken;
}

typedef struct TurnClock {
    int64_t began_ns, looked_ns;
    size_t made; // members
} TurnClock;

// Between two members: whether the turn is over and other work waits. If there is more to do, other
// workers join.
static bool study_must_yield(StudyRun *run, TurnClock *clock) {
    JobManager *manager = run->manager;
    const int64_t now_ns = clock_monotonic_ns();
    if (now_ns - clock->looked_ns < (int64_t)LOOK_MS * 1000000)
        return false;
    clock->looked_ns = now_ns;
    pthread_mutex_lock(&manager->lock);
    study_enqueue(run);
    const size_t own = run->task->queued.number != 0;
    const bool is_wanted = queue_count(manager->queue) > own || manager->is_closing;
    pthread_mutex_unlock(&manager->lock);
    return is_wanted && now_ns - clock->began_ns >= (int64_t)TURN_MS * 1000000;
}

static Status study_make_members(Worker *worker, const StudyTurn *turn, TurnClock *clock,
                                 Problem *problem) {
    StudyEngine *engine = &turn->run->engine;
    size_t member = turn->member;
    do {
        TRY(study_engine_make(engine, member, &worker->workspace, problem));
        clock->made++;
    } while (!study_must_yield(turn->run, clock) && study_engine_next(engine, false, &member));
    return STATUS_OK;
}

static Status study_make_rows(Worker *worker, const StudyTurn *turn, TurnClock *clock,
                              Problem *problem) {
    StudyRun *run = turn->run;
    SweepChunk *chunk = turn->chunk;
    TRY(sweep_chunk_load(run, chunk, problem));
    for (; chunk->done < chunk->count; clock->made++) {
        if (clock->made > 0 && study_must_yield(run, clock))
            return STATUS_OK;
        if (!study_engine_continues(&run->engine))
            return STATUS_CANCELLED;
        TRY(sweep_chunk_make(run, chunk, &worker->workspace, problem));
    }
    return sweep_chunk_save(run, chunk, problem);
}

// With the lock held.
static void study_fail(StudyRun *run, Status status, Problem *problem) {
    if (run->is_failed)
        return;
    run->is_failed = true;
    study_engine_stop(&run->engine);
    run_result_fail(&run->run_result, status, problem);
}

void study_run_fail(StudyRun *run, Status status, Problem *problem) {
    pthread_mutex_lock(&run->manager->lock);
    study_fail(run, status, problem);
    pthread_mutex_unlock(&run->manager->lock);
}

// With the lock held.
static void study_pause(StudyRun *run, const Problem *problem) {
    if (!run->is_pause_logged) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the sweep %s pauses: %s", run->task->result, problem->detail);
        log_write(&line);
        bytes_clear(&line);
    }
    run->is_pause_logged = true;
    task_wait(run->task);
    queue_remove(run->manager->queue, &run->task->queued);
}

static Status study_complete(Worker *worker, StudyRun *run, Problem *problem) {
    const Progress watch = {run->task, task_is_wanted};
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    problem_clear(problem);
    if (!run->is_sweep)
        TRY(study_end(run->work, &tools, problem));
    return run_result_add_to_study(&run->run_result, problem);
}

// Ends a study that is in no list any more: successful, failed or abandoned.
static void study_finish(Worker *worker, StudyRun *run, Problem *problem) {
    JobManager *manager = run->manager;
    Task *task = run->task;
    if (!run->is_failed && !atomic_load(&task->is_stopped)) {
        const int64_t began_ns = clock_thread_cpu_ns();
        task_count_cpu();
        const Status status = task_result(task, study_complete(worker, run, problem), problem);
        job_metrics_study(&manager->metrics, false, clock_thread_cpu_ns() - began_ns);
        if (status != STATUS_OK)
            run_result_fail(&run->run_result, status, problem);
    }
    RunResult run_result = run->run_result;
    const bool has_rows = run->is_sweep, is_stopped = atomic_load(&task->is_stopped);
    run_result.ended_ns = clock_monotonic_ns();
    run->run_result = (RunResult){0};
    pthread_mutex_lock(&manager->lock);
    task->study = NULL;
    pthread_mutex_unlock(&manager->lock);
    study_run_free(run);
    if (is_stopped)
        task_abandon(manager, task);
    else
        task_finish(manager, task, &run_result);
    if (is_stopped && has_rows)
        (void)db_sweep_tidy(manager->db, NULL);
    run_result_clear(&run_result);
}

void study_leave(Worker *worker, StudyRun *run, Problem *problem) {
    JobManager *manager = run->manager;
    pthread_mutex_lock(&manager->lock);
    const bool is_end = study_release(run);
    pthread_mutex_unlock(&manager->lock);
    if (is_end)
        study_finish(worker, run, problem);
}

void study_work(Worker *worker, const StudyTurn *turn, Problem *problem) {
    JobManager *manager = worker->manager;
    StudyRun *run = turn->run;
    if (turn->is_end) {
        study_finish(worker, run, problem);
        return;
    }
    const int64_t began_ns = clock_monotonic_ns(), began_cpu_ns = clock_thread_cpu_ns();
    TurnClock clock = {began_ns, began_ns, 0};
    problem_clear(problem);
    task_count_cpu();
    Status status = turn->chunk != NULL ? study_make_rows(worker, turn, &clock, problem)
                                        : study_make_members(worker, turn, &clock, problem);
    (void)task_is_wanted(run->task, 1);
    status = task_result(run->task, status, problem);
    const double seconds = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    job_metrics_study(&manager->metrics, false, clock_thread_cpu_ns() - began_cpu_ns);
    pthread_mutex_lock(&manager->lock);
    worker->study = NULL;
    manager->slow_running--;
    if (clock.made > 0)
        run->member_seconds = seconds / (double)clock.made;
    if (status == STATUS_OK)
        run->is_pause_logged = false;
    else if (run->is_sweep && status_is_transient(status))
        study_pause(run, problem);
    else if (status != STATUS_CANCELLED)
        study_fail(run, status, problem);
    if (turn->chunk != NULL && turn->chunk->is_saved) {
        sweep_chunk_free(turn->chunk);
    } else if (turn->chunk != NULL) {
        turn->chunk->next = run->chunks;
        run->chunks = turn->chunk;
    }
    study_enqueue(run);
    pthread_mutex_unlock(&manager->lock);
    study_leave(worker, run, problem);
}

// A study on threads of this process alone.
typedef struct StudyThreads {
    StudyEngine engine;
    const Progress *watch;
    pthread_mutex_t lock; // of what follows, and of calls of `watch`
    Status status;        // of the first thread that failed, with its problem
    Problem *problem;
} StudyThreads;

static void study_threads_fail(StudyThreads *threads, Status status, const char *detail) {
    pthread_mutex_lock(&threads->lock);
    if (threads->status == STATUS_OK)
        threads->status = problem_set(threads->problem, status, "%s", detail);
    pthread_mutex_unlock(&threads->lock);
    study_engine_stop(&threads->engine);
}

static bool study_threads_advance(void *context, double fraction) {
    StudyThreads *threads = context;
    pthread_mutex_lock(&threads->lock);
    const bool continues =
        progress_advance(threads->watch, STUDY_BEGUN + (1 - STUDY_BEGUN) * fraction);
    pthread_mutex_unlock(&threads->lock);
    if (!continues)
        study_threads_fail(threads, STATUS_CANCELLED, "the study was stopped");
    return continues;
}

static void *study_threads_main(void *context) {
    StudyThreads *threads = context;
    StudyEngine *engine = &threads->engine;
    Workspace workspace = {0};
    Problem problem;
    size_t member;
    while (study_engine_next(engine, true, &member)) {
        problem_clear(&problem);
        const Status status = study_engine_make(engine, member, &workspace, &problem);
        // A stop that was requested is noted already; the end of the study stops members beyond it.
        if (status != STATUS_OK && status != STATUS_CANCELLED)
            study_threads_fail(threads, status, problem.detail);
    }
    workspace_clear(&workspace);
    return NULL;
}

static Status study_threads_run(StudyWork *work, const StudyTools *tools, Problem *problem) {
    StudyThreads threads = {.watch = tools->progress, .problem = problem};
    const Progress progress = {&threads, study_threads_advance};
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const size_t count = processors < 1             ? 1
                         : processors > THREADS_MAX ? THREADS_MAX
                                                    : (size_t)processors;
    pthread_t others[THREADS_MAX];
    size_t started = 0;
    pthread_mutex_init(&threads.lock, NULL);
    Status status =
        study_engine_open(&threads.engine, work, tools->limits, &progress, count, problem);
    if (status == STATUS_OK) {
        // Fewer threads than there could be do as well.
        while (started + 1 < count &&
               pthread_create(&others[started], NULL, study_threads_main, &threads) == 0)
            started++;
        (void)study_threads_main(&threads);
        for (size_t i = 0; i < started; i++)
            pthread_join(others[i], NULL);
        status = threads.status;
    }
    study_engine_close(&threads.engine);
    pthread_mutex_destroy(&threads.lock);
    return status;
}

double study_cpu(void *unused) {
    (void)unused;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

Status jobs_run_study(const Variant *study, const Simulation *simulation,
                      const SimulationLimits *limits, const Progress *watch, Variant **answer,
                      Problem *problem) {
    Workspace workspace = {0};
    StudyWork *work;
    const StudyTools tools = {
        .limits = limits, .progress = watch, .workspace = &workspace, .cpu = study_cpu};
    // A study without members is made by this thread in study_begin.
    Status status = study_begin(study, simulation, &tools, answer, &work, problem);
    if (status == STATUS_OK && study_has_members(study))
        status = study_threads_run(work, &tools, problem);
    if (status == STATUS_OK)
        status = study_end(work, &tools, problem);
    study_free(work);
    workspace_clear(&workspace);
    if (status != STATUS_OK) {
        variant_free(*answer);
        *answer = NULL;
    }
    return status;
}
