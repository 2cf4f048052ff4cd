// A worker takes computations from the queue, runs them, hands what they came to to be saved, and
// takes the next. A computation stopped because it is not wanted any more leaves no trace; one
// stopped because the daemon ends leaves its jobs unfinished in the store.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/jobs/documents.h"
#include "server/jobs/outcome_blob.h"
#include "server/jobs/study.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

static char *take(Bytes *bytes, Status *status) {
    char *text = bytes_take(bytes, NULL);
    if (text == NULL)
        *status = STATUS_NO_MEMORY;
    return text;
}

static Status describe(Task *task, RunResult *run_result) {
    const Outcome *outcome = run_result->outcome;
    ResultRow *row = &run_result->result;
    Bytes plan = {0}, summary = {0}, work = {0}, notes = {0}, uses = {0};
    Bytes blob = {.most = DOCUMENT_BYTES};
    Status status = STATUS_OK;
    document_plan(&plan, &outcome->plan);
    document_summary(&summary, outcome);
    document_work(&work, &outcome->work);
    document_warnings(&notes, &outcome->warnings);
    outcome_blob_write(&blob, outcome);
    references_write(&uses, &task->inquiry, true);
    text_fit(row->id, sizeof row->id, task->result);
    row->engine = strdup(engine_version);
    row->scene = strdup(task->scene);
    row->warnings = strdup(task->warnings);
    row->plan = take(&plan, &status);
    row->summary = take(&summary, &status);
    row->work = take(&work, &status);
    row->notes = take(&notes, &status);
    row->uses = take(&uses, &status);
    row->outcome.at = bytes_take(&blob, &row->outcome.size);
    row->impact_count = outcome->summary.impacts;
    row->count = outcome->response.count;
    row->sample_rate = outcome->response.sample_rate;
    row->created_unix_ms = clock_unix_ms();
    return row->engine == NULL || row->scene == NULL || row->warnings == NULL ||
                   row->outcome.at == NULL
               ? STATUS_NO_MEMORY
               : status;
}

static double thread_cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

// A study without members measures CPU times: it is made on one thread.
static Status run_study(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
    ProgressRange range = {&(Progress){task, task_advance}, STUDY_OWN, 1 - STUDY_OWN, 0};
    const Progress watch = progress_range_view(&range);
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace,
                              .cpu = thread_cpu};
    return study_run(task->inquiry.study, &task->inquiry.simulation, &tools,
                     &run_result->answer.study, problem);
}

static void run(Worker *worker, Task *task, RunResult *run_result, Problem *problem) {
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
    Status status = request_load_records(manager->db, &task->inquiry, problem);
    if (status == STATUS_OK)
        status = simulation_run(&task->inquiry.simulation, limits, &watch, &worker->workspace,
                                &run_result->outcome, problem);
    const int64_t study_ns = clock_thread_cpu_ns();
    run_result->seconds = 1e-9 * (double)(study_ns - run_ns);
    if (status == STATUS_OK)
        job_metrics_run(&manager->metrics, run_result->outcome, study_ns - run_ns);
    if (status == STATUS_OK && is_measured) {
        status = run_study(worker, task, run_result, problem);
        job_metrics_study(&manager->metrics, true, clock_thread_cpu_ns() - study_ns);
    }
    run_result->ended_ns = clock_monotonic_ns();
    if (status == STATUS_OK && !task->recompute_only) {
        status = describe(task, run_result);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the result's documents");
        else if (is_measured)
            status = run_result_add_to_study(run_result, problem);
    }
    if (status != STATUS_OK)
        run_result_fail(run_result, status, problem);
    run_result->status = status;
}

static bool is_slow(const Task *task) {
    return task->queued.seconds > queue_quick;
}

// What a worker does next: a task, or a turn of a study (no task).
typedef struct WorkItem {
    Task *task;
    StudyTurn turn;
} WorkItem;

// The spare worker has nothing to do while an ordinary one is idle or busy with something quick.
static QueueEntry *take_entry(const Worker *worker) {
    JobManager *manager = worker->manager;
    if (worker->is_spare && manager->slow_running < manager->settings.workers)
        return NULL;
    return queue_take(manager->queue, worker->is_spare);
}

// What may take long keeps the spare worker ready for what does not.
static void begin_slow(JobManager *manager) {
    if (++manager->slow_running == manager->settings.workers)
        pthread_cond_signal(&manager->spare_work);
}

static void begin_computation(Worker *worker, Task *task) {
    JobManager *manager = worker->manager;
    task->is_running = true;
    task->workers = 1;
    worker->running = task;
    if (is_slow(task))
        begin_slow(manager);
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

static void leave(Worker *worker, const Task *task) {
    worker->running = NULL;
    worker->manager->slow_running -= is_slow(task);
}

static QueueEntry *wait_for_entry(Worker *worker) {
    JobManager *manager = worker->manager;
    QueueEntry *entry = NULL;
    while (!manager->is_closing &&
           (jobs_is_behind(manager) || (entry = take_entry(worker)) == NULL))
        pthread_cond_wait(worker->is_spare ? &manager->spare_work : &manager->work, &manager->lock);
    return entry;
}

// With the lock held. False when the daemon ends.
static bool next_task(Worker *worker, WorkItem *item) {
    item->task = NULL;
    for (;;) {
        QueueEntry *entry = wait_for_entry(worker);
        if (entry == NULL)
            return false;
        Task *task = task_of(entry);
        if (task->study == NULL) {
            if (!task_begin(task))
                continue;
            begin_computation(worker, task);
            item->task = task;
            return true;
        }
        if (!study_take(task->study, &item->turn))
            continue;
        if (!item->turn.is_end) {
            worker->study = task->study;
            begin_slow(worker->manager);
        }
        return true;
    }
}

// How long runs take in relation to their estimate, for clients that ask when to retry.
static void update_bias(JobManager *manager, const Task *task, const RunResult *run_result) {
    const double estimated = task->queued.seconds;
    const double ratio = 1e-9 * (double)(run_result->ended_ns - run_result->began_ns) / estimated;
    if (estimated > 0 && ratio > 1e-3 && ratio < 1e3)
        manager->estimate_bias += 0.1 * (ratio - manager->estimate_bias);
}

static void compute(Worker *worker, Task *task, Problem *problem) {
    JobManager *manager = worker->manager;
    RunResult run_result = {0};
    run(worker, task, &run_result, problem);
    const bool is_shared = run_result.status == STATUS_OK && task_is_shared(task);
    if (is_shared) {
        problem_clear(problem);
        const Status status = study_start(worker, task, &run_result, problem);
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
    leave(worker, task);
    if (status == STATUS_OK && study == NULL)
        update_bias(manager, task, &run_result);
    if (study == NULL) {
        task->workers = 0;
        task_end(task);
    }
    const bool is_stopped = atomic_load(&task->is_stopped);
    if (is_stalled && !is_stopped)
        task_wait(task);
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
    Problem problem; // large, but a thread's stack is larger
    WorkItem item;
    pthread_mutex_lock(&manager->lock);
    while (next_task(worker, &item)) {
        pthread_mutex_unlock(&manager->lock);
        if (item.task != NULL)
            compute(worker, item.task, &problem);
        else
            study_work(worker, &item.turn, &problem);
        pthread_mutex_lock(&manager->lock);
    }
    pthread_mutex_unlock(&manager->lock);
    workspace_clear(&worker->workspace);
    return NULL;
}
