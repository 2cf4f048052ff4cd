// A worker takes computations from the queue, runs them, saves result and jobs in one transaction,
// and only then says that they are finished. A computation stopped because nobody wants it leaves
// no trace; one stopped because the daemon ends leaves its jobs unfinished in the store.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/base/bytes.h"
#include "server/base/clock.h"
#include "server/codec/write.h"
#include "server/jobs/documents.h"
#include "server/jobs/sweep.h"

// A computation's run, or the study after it, as a part of the whole.
typedef struct Part {
    Computation *computation;
    double from, share;
} Part;

static const double own_share = 0.05; // of the scene's own run where a study follows

static bool advance(void *context, double fraction) {
    const Part *part = context;
    const double share = fraction < 0 ? 0 : fraction > 1 ? 1 : fraction;
    atomic_store(&part->computation->progress,
                 (unsigned)((part->from + share * part->share) * 10000));
    return !atomic_load(&part->computation->is_stopped);
}

void findings_clear(Findings *findings) {
    outcome_drop(findings->outcome);
    fields_clear(study_answer_fields, &findings->answer);
    result_row_clear(&findings->result);
    free(findings->problem);
}

// Of one document; the database takes a billion.
enum { DOCUMENT_BYTES = 900000000 };

static char *take(Bytes *bytes, Status *status) {
    char *text = bytes_take(bytes, NULL);
    if (text == NULL)
        *status = STATUS_NO_MEMORY;
    return text;
}

static Status describe(const Computation *computation, Findings *findings) {
    const Outcome *outcome = findings->outcome;
    ResultRow *row = &findings->result;
    Bytes plan = {0}, summary = {0}, work = {0}, notes = {0}, energy = {0};
    Bytes impacts = {.most = DOCUMENT_BYTES}, psd = {.most = DOCUMENT_BYTES};
    Status status = STATUS_OK;
    document_plan(&plan, &outcome->plan);
    document_summary(&summary, &outcome->summary);
    document_work(&work, &outcome->work);
    document_warnings(&notes, &outcome->warnings);
    document_energy(&energy, &outcome->response.energy);
    document_impacts(&impacts, &outcome->response);
    if (outcome->spectrum.densities.count > 0)
        document_psd(&psd, &outcome->spectrum);
    text_fit(row->id, sizeof row->id, computation->result);
    row->engine = strdup(engine_version);
    row->scene = strdup(computation->scene);
    row->warnings = strdup(computation->warnings);
    row->plan = take(&plan, &status);
    row->summary = take(&summary, &status);
    row->work = take(&work, &status);
    row->notes = take(&notes, &status);
    row->energy = take(&energy, &status);
    row->impacts = take(&impacts, &status);
    if (outcome->spectrum.densities.count > 0)
        row->psd = take(&psd, &status);
    if (findings->answer.study != NULL) {
        Bytes study = {.most = DOCUMENT_BYTES};
        document_study(&study, &findings->answer);
        row->study = take(&study, &status);
    }
    row->count = outcome->response.count;
    row->sample_rate = outcome->response.sample_rate;
    row->created_unix_ms = clock_unix_ms();
    return row->engine == NULL || row->scene == NULL || row->warnings == NULL ? STATUS_NO_MEMORY
                                                                              : status;
}

void findings_fail(Findings *findings, Status status, const Problem *problem) {
    findings->status = status;
    text_fit(findings->detail, sizeof findings->detail, problem->detail);
    Bytes bytes = {.most = 1 << 20};
    write_problem(&bytes, problem, write_problem_code(status), NULL);
    free(findings->problem);
    findings->problem = bytes_take(&bytes, NULL);
}

static double thread_cpu(void *context) {
    (void)context;
    return 1e-9 * (double)clock_thread_cpu_ns();
}

