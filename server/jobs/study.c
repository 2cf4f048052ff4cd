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

bool study_is_shared(const Task *computation) {
    const Variant *study = computation->inquiry.study;
    return study != NULL && !computation->is_again && study_has_members(study);
}

void study_estimate(Task *computation, const SimulationLimits *limits) {
    const StudyRequest *inquiry = &computation->inquiry;
    const Cost own = simulation_cost(&inquiry->simulation);
    Cost whole = own;
    // A series that is computed again needs no study.
    if (!computation->is_again && study_request_cost(inquiry, limits, &whole, NULL) != STATUS_OK)
        whole.cpu_seconds = queue_quick; // the run will tell
    computation->queued.seconds = whole.cpu_seconds;
    computation->queued.charge = study_is_shared(computation) ? own.cpu_seconds : 0;
}

void chunk_run_free(StudyRun *run, ChunkRun *shift) {
    if (shift == NULL)
        return;
    if (run->gather->drop != NULL)
        run->gather->drop(shift);
    free(shift);
}

void study_run_free(StudyRun *run) {
    if (run == NULL)
        return;
    while (run->first != NULL) {
        ChunkRun *shift = run->first;
        run->first = shift->next;
        chunk_run_free(run, shift);
    }
    run->gather->free(run);
    study_free(run->work);
    run_result_clear(&run->findings);
    free(run);
}

