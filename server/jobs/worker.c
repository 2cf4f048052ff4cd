// A worker takes tasks from the queue, runs them and passes their results to commit.c. A task
// stopped because no job wants it any more leaves no trace; one stopped because the daemon ends
// leaves its jobs unfinished in the database.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/documents.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"

// The rows of a result, but for its study.
static Status worker_describe(const Task *task, RunResult *run_result, Problem *problem) {
    const Outcome *outcome = run_result->outcome;
    ResultRow *row = &run_result->result;
    Bytes uses = {0}, blob = {.most = DOCUMENT_BYTES};
    references_write(&uses, &task->inquiry, true);
    outcome_blob_write(&blob, outcome);
    text_fit(row->id, sizeof row->id, task->result);
    row->impact_count = outcome->summary.impacts;
    row->count = outcome->response.count;
    row->sample_rate = outcome->response.sample_rate;
    row->created_unix_ms = clock_unix_ms();
    const Status all[] = {
        document_outcome(outcome, row),
        text_copy(engine_version, &row->engine),
        text_copy(task->scene, &row->scene),
        text_copy(task->warnings, &row->warnings),
        status_made((row->uses = bytes_take(&uses, NULL)) != NULL),
        status_made((row->outcome.at = bytes_take(&blob, &row->outcome.size)) != NULL)};
    return study_result(status_first(all, COUNT(all)), problem);
}

// A study without members measures CPU times: it is made on one thread.
static Status worker_run_study(Worker *worker, Task *task, RunResult *run_result,
                               Problem *problem) {
    ProgressRange range = {&(Progress){task, task_advance}, STUDY_OWN, 1 - STUDY_OWN, 0};
    const Progress watch = progress_range_view(&range);
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace,
                              .cpu = study_cpu};
    return study_run(task->inquiry.study, &task->inquiry.simulation, &tools,
                     &run_result->answer.study, problem);
}

static void worker_run(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
    JobManager *manager = worker->manager;
    // Only the scene's own series is ever wanted again.
    const bool has_study = task->inquiry.study != NULL && !task->recompute_only;
    const bool is_measured = has_study && !task_is_shared(task);
    ProgressRange range = {&(Progress){task, task_advance}, 0, has_study ? STUDY_OWN : 1, 0};
    const Progress watch = progress_range_view(&range);
    // A series that is computed again was within the limits when it was computed first.
    const SimulationLimits *limits = task->recompute_only ? NULL : &manager->settings.limits;
    problem_clear(problem);
    run_result->began_ns = clock_monotonic_ns();
    const int64_t run_ns = clock_thread_cpu_ns();
    task_count_cpu();
    task_allow_run(task);
    Status status = request_load_records(manager->db, &task->inquiry, problem);
    if (status == STATUS_OK)
        status = simulation_run(&task->inquiry.simulation, limits, &watch, &worker->workspace,
                                &run_result->outcome, problem);
    const int64_t study_ns = clock_thread_cpu_ns();
    run_result->seconds = 1e-9 * (double)(study_ns - run_ns);
    if (status == STATUS_OK)
        job_metrics_run(&manager->metrics, run_result->outcome, study_ns - run_ns);
    if (status == STATUS_OK && is_measured) {
        task_allow_study(task);
        status = worker_run_study(worker, task, run_result, problem);
        job_metrics_study(&manager->metrics, true, clock_thread_cpu_ns() - study_ns);
    }
    run_result->ended_ns = clock_monotonic_ns();
    if (status == STATUS_OK && !task->recompute_only) {
        status = worker_describe(task, run_result, problem);
        if (status == STATUS_OK && is_measured)
            status = run_result_add_to_study(run_result, problem);
    }
    status = task_result(task, status, problem);
    if (status != STATUS_OK)
        run_result_fail(run_result, status, problem);
    run_result->status = status;
}

static bool task_is_slow(const Task *task) {
    return task->queued.seconds > queue_quick;
}

// What a worker does next: a task, or a turn of a study (no task).
typedef struct WorkerItem {
    Task *task;
    StudyTurn turn;
} WorkerItem;

// What may take long keeps the spare worker ready for what does not.
static void worker_begin_slow(JobManager *manager) {
    if (++manager->slow_running == manager->settings.workers)
        pthread_cond_signal(&manager->spare_work);
}