static Status run_study(Worker *worker, Computation *computation, Findings *findings,
                        Problem *problem) {
    Part part = {computation, own_share, 1 - own_share};
    const Watch watch = {&part, advance};
    const StudyTools tools = {.limits = &worker->intake->settings.limits,
                              .watch = &watch,
                              .workspace = &worker->workspace,
                              .cpu = thread_cpu};
    if (study_kind(computation->inquiry.study) == &study_sweep)
        return sweep_open(worker, computation, findings, &watch, problem);
    return study_run(computation->inquiry.study, &computation->inquiry.simulation, &tools,
                     &findings->answer.study, problem);
}

static void run(Worker *worker, Computation *computation, Findings *findings, Problem *problem) {
    Intake *intake = worker->intake;
    // Only the scene's own series is ever wanted again.
    const bool has_study = computation->inquiry.study != NULL && !computation->is_again;
    Part part = {computation, 0, has_study ? own_share : 1};
    const Watch watch = {&part, advance};
    // A series that is computed again was within the limits when it was computed first.
    const SimulationLimits *limits = computation->is_again ? NULL : &intake->settings.limits;
    problem_clear(problem);
    findings->began_ns = clock_monotonic_ns();
    const int64_t run_ns = clock_thread_cpu_ns();
    Status status = simulation_run(&computation->inquiry.simulation, limits, &watch,
                                   &worker->workspace, &findings->outcome, problem);
    const int64_t study_ns = clock_thread_cpu_ns();
    if (status == STATUS_OK)
        totals_run(&intake->totals, findings->outcome, study_ns - run_ns);
    if (status == STATUS_OK && has_study) {
        status = run_study(worker, computation, findings, problem);
        totals_study(&intake->totals, clock_thread_cpu_ns() - study_ns);
    }
    findings->ended_ns = clock_monotonic_ns();
    if (status == STATUS_OK && !computation->is_again) {
        status = describe(computation, findings);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the result's documents");
    }
    if (status != STATUS_OK)
        findings_fail(findings, status, problem);
    findings->status = status;
}

// With the lock held: the rows as they go to the store, of jobs that have none yet. Returns how
// many.
static size_t close_jobs(Computation *computation, const Findings *findings, Job **jobs,
                         const JobRow **rows, size_t most) {
    size_t count = 0;
    for (Job *job = computation->jobs; job != NULL && count < most; job = job->next_shared) {
        if (job->is_closing)
            continue;
        job->is_closing = true;
        job->closing = job->row;
        JobRow *row = &job->closing;
        row->state = findings->status == STATUS_OK ? JOB_SUCCESSFUL : JOB_FAILED;
        row->finished_unix_ms = clock_unix_ms();
        row->run = 1e-9 * (double)(findings->ended_ns - findings->began_ns);
        row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
        row->problem = findings->problem == NULL ? NULL : strdup(findings->problem);
        jobs[count] = job_hold(job);
        rows[count++] = row;
    }
    return count;
}

bool status_is_passing(Status status) {
    return status == STATUS_IO || status == STATUS_BUSY || status == STATUS_NO_MEMORY;
}

// A result that can never be saved, because it is too large, makes its jobs failed ones.
static Status save(Intake *intake, const Findings *findings, Job *const *jobs,
                   const JobRow *const *rows, size_t count, Problem *problem) {
    const ResultRow *result = findings->status == STATUS_OK ? &findings->result : NULL;
    const Status status = store_result_save(intake->store, result, rows, count, problem);
    if (status == STATUS_OK || status_is_passing(status))
        return status;
    for (size_t i = 0; i < count; i++) {
        Bytes bytes = {.most = 1 << 20};
        write_problem(&bytes, problem, write_problem_code(problem->status), NULL);
        free(jobs[i]->closing.problem);
        jobs[i]->closing.problem = bytes_take(&bytes, NULL);
        jobs[i]->closing.state = JOB_FAILED;
    }
    problem_clear(problem);
    return store_result_save(intake->store, NULL, rows, count, problem);
}

