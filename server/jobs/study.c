// The way of a study:
//
//     a worker:   begin - cut into chunks (a sweep's are written down) - launch
//     any worker: take a chunk, make its members, gather them ... until none is wanted
//     the last:   result and jobs, as of any computation
//
// While it has chunks that wait, one turn of it stands in the queue: whoever takes that takes a
// chunk and puts the next turn behind the others'. Where the store keeps what it comes to, a full
// disk pauses it: the chunk waits in memory and is tried again now and then.
#include "server/jobs/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "server/jobs/study_sink.h"
#include "server/util/clock.h"
#include "server/util/log.h"

// Each that is under way holds its scene's outcome and what it folds.
enum { STUDIES_BYTES = 512 << 20, STUDIES_PER_WORKER = 2 };

bool study_is_shared(const Task *task) {
    const Variant *study = task->inquiry.study;
    return study != NULL && !task->recompute_only && study_has_members(study);
}

void study_estimate(Task *task, const SimulationLimits *limits) {
    const StudyRequest *inquiry = &task->inquiry;
    const Cost own = simulation_cost(&inquiry->simulation);
    Cost whole = own;
    // A series that is computed again needs no study.
    if (!task->recompute_only && study_request_cost(inquiry, limits, &whole, NULL) != STATUS_OK)
        whole.cpu_seconds = queue_quick; // the run will tell
    task->queued.seconds = whole.cpu_seconds;
    task->queued.charge = study_is_shared(task) ? own.cpu_seconds : 0;
}

void chunk_run_free(StudyRun *run, ChunkRun *chunk_run) {
    if (chunk_run == NULL)
        return;
    if (run->gather->drop != NULL)
        run->gather->drop(chunk_run);
    free(chunk_run);
}

void study_run_free(StudyRun *run) {
    if (run == NULL)
        return;
    while (run->first != NULL) {
        ChunkRun *chunk_run = run->first;
        run->first = chunk_run->next;
        chunk_run_free(run, chunk_run);
    }
    run->gather->free(run);
    study_free(run->work);
    run_result_clear(&run->run_result);
    free(run);
}

// With the lock held: the next turn is in the queue if there is something to do.
static void enqueue(StudyRun *run) {
    JobManager *manager = run->manager;
    Task *task = run->task;
    QueueEntry *entry = &task->queued;
    if (entry->number != 0 || run->first == NULL || run->is_paused)
        return;
    entry->is_turn = true;
    entry->seconds = fmax(run->turn, 1e-3 * STUDY_TURN_MS);
    entry->charge = 0;
    QueueClient *client = task->jobs != NULL ? task->jobs->client : entry->client;
    queue_put(manager->queue, entry, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(manager);
}

void study_wait(StudyRun *run, ChunkRun *chunk_run, bool is_first) {
    if (is_first || run->first == NULL) {
        chunk_run->next = run->first;
        run->first = chunk_run;
        if (run->last == NULL)
            run->last = chunk_run;
    } else {
        chunk_run->next = NULL;
        run->last->next = chunk_run;
        run->last = chunk_run;
    }
    enqueue(run);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status open_run(Worker *worker, StudyRun *run, RunResult *run_result, const Progress *watch,
                       Problem *problem) {
    const StudyRequest *inquiry = &run->task->inquiry;
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = watch,
                              .workspace = &worker->workspace};
    TRY(study_begin(inquiry->study, &inquiry->simulation, &tools, &run_result->answer.study,
                    &run->work, problem));
    atomic_store(&run->expected, run->work->expected);
    return run->gather->open(worker, run, problem);
}

Status study_open(Worker *worker, Task *task, RunResult *run_result, const Progress *watch,
                  Problem *problem) {
    JobManager *manager = worker->manager;
    StudyRun *run = calloc(1, sizeof *run);
    if (run == NULL)
        return no_memory(problem);
    run->manager = manager;
    run->task = task;
    run->executor = executors[0];
    run->gather = study_kind(task->inquiry.study) == &study_sweep ? &gather_rows : &gather_fold;
    run->in_hand = 1; // ours, until it was launched: nobody ends it meanwhile
    const Status status = open_run(worker, run, run_result, watch, problem);
    if (status != STATUS_OK) {
        study_run_free(run);
        return status;
    }
    pthread_mutex_lock(&manager->lock);
    task->study = run; // which frees it from here on
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

// With the lock held.
static void fail(StudyRun *run, Status status, const Problem *problem) {
    if (run->is_failed)
        return;
    run->is_failed = true;
    atomic_store(&run->is_over, true);
    run_result_fail(&run->run_result, status, problem);
}

bool study_must_wait(const JobManager *manager, const Task *task) {
    return study_is_shared(task) &&
           manager->study_count >= STUDIES_PER_WORKER * manager->settings.workers &&
           manager->study_bytes >= STUDIES_BYTES;
}

// With the lock held.
static void resume_stalled(JobManager *manager) {
    while (manager->waiting_for_memory != NULL) {
        Task *task = manager->waiting_for_memory;
        manager->waiting_for_memory = task->next_stalled;
        queue_push_front(manager->queue, &task->queued);
        jobs_call_worker(manager);
    }
}

static bool is_over(StudyRun *run) {
    return !study_continues(run, 0);
}

// With the lock held, by whoever had something of it in hand: whether it is to be ended now, by
// them. It is in no list any more then, and stays in their hands.
static bool let_go(StudyRun *run) {
    if (!is_over(run) || run->in_hand > 1) {
        run->in_hand--;
        return false;
    }
    JobManager *manager = run->manager;
    queue_remove(manager->queue, &run->task->queued);
    manager->study_count--;
    manager->study_bytes -= run->bytes;
    resume_stalled(manager);
    for (StudyRun **at = &manager->studies; *at != NULL; at = &(*at)->next)
        if (*at == run) {
            *at = run->next;
            break;
        }
    return true;
}

void study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
    JobManager *manager = worker->manager;
    StudyRun *run = task->study;
    run->run_result = *run_result;
    *run_result = (RunResult){0};
    pthread_mutex_lock(&manager->lock);
    run->next = manager->studies;
    manager->studies = run;
    run->bytes += outcome_bytes(run->run_result.outcome);
    manager->study_count++;
    manager->study_bytes += run->bytes;
    pthread_mutex_unlock(&manager->lock);
    problem_clear(problem);
    const Status status = run->gather->submit(run, problem);
    pthread_mutex_lock(&manager->lock);
    if (status != STATUS_OK)
        fail(run, status, problem);
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&manager->lock);
    if (is_ended)
        study_finish(worker, run, problem);
}