// With the lock held: the next turn is in the queue if there is something to do.
static void enqueue(StudyRun *run) {
    JobManager *intake = run->intake;
    Task *computation = run->computation;
    QueueEntry *entry = &computation->queued;
    if (entry->number != 0 || run->first == NULL || run->is_paused)
        return;
    entry->is_turn = true;
    entry->seconds = fmax(run->turn, 1e-3 * STUDY_TURN_MS);
    entry->charge = 0;
    QueueClient *client = computation->jobs != NULL ? computation->jobs->client : entry->client;
    queue_put(intake->queue, entry, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(intake);
}

void study_wait(StudyRun *run, ChunkRun *shift, bool is_first) {
    if (is_first || run->first == NULL) {
        shift->next = run->first;
        run->first = shift;
        if (run->last == NULL)
            run->last = shift;
    } else {
        shift->next = NULL;
        run->last->next = shift;
        run->last = shift;
    }
    enqueue(run);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status open_run(Worker *worker, StudyRun *run, RunResult *findings, const Progress *watch,
                       Problem *problem) {
    const StudyRequest *inquiry = &run->computation->inquiry;
    const StudyTools tools = {.limits = &worker->intake->settings.limits,
                              .progress = watch,
                              .workspace = &worker->workspace};
    TRY(study_begin(inquiry->study, &inquiry->simulation, &tools, &findings->answer.study,
                    &run->work, problem));
    atomic_store(&run->expected, run->work->expected);
    return run->gather->open(worker, run, problem);
}

Status study_open(Worker *worker, Task *computation, RunResult *findings, const Progress *watch,
                  Problem *problem) {
    JobManager *intake = worker->intake;
    StudyRun *run = calloc(1, sizeof *run);
    if (run == NULL)
        return no_memory(problem);
    run->intake = intake;
    run->computation = computation;
    run->executor = executors[0];
    run->gather =
        study_kind(computation->inquiry.study) == &study_sweep ? &gather_rows : &gather_fold;
    run->in_hand = 1; // ours, until it was launched: nobody ends it meanwhile
    const Status status = open_run(worker, run, findings, watch, problem);
    if (status != STATUS_OK) {
        study_run_free(run);
        return status;
    }
    pthread_mutex_lock(&intake->lock);
    computation->study = run; // which frees it from here on
    pthread_mutex_unlock(&intake->lock);
    return STATUS_OK;
}

// With the lock held.
static void fail(StudyRun *run, Status status, const Problem *problem) {
    if (run->is_failed)
        return;
    run->is_failed = true;
    atomic_store(&run->is_over, true);
    run_result_fail(&run->findings, status, problem);
}

bool study_must_wait(const JobManager *intake, const Task *computation) {
    return study_is_shared(computation) &&
           intake->study_count >= STUDIES_PER_WORKER * intake->settings.workers &&
           intake->study_bytes >= STUDIES_BYTES;
}

// With the lock held.
static void resume_stalled(JobManager *intake) {
    while (intake->stalled != NULL) {
        Task *computation = intake->stalled;
        intake->stalled = computation->next_stalled;
        queue_push_front(intake->queue, &computation->queued);
        jobs_call_worker(intake);
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
    JobManager *intake = run->intake;
    queue_remove(intake->queue, &run->computation->queued);
    intake->study_count--;
    intake->study_bytes -= run->bytes;
    resume_stalled(intake);
    for (StudyRun **at = &intake->studies; *at != NULL; at = &(*at)->next)
        if (*at == run) {
            *at = run->next;
            break;
        }
    return true;
}

void study_start(Worker *worker, Task *computation, RunResult *findings, Problem *problem) {
    JobManager *intake = worker->intake;
    StudyRun *run = computation->study;
    run->findings = *findings;
    *findings = (RunResult){0};
    pthread_mutex_lock(&intake->lock);
    run->next = intake->studies;
    intake->studies = run;
    run->bytes += outcome_bytes(run->findings.outcome);
    intake->study_count++;
    intake->study_bytes += run->bytes;
    pthread_mutex_unlock(&intake->lock);
    problem_clear(problem);
    const Status status = run->gather->submit(run, problem);
    pthread_mutex_lock(&intake->lock);
    if (status != STATUS_OK)
        fail(run, status, problem);
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&intake->lock);
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
    ChunkRun *shift = run->first; // there is one: else it would have no turn
    run->first = shift->next;
    if (run->first == NULL)
        run->last = NULL;
    shift->next = NULL;
    enqueue(run);
    return shift;
}

void study_stop(StudyRun *run) {
    if (run->in_hand > 0)
        return; // they will see
    queue_remove(run->intake->queue, &run->computation->queued);
    queue_push_front(run->intake->queue, &run->computation->queued);
    jobs_call_worker(run->intake);
}

void studies_resume(JobManager *intake) {
    resume_stalled(intake);
    for (StudyRun *run = intake->studies; run != NULL; run = run->next)
        if (run->is_paused) {
            run->is_paused = false;
            enqueue(run);
        }
}

// With the lock held.
static void pause(StudyRun *run, const Problem *problem) {
    if (!run->is_told) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the sweep %s pauses: %s", run->computation->result, problem->detail);
        log_write(&line);
        bytes_clear(&line);
    }
    run->is_told = run->is_paused = true;
    queue_remove(run->intake->queue, &run->computation->queued);
}

void study_work(Worker *worker, StudyRun *run, ChunkRun *shift, Problem *problem) {
    JobManager *intake = worker->intake;
    const size_t done = shift->done;
    const int64_t began_ns = clock_monotonic_ns(), began_cpu_ns = clock_thread_cpu_ns();
    problem_clear(problem);
    Status status = shift->is_made ? STATUS_OK : study_chunk_make(worker, run, shift, problem);
    const double seconds = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    const bool is_parked = status == STATUS_BUSY;
    job_metrics_study_part(&intake->totals, clock_thread_cpu_ns() - began_cpu_ns);
    if (status == STATUS_OK && run->gather->end != NULL)
        status = run->gather->end(run, shift, problem);
    pthread_mutex_lock(&intake->lock);
    worker->study = NULL;
    intake->slow_running--;
    // At least one member is made at a time.
    if (shift->done > done)
        run->turn = seconds / (double)(shift->done - done);
    if (status == STATUS_OK) {
        run->is_told = false;
    } else if (is_parked || (run->gather->is_kept && status_is_transient(status))) {
        if (!is_parked)
            pause(run, problem);
        study_wait(run, shift, true);
        shift = NULL;
    } else if (status != STATUS_CANCELLED) {
        fail(run, status, problem);
    }
    // Before the run is let go: another may be the last one then, and free it.
    chunk_run_free(run, shift);
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&intake->lock);
    if (is_ended)
        study_finish(worker, run, problem);
}

// What remains to be told, and the study's document.
static Status tell_end(Worker *worker, StudyRun *run, Problem *problem) {
    const Progress watch = {run->computation, task_is_wanted};
    const StudyTools tools = {.limits = &worker->intake->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    problem_clear(problem);
    if (run->gather->finish != NULL)
        TRY(run->gather->finish(run, &tools, problem));
    return run_result_add_to_study(&run->findings, problem);
}

void study_finish(Worker *worker, StudyRun *run, Problem *problem) {
    JobManager *intake = worker->intake;
    Task *computation = run->computation;
    run->executor->cancel(run);
    if (!run->is_failed && !atomic_load(&computation->is_stopped)) {
        const int64_t began_ns = clock_thread_cpu_ns();
        const Status status = tell_end(worker, run, problem);
        job_metrics_study_part(&intake->totals, clock_thread_cpu_ns() - began_ns);
        if (status != STATUS_OK)
            run_result_fail(&run->findings, status, problem);
    }
    run->findings.ended_ns = clock_monotonic_ns();
    if (atomic_load(&computation->is_stopped)) {
        task_abandon(intake, computation); // and the run
    } else {
        RunResult findings = run->findings;
        run->findings = (RunResult){0};
        task_finish(intake, computation, &findings);
        run_result_clear(&findings);
    }
}