static void worker_begin(Worker *worker, Task *task) {
    JobManager *manager = worker->manager;
    task->is_running = true;
    task->workers = 1;
    worker->running = task;
    if (task_is_slow(task))
        worker_begin_slow(manager);
    const int64_t now_ms = clock_unix_ms(), now_ns = clock_monotonic_ns();
    task->began_ns = now_ns;
    for (Job *job = task->jobs; job != NULL; job = job->next_shared) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = now_ms;
        job->started_ns = now_ns;
        job->row.queued = 1e-9 * (double)(now_ns - job->submitted_ns);
        histogram_add(&manager->metrics.waited, now_ns - job->submitted_ns);
    }
}

// With the lock held: waits for what this worker may do. NULL when the daemon ends.
static QueueEntry *worker_wait(Worker *worker) {
    JobManager *manager = worker->manager;
    while (!manager->is_closing) {
        // The spare worker has nothing to do while another one is idle or does something quick.
        const bool is_needed =
            !worker->is_spare || manager->slow_running >= manager->settings.workers;
        QueueEntry *entry = is_needed && !jobs_is_behind(manager)
                                ? queue_take(manager->queue, worker->is_spare)
                                : NULL;
        if (entry != NULL)
            return entry;
        pthread_cond_wait(worker->is_spare ? &manager->spare_work : &manager->work, &manager->lock);
    }
    return NULL;
}

// With the lock held. False when the daemon ends.
static bool worker_next(Worker *worker, WorkerItem *item) {
    item->task = NULL;
    for (;;) {
        QueueEntry *entry = worker_wait(worker);
        if (entry == NULL)
            return false;
        Task *task = task_of(entry);
        if (task->study == NULL) {
            if (!task_begin(task))
                continue;
            worker_begin(worker, task);
            item->task = task;
            return true;
        }
        if (!study_take(task->study, &item->turn))
            continue;
        if (!item->turn.is_end) {
            worker->study = task->study;
            worker_begin_slow(worker->manager);
        }
        return true;
    }
}

static void worker_compute(Worker *worker, Task *task, Problem *problem) {
    JobManager *manager = worker->manager;
    RunResult run_result = {0};
    worker_run(worker, task, &run_result, problem);
    const bool is_shared = run_result.status == STATUS_OK && task_is_shared(task);
    if (is_shared) {
        problem_clear(problem);
        task_allow_study(task);
        const Status status =
            task_result(task, study_start(worker, task, &run_result, problem), problem);
        if (status != STATUS_OK)
            run_result_fail(&run_result, status, problem);
    }
    StudyRun *study = is_shared && run_result.status == STATUS_OK ? task->study : NULL;
    const Status status = run_result.status;
    // What the database cannot do now is done later, from the beginning; readers of a series get
    // the fault.
    const bool is_stalled =
        status == STATUS_FULL ||
        (!task->recompute_only && (status == STATUS_IO || status == STATUS_BUSY));
    pthread_mutex_lock(&manager->lock);
    worker->running = NULL;
    manager->slow_running -= task_is_slow(task);
    // It keeps its worker until it is saved: a cancel queues only a study that no worker is at.
    if (study == NULL)
        task_end(task);
    const bool is_stopped = atomic_load(&task->is_stopped);
    if (is_stalled && !is_stopped) {
        request_drop_records(&task->inquiry);
        task->is_running = false;
        task_wait(task);
    }
    pthread_mutex_unlock(&manager->lock);
    if (study != NULL)
        study_leave(worker, study, problem);
    else if (is_stopped || status == STATUS_CANCELLED)
        task_abandon(manager, task);
    else if (!is_stalled)
        task_finish(manager, task, &run_result);
    run_result_clear(&run_result);
}

void *worker_main(void *context) {
    Worker *worker = context;
    JobManager *manager = worker->manager;
    Problem problem;
    WorkerItem item;
    pthread_mutex_lock(&manager->lock);
    while (worker_next(worker, &item)) {
        pthread_mutex_unlock(&manager->lock);
        if (item.task != NULL)
            worker_compute(worker, item.task, &problem);
        else
            study_work(worker, &item.turn, &problem);
        pthread_mutex_lock(&manager->lock);
    }
    pthread_mutex_unlock(&manager->lock);
    workspace_clear(&worker->workspace);
    return NULL;
}