// With the lock held: the jobs are what the store says they are. If it could not be told, they are
// failed here and unfinished there: the next start computes them again.
static void publish(const Findings *findings, Job **jobs, size_t count, Status saved,
                    const Problem *problem) {
    for (size_t i = 0; i < count; i++) {
        Job *job = jobs[i];
        job->row = job->closing;
        if (job->row.state == JOB_SUCCESSFUL && saved == STATUS_OK) {
            job->plan = findings->result.plan == NULL ? NULL : strdup(findings->result.plan);
            job->summary =
                findings->result.summary == NULL ? NULL : strdup(findings->result.summary);
            job->work = findings->result.work == NULL ? NULL : strdup(findings->result.work);
            job->notes = findings->result.notes == NULL ? NULL : strdup(findings->result.notes);
        }
        if (saved != STATUS_OK) {
            Bytes bytes = {.most = 1 << 20};
            write_problem(&bytes, problem, write_problem_code(problem->status), NULL);
            free(job->row.problem);
            job->row.problem = bytes_take(&bytes, NULL);
            job->row.state = JOB_FAILED;
            intake_release(job);
        } else {
            intake_retire(job);
        }
        totals_ended(&job->intake->totals, job->row.state, false);
        wakers_call(&job->wakers);
        job_drop(job); // close_jobs's hold
    }
}

static void tell_askers(Intake *intake, Computation *computation, const Findings *findings) {
    if (computation->askers.count > 0 && findings->status != STATUS_OK) {
        Failure *failure = &intake->failures[intake->next_failure++ % OUTCOME_FAILURES];
        text_fit(failure->result, sizeof failure->result, computation->result);
        text_fit(failure->detail, sizeof failure->detail, findings->detail);
        failure->status = findings->status;
    }
    wakers_call(&computation->askers);
}

void computation_finish(Intake *intake, Computation *computation, const Findings *findings,
                        Problem *problem) {
    enum { BATCH = 256 };
    Job *jobs[BATCH];
    const JobRow *rows[BATCH];
    for (;;) {
        // Others may join until the store has answered; they get a turn of their own.
        pthread_mutex_lock(&intake->lock);
        const size_t count = close_jobs(computation, findings, jobs, rows, BATCH);
        if (count == 0)
            break;
        pthread_mutex_unlock(&intake->lock);
        problem_clear(problem);
        const Status saved = save(intake, findings, jobs, rows, count, problem);
        if (saved != STATUS_OK)
            fprintf(stderr, "impactd: the result %s could not be saved: %s\n", computation->result,
                    problem->detail);
        pthread_mutex_lock(&intake->lock);
        // What is in the cache is known, so it must be in the store.
        if (findings->outcome != NULL && saved == STATUS_OK &&
            jobs[0]->closing.state == JOB_SUCCESSFUL)
            cache_put(intake->cache, computation->result, findings->outcome);
        publish(findings, jobs, count, saved, problem);
        pthread_mutex_unlock(&intake->lock);
    }
    if (findings->outcome != NULL && computation->is_again)
        cache_put(intake->cache, computation->result, findings->outcome);
    index_remove(intake->in_flight, &computation->indexed);
    tell_askers(intake, computation, findings);
    while (computation->jobs != NULL) {
        Job *job = computation->jobs;
        computation->jobs = job->next_shared;
        job->computation = NULL;
        job->next_shared = NULL;
        job_drop(job); // the computation's hold
    }
    pthread_mutex_unlock(&intake->lock);
}

void computation_abandon(Intake *intake, Computation *computation) {
    index_remove(intake->in_flight, &computation->indexed);
    while (computation->jobs != NULL) {
        Job *job = computation->jobs;
        computation->jobs = job->next_shared;
        job->computation = NULL;
        job->next_shared = NULL;
        intake_retire(job);
        wakers_call(&job->wakers);
        job_drop(job); // the computation's hold
    }
    wakers_call(&computation->askers);
}

// Of a worker's time ordinary jobs get so much before a sweep that waits has its turn, and that so
// much at least.
static const int64_t jobs_turn_ns = 50000000, sweep_turn_ns = 10000000;

