// A worker takes computations from the queue, runs them, hands what they came to to be saved, and
// takes the next. A computation stopped because nobody wants it leaves no trace; one stopped
// because the daemon ends leaves its jobs unfinished in the store.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/jobs/documents.h"
#include "server/jobs/references.h"
#include "server/jobs/resolve_record.h"
#include "server/jobs/study.h"
#include "server/jobs/study_sink.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

// A computation's run, or the study after it, as a part of the whole.
typedef struct Part {
    Task *computation;
    double from, share;
} Part;

static bool advance(void *context, double fraction) {
    const Part *part = context;
    const double share = fraction < 0 ? 0 : fraction > 1 ? 1 : fraction;
    atomic_store(&part->computation->progress,
                 (unsigned)((part->from + share * part->share) * 10000));
    return !atomic_load(&part->computation->is_stopped);
}

bool task_is_wanted(void *context, double fraction) {
    const Task *computation = context;
    (void)fraction;
    return !atomic_load(&computation->is_stopped);
}

void run_result_clear(RunResult *findings) {
    outcome_unref(findings->outcome);
    fields_clear(study_answer_fields, &findings->answer);
    result_row_clear(&findings->result);
    free(findings->problem);
    *findings = (RunResult){0};
}

static char *take(Bytes *bytes, Status *status) {
    char *text = bytes_take(bytes, NULL);
    if (text == NULL)
        *status = STATUS_NO_MEMORY;
    return text;
}

static Status describe(Task *computation, RunResult *findings) {
    const Progress watch = {computation, task_is_wanted};
    const Outcome *outcome = findings->outcome;
    ResultRow *row = &findings->result;
    Bytes plan = {0}, summary = {0}, work = {0}, notes = {0}, energy = {0}, uses = {0};
    Bytes impacts = {.most = DOCUMENT_BYTES}, psd = {.most = DOCUMENT_BYTES};
    Status status = STATUS_OK;
    document_plan(&plan, &outcome->plan);
    document_summary(&summary, outcome);
    document_work(&work, &outcome->work);
    document_warnings(&notes, &outcome->warnings);
    document_energy(&energy, &outcome->response.energy);
    if (!document_impacts(&impacts, &outcome->response, &watch) ||
        (outcome->spectrum.densities.count > 0 && !document_psd(&psd, &outcome->spectrum, &watch)))
        status = STATUS_CANCELLED;
    references_write(&uses, &computation->inquiry);
    text_fit(row->id, sizeof row->id, computation->result);
    row->engine = strdup(engine_version);
    row->scene = strdup(computation->scene);
    row->warnings = strdup(computation->warnings);
    row->plan = take(&plan, &status);
    row->summary = take(&summary, &status);
    row->work = take(&work, &status);
    row->notes = take(&notes, &status);
    row->energy = take(&energy, &status);
    row->uses = take(&uses, &status);
    row->impacts = take(&impacts, &status);
    if (outcome->spectrum.densities.count > 0)
        row->psd = take(&psd, &status);
    row->count = outcome->response.count;
    row->sample_rate = outcome->response.sample_rate;
    row->created_unix_ms = clock_unix_ms();
    return row->engine == NULL || row->scene == NULL || row->warnings == NULL ? STATUS_NO_MEMORY
                                                                              : status;
}

Status run_result_add_to_study(RunResult *findings, Problem *problem) {
    Bytes study = {.most = DOCUMENT_BYTES};
    Status status = STATUS_OK;
    document_study(&study, &findings->answer);
    findings->result.study = take(&study, &status);
    findings->result.created_unix_ms = clock_unix_ms();
    return problem_set(problem, status, "no memory for the study's document");
}

void run_result_fail(RunResult *findings, Status status, const Problem *problem) {
    findings->status = status;
    text_fit(findings->detail, sizeof findings->detail, problem->detail);
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, encode_problem_code(status), NULL);
    free(findings->problem);
    findings->problem = bytes_take(&bytes, NULL);
}

static double thread_cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

