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

#include "server/util/clock.h"
#include "server/util/process.h"

enum {
    TURN_MS = 10, // at least, of a turn
    LOOK_MS = 1,  // how often a turn looks whether other work waits
};

// The task's progress, which never decreases. False: the task was stopped.
static bool study_advance_task(void *context, double fraction) {
    static const double begun = STUDY_OWN + (1 - STUDY_OWN) * STUDY_BEGUN;
    Task *task = context;
    const unsigned reached = (unsigned)(1e4 * (begun + (1 - begun) * fraction));
    unsigned last = atomic_load(&task->progress);
    while (last < reached && !atomic_compare_exchange_weak(&task->progress, &last, reached))
        ;
    return !atomic_load(&task->is_stopped);
}

static bool study_is_over(StudyRun *run) {
    return atomic_load(&run->engine.is_over) || atomic_load(&run->task->is_stopped);
}

void study_run_free(StudyRun *run) {
    if (run == NULL)
        return;
    sweep_run_free(run->sweep);
    study_engine_close(&run->engine);
    study_free(run->work);
    run_result_clear(&run->run_result);
    free(run);
}

// With the lock held: the next turn is in the queue if there is something to do.
static void study_enqueue(StudyRun *run) {
    QueueEntry *entry = &run->task->queued;
    const bool has_work =
        run->sweep != NULL ? sweep_run_has_chunk(run->sweep) : study_engine_has_next(&run->engine);
    if (entry->number != 0 || !has_work || run->is_paused)
        return;
    entry->is_turn = true;
    entry->seconds = fmax(run->member_seconds, 1e-3 * TURN_MS);
    entry->charge = 0;
    QueueClient *client = run->task->jobs != NULL ? run->task->jobs->client : entry->client;
    queue_put(run->manager->queue, entry, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(run->manager);
}

static Status study_open(Worker *worker, StudyRun *run, StudyAnswer *answer, Problem *problem) {
    const JobManagerSettings *settings = &worker->manager->settings;
    const StudyRequest *inquiry = &run->task->inquiry;
    ProgressRange range = {&(Progress){run->task, task_advance}, STUDY_OWN, 1 - STUDY_OWN, 0};
    const Progress begin = progress_range_view(&range);
    const Progress members = {run->task, study_advance_task};
    const StudyTools tools = {
        .limits = &settings->limits, .progress = &begin, .workspace = &worker->workspace};
    const bool is_sweep = study_kind(inquiry->study) == &study_sweep;
    TRY(study_begin(inquiry->study, &inquiry->simulation, &tools, &answer->study, &run->work,
                    problem));
    TRY(study_engine_open(&run->engine, run->work, &settings->limits, &members,
                          is_sweep ? 0 : settings->workers, problem));
    if (!is_sweep)
        return STATUS_OK;
    return sweep_run_open(worker->manager->db, run->task->result, run->task->scene, &run->engine,
                          settings->workers, &worker->workspace, &run->sweep, problem);
}

Status study_start(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
    JobManager *manager = worker->manager;
    StudyRun *run = calloc(1, sizeof *run);
    if (run == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
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
    task->sweep = run->sweep;
    run->next = manager->studies;
    manager->studies = run;
    study_enqueue(run);
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

void studies_resume(JobManager *manager) {
    for (StudyRun *run = manager->studies; run != NULL; run = run->next)
        if (run->is_paused) {
            run->is_paused = false;
            study_enqueue(run);
        }
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
    if (run->sweep != NULL)
        is_taken = (turn->chunk = sweep_run_take(run->sweep)) != NULL;
    else
        is_taken = study_engine_next(&run->engine, false, &turn->member);
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
    TRY(sweep_chunk_load(run->sweep, chunk, problem));
    for (; chunk->done < chunk->count; chunk->done++, clock->made++) {
        if (clock->made > 0 && study_must_yield(run, clock))
            return STATUS_OK;
        if (!study_engine_continues(&run->engine))
            return STATUS_CANCELLED;
        TRY(sweep_chunk_make(run->sweep, chunk, &worker->workspace, problem));
    }
    return sweep_chunk_save(run->sweep, chunk, problem);
}

// With the lock held.
static void study_fail(StudyRun *run, Status status, Problem *problem) {
    if (run->is_failed)
        return;
    run->is_failed = true;
    study_engine_stop(&run->engine);
    run_result_fail(&run->run_result, status, problem);
}

// With the lock held.
static void study_pause(StudyRun *run, const Problem *problem) {
    if (!run->is_pause_logged) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the sweep %s pauses: %s", run->task->result, problem->detail);
        log_write(&line);
        bytes_clear(&line);
    }
    run->is_pause_logged = run->is_paused = true;
    queue_remove(run->manager->queue, &run->task->queued);
}

static Status study_complete(Worker *worker, StudyRun *run, Problem *problem) {
    const Progress watch = {run->task, task_is_wanted};
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    problem_clear(problem);
    if (run->sweep == NULL)
        TRY(study_end(run->work, &tools, problem));
    return run_result_add_to_study(&run->run_result, problem);
}

// Ends a study that is in no list any more: successful, failed or abandoned.
static void study_finish(Worker *worker, StudyRun *run, Problem *problem) {
    JobManager *manager = run->manager;
    Task *task = run->task;
    if (!run->is_failed && !atomic_load(&task->is_stopped)) {
        const int64_t began_ns = clock_thread_cpu_ns();
        const Status status = study_complete(worker, run, problem);
        job_metrics_study(&manager->metrics, false, clock_thread_cpu_ns() - began_ns);
        if (status != STATUS_OK)
            run_result_fail(&run->run_result, status, problem);
    }
    RunResult run_result = run->run_result;
    const bool has_rows = run->sweep != NULL, is_stopped = atomic_load(&task->is_stopped);
    run_result.ended_ns = clock_monotonic_ns();
    run->run_result = (RunResult){0};
    pthread_mutex_lock(&manager->lock);
    task->study = NULL;
    task->sweep = NULL;
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
    const Status status = turn->chunk != NULL ? study_make_rows(worker, turn, &clock, problem)
                                              : study_make_members(worker, turn, &clock, problem);
    const double seconds = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    job_metrics_study(&manager->metrics, false, clock_thread_cpu_ns() - began_cpu_ns);
    pthread_mutex_lock(&manager->lock);
    worker->study = NULL;
    manager->slow_running--;
    if (clock.made > 0)
        run->member_seconds = seconds / (double)clock.made;
    if (status == STATUS_OK)
        run->is_pause_logged = false;
    else if (run->sweep != NULL && status_is_transient(status))
        study_pause(run, problem);
    else if (status != STATUS_CANCELLED)
        study_fail(run, status, problem);
    if (run->sweep != NULL)
        sweep_run_return(run->sweep, turn->chunk);
    study_enqueue(run);
    const bool is_end = study_release(run);
    pthread_mutex_unlock(&manager->lock);
    if (is_end)
        study_finish(worker, run, problem);
}