static Computation *take_computation(Worker *worker) {
    Intake *intake = worker->intake;
    Computation *computation = intake->first;
    intake->first = computation->next;
    if (intake->first == NULL)
        intake->last = NULL;
    intake->queued--;
    computation->next = NULL;
    computation->is_running = true;
    worker->running = computation;
    const int64_t now_ms = clock_unix_ms(), now_ns = clock_monotonic_ns();
    for (Job *job = computation->jobs; job != NULL; job = job->next_shared) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = now_ms;
        job->started_ns = now_ns;
        job->row.queued = 1e-9 * (double)(now_ns - job->submitted_ns);
        histogram_add(&intake->totals.waited, now_ns - job->submitted_ns);
    }
    return computation;
}

// What a worker does next: a computation, a part of a sweep, or the end of one (no part).
typedef struct Task {
    Computation *computation;
    SweepRun *sweep;
    SweepPart *part;
} Task;

static void wait_for_work(Intake *intake, int64_t until_ns) {
    if (until_ns == 0) {
        pthread_cond_wait(&intake->work, &intake->lock);
        return;
    }
    const struct timespec until = {until_ns / 1000000000, until_ns % 1000000000};
    (void)pthread_cond_timedwait(&intake->work, &intake->lock, &until);
}

// With the lock held. False when the daemon ends.
static bool next_task(Worker *worker, Task *task) {
    Intake *intake = worker->intake;
    *task = (Task){NULL, NULL, NULL};
    worker->sweep = NULL;
    while (!intake->is_closing) {
        int64_t until_ns = 0;
        const bool is_jobs_turn = intake->first != NULL && worker->served_ns < jobs_turn_ns;
        if (!is_jobs_turn && (task->sweep = sweep_next(intake, &task->part, &until_ns)) != NULL) {
            worker->sweep = task->sweep;
            worker->chunk = task->part != NULL ? task->part->chunk : SIZE_MAX;
            return true;
        }
        if (intake->first != NULL) {
            task->computation = take_computation(worker);
            return true;
        }
        wait_for_work(intake, until_ns);
    }
    return false;
}

static void compute(Worker *worker, Computation *computation, Problem *problem) {
    Intake *intake = worker->intake;
    Findings findings = {0};
    const int64_t began_ns = clock_monotonic_ns();
    run(worker, computation, &findings, problem);
    worker->served_ns += clock_monotonic_ns() - began_ns;
    const bool is_launched = findings.status == STATUS_OK && computation->sweep != NULL;
    if (findings.status != STATUS_CANCELLED && !is_launched)
        computation_finish(intake, computation, &findings, problem);
    pthread_mutex_lock(&intake->lock);
    worker->running = NULL;
    if (findings.status == STATUS_CANCELLED)
        computation_abandon(intake, computation);
    pthread_mutex_unlock(&intake->lock);
    if (is_launched) {
        sweep_launch(intake, computation, &findings, problem); // takes both
        return;
    }
    computation_free(computation);
    findings_clear(&findings);
}

void *worker_main(void *context) {
    Worker *worker = context;
    Intake *intake = worker->intake;
    Problem problem; // large, but a thread's stack is larger
    Task task;
    pthread_mutex_lock(&intake->lock);
    while (next_task(worker, &task)) {
        pthread_mutex_unlock(&intake->lock);
        if (task.computation != NULL) {
            compute(worker, task.computation, &problem);
        } else if (task.part != NULL) {
            const bool is_due = worker->served_ns >= jobs_turn_ns;
            worker->served_ns = 0;
            sweep_work(worker, task.sweep, task.part, is_due ? sweep_turn_ns : 0, &problem);
        } else {
            sweep_end(intake, task.sweep, &problem);
        }
        pthread_mutex_lock(&intake->lock);
    }
    pthread_mutex_unlock(&intake->lock);
    workspace_clear(&worker->workspace);
    return NULL;
}