ChunkRun *study_take(StudyRun *run, bool *is_ended) {
    run->in_hand++;
    *is_ended = false;
    if (is_over(run)) {
        *is_ended = let_go(run);
        return NULL;
    }
    ChunkRun *chunk_run = run->first; // there is one: else it would have no turn
    run->first = chunk_run->next;
    if (run->first == NULL)
        run->last = NULL;
    chunk_run->next = NULL;
    enqueue(run);
    return chunk_run;
}

void study_stop(StudyRun *run) {
    if (run->in_hand > 0)
        return; // they will see
    queue_remove(run->manager->queue, &run->task->queued);
    queue_push_front(run->manager->queue, &run->task->queued);
    jobs_call_worker(run->manager);
}

void studies_resume(JobManager *manager) {
    resume_stalled(manager);
    for (StudyRun *run = manager->studies; run != NULL; run = run->next)
        if (run->is_paused) {
            run->is_paused = false;
            enqueue(run);
        }
}

// With the lock held.
static void pause(StudyRun *run, const Problem *problem) {
    if (!run->is_told) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the sweep %s pauses: %s", run->task->result, problem->detail);
        log_write(&line);
        bytes_clear(&line);
    }
    run->is_told = run->is_paused = true;
    queue_remove(run->manager->queue, &run->task->queued);
}

void study_work(Worker *worker, StudyRun *run, ChunkRun *chunk_run, Problem *problem) {
    JobManager *manager = worker->manager;
    const size_t done = chunk_run->done;
    const int64_t began_ns = clock_monotonic_ns(), began_cpu_ns = clock_thread_cpu_ns();
    problem_clear(problem);
    Status status =
        chunk_run->is_made ? STATUS_OK : study_chunk_make(worker, run, chunk_run, problem);
    const double seconds = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    const bool is_parked = status == STATUS_BUSY;
    job_metrics_study_part(&manager->totals, clock_thread_cpu_ns() - began_cpu_ns);
    if (status == STATUS_OK && run->gather->end != NULL)
        status = run->gather->end(run, chunk_run, problem);
    pthread_mutex_lock(&manager->lock);
    worker->study = NULL;
    manager->slow_running--;
    // At least one member is made at a time.
    if (chunk_run->done > done)
        run->turn = seconds / (double)(chunk_run->done - done);
    if (status == STATUS_OK) {
        run->is_told = false;
    } else if (is_parked || (run->gather->is_kept && status_is_transient(status))) {
        if (!is_parked)
            pause(run, problem);
        study_wait(run, chunk_run, true);
        chunk_run = NULL;
    } else if (status != STATUS_CANCELLED) {
        fail(run, status, problem);
    }
    // Before the run is let go: another may be the last one then, and free it.
    chunk_run_free(run, chunk_run);
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&manager->lock);
    if (is_ended)
        study_finish(worker, run, problem);
}

// What remains to be told, and the study's document.
static Status tell_end(Worker *worker, StudyRun *run, Problem *problem) {
    const Progress watch = {run->task, task_is_wanted};
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    problem_clear(problem);
    if (run->gather->finish != NULL)
        TRY(run->gather->finish(run, &tools, problem));
    return run_result_add_to_study(&run->run_result, problem);
}

void study_finish(Worker *worker, StudyRun *run, Problem *problem) {
    JobManager *manager = worker->manager;
    Task *task = run->task;
    run->executor->cancel(run);
    if (!run->is_failed && !atomic_load(&task->is_stopped)) {
        const int64_t began_ns = clock_thread_cpu_ns();
        const Status status = tell_end(worker, run, problem);
        job_metrics_study_part(&manager->totals, clock_thread_cpu_ns() - began_ns);
        if (status != STATUS_OK)
            run_result_fail(&run->run_result, status, problem);
    }
    run->run_result.ended_ns = clock_monotonic_ns();
    if (atomic_load(&task->is_stopped)) {
        task_abandon(manager, task); // and the run
    } else {
        RunResult run_result = run->run_result;
        run->run_result = (RunResult){0};
        task_finish(manager, task, &run_result);
        run_result_clear(&run_result);
    }
}