static Status run_study(Worker *worker, Task *computation, RunResult *findings, Problem *problem) {
    Part part = {computation, STUDY_OWN, 1 - STUDY_OWN};
    const Progress watch = {&part, advance};
    const StudyTools tools = {.limits = &worker->intake->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace,
                              .cpu = thread_cpu};
    // What has members goes on chunk by chunk, on all threads. What measures CPU times has none: it
    // is made here, by itself.
    if (study_is_shared(computation))
        return study_open(worker, computation, findings, &watch, problem);
    return study_run(computation->inquiry.study, &computation->inquiry.simulation, &tools,
                     &findings->answer.study, problem);
}

static void run(Worker *worker, Task *computation, RunResult *findings, Problem *problem) {
    JobManager *intake = worker->intake;
    // Only the scene's own series is ever wanted again.
    const bool has_study = computation->inquiry.study != NULL && !computation->is_again;
    Part part = {computation, 0, has_study ? STUDY_OWN : 1};
    const Progress watch = {&part, advance};
    // A series that is computed again was within the limits when it was computed first.
    const SimulationLimits *limits = computation->is_again ? NULL : &intake->settings.limits;
    problem_clear(problem);
    findings->began_ns = clock_monotonic_ns();
    const int64_t run_ns = clock_thread_cpu_ns();
    Status status = resolve_records_again(intake->store, &computation->inquiry, problem);
    if (status == STATUS_OK)
        status = simulation_run(&computation->inquiry.simulation, limits, &watch,
                                &worker->workspace, &findings->outcome, problem);
    const int64_t study_ns = clock_thread_cpu_ns();
    findings->seconds = 1e-9 * (double)(study_ns - run_ns);
    if (status == STATUS_OK)
        job_metrics_run(&intake->totals, findings->outcome, study_ns - run_ns);
    if (status == STATUS_OK && has_study) {
        status = run_study(worker, computation, findings, problem);
        job_metrics_study(&intake->totals, clock_thread_cpu_ns() - study_ns);
    }
    findings->ended_ns = clock_monotonic_ns();
    if (status == STATUS_OK && !computation->is_again) {
        status = describe(computation, findings);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the result's documents");
        else if (has_study && computation->study == NULL)
            status = run_result_add_to_study(findings, problem);
    }
    if (status != STATUS_OK)
        run_result_fail(findings, status, problem);
    findings->status = status;
}

// Nobody waits for it any more, or the daemon ends and its jobs stay unfinished in the store.
void task_abandon(JobManager *intake, Task *computation) {
    const bool has_rows = computation->study != NULL && computation->study->gather->is_kept;
    pthread_mutex_lock(&intake->lock);
    hashmap_remove(intake->in_flight, &computation->indexed);
    while (computation->jobs != NULL) {
        Job *job = computation->jobs;
        computation->jobs = job->next_shared;
        job->computation = NULL;
        job->next_shared = NULL;
        jobs_retire(job);
        subscribers_call(&job->wakers);
        job_unref(job); // the computation's hold
    }
    subscribers_call(&computation->askers);
    pthread_mutex_unlock(&intake->lock);
    task_free(computation); // and its study
    if (has_rows)
        (void)db_sweep_tidy(intake->store, NULL);
}

void task_finish(JobManager *intake, Task *computation, RunResult *findings) {
    char result[sizeof computation->result];
    const double seconds = findings->seconds;
    Outcome *outcome = findings->outcome != NULL ? outcome_ref(findings->outcome) : NULL;
    memcpy(result, computation->result, sizeof result);
    jobs_save(intake, computation, findings);
    if (outcome != NULL)
        jobs_keep_series(intake, result, outcome, seconds);
    outcome_unref(outcome);
}

static bool is_slow(const Task *computation) {
    return computation->queued.seconds > queue_quick;
}

// What a worker does next: a computation, or a chunk of a study, or the end of one (no chunk).
typedef struct WorkItem {
    Task *computation;
    StudyRun *study;
    ChunkRun *shift;
} WorkItem;

// The spare worker has nothing to do while an ordinary one is idle or busy with something quick.
static QueueEntry *take_entry(const Worker *worker) {
    JobManager *intake = worker->intake;
    if (worker->is_spare && intake->slow_running < intake->settings.workers)
        return NULL;
    return queue_take(intake->queue, worker->is_spare);
}

// What may take long keeps the spare worker ready for what does not.
static void begin_slow(JobManager *intake) {
    if (++intake->slow_running == intake->settings.workers)
        pthread_cond_signal(&intake->spare_work);
}

static void begin_computation(Worker *worker, Task *computation) {
    JobManager *intake = worker->intake;
    computation->is_running = true;
    worker->running = computation;
    if (is_slow(computation))
        begin_slow(intake);
    const int64_t now_ms = clock_unix_ms(), now_ns = clock_monotonic_ns();
    computation->began_ns = now_ns;
    for (Job *job = computation->jobs; job != NULL; job = job->next_shared) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = now_ms;
        job->started_ns = now_ns;
        job->row.queued = 1e-9 * (double)(now_ns - job->submitted_ns);
        histogram_add(&intake->totals.waited, now_ns - job->submitted_ns);
    }
}

static void leave(Worker *worker, const Task *computation) {
    worker->running = NULL;
    worker->intake->slow_running -= is_slow(computation);
}

// It waits for room, of whatever kind, and then begins anew.
static void stall(JobManager *intake, Task *computation) {
    resolve_records_drop(&computation->inquiry);
    computation->next_stalled = intake->stalled;
    intake->stalled = computation;
}

static QueueEntry *wait_for_entry(Worker *worker) {
    JobManager *intake = worker->intake;
    QueueEntry *entry = NULL;
    while (!intake->is_closing && (jobs_is_behind(intake) || (entry = take_entry(worker)) == NULL))
        pthread_cond_wait(worker->is_spare ? &intake->spare_work : &intake->work, &intake->lock);
    return entry;
}

// With the lock held. False when the daemon ends.
static bool next_task(Worker *worker, WorkItem *task) {
    *task = (WorkItem){NULL, NULL, NULL};
    for (;;) {
        bool is_ended;
        QueueEntry *entry = wait_for_entry(worker);
        if (entry == NULL)
            return false;
        Task *computation = task_of(entry);
        if (computation->study == NULL) {
            begin_computation(worker, computation);
            if (study_must_wait(worker->intake, computation)) {
                leave(worker, computation);
                stall(worker->intake, computation);
                continue;
            }
            task->computation = computation;
            return true;
        }
        task->study = computation->study;
        task->shift = study_take(task->study, &is_ended);
        if (task->shift != NULL) {
            worker->study = task->study;
            worker->chunk = task->shift->chunk.first;
            begin_slow(worker->intake);
        }
        if (task->shift != NULL || is_ended)
            return true;
    }
}

// How long runs take beside what was foretold, for those who ask when to come back.
static void keep_pace(JobManager *intake, const Task *computation, const RunResult *findings) {
    const double foretold = computation->queued.seconds;
    const double ratio = 1e-9 * (double)(findings->ended_ns - findings->began_ns) / foretold;
    if (foretold > 0 && ratio > 1e-3 && ratio < 1e3)
        intake->pace += 0.1 * (ratio - intake->pace);
}

static void compute(Worker *worker, Task *computation, Problem *problem) {
    JobManager *intake = worker->intake;
    RunResult findings = {0};
    run(worker, computation, &findings, problem);
    const bool is_launched = findings.status == STATUS_OK && computation->study != NULL;
    const bool is_stalled = findings.status == STATUS_FULL;
    pthread_mutex_lock(&intake->lock);
    leave(worker, computation);
    if (findings.status == STATUS_OK && !is_launched)
        keep_pace(intake, computation, &findings);
    if (is_stalled)
        stall(intake, computation);
    pthread_mutex_unlock(&intake->lock);
    if (findings.status == STATUS_CANCELLED)
        task_abandon(intake, computation);
    else if (is_launched)
        study_start(worker, computation, &findings, problem);
    else if (!is_stalled)
        task_finish(intake, computation, &findings);
    run_result_clear(&findings);
}

void *worker_main(void *context) {
    Worker *worker = context;
    JobManager *intake = worker->intake;
    Problem problem; // large, but a thread's stack is larger
    WorkItem task;
    pthread_mutex_lock(&intake->lock);
    while (next_task(worker, &task)) {
        pthread_mutex_unlock(&intake->lock);
        if (task.computation != NULL)
            compute(worker, task.computation, &problem);
        else if (task.shift != NULL)
            study_work(worker, task.study, task.shift, &problem);
        else
            study_finish(worker, task.study, &problem);
        pthread_mutex_lock(&intake->lock);
    }
    pthread_mutex_unlock(&intake->lock);
    workspace_clear(&worker->workspace);
    return NULL;
}
