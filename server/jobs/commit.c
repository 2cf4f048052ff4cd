// Every write of a job: its insertion, its last state together with its result, its cancellation.
// None is waited for but by job_insert_now:
//
//     worker -- task_finish --> one transaction: result and jobs -- commit_done --> finished
//                                  ^                                  |
//                                  +-- jobs that joined meanwhile ----+
//
// A job is finished when the database has its last state, and a result is cached when the database
// has it. What cannot be written for want of space waits in memory and is retried by
// jobs_retry_writes. Nothing is allocated on the way, so that no lack of memory loses a job. What
// is on the way is bounded: workers wait.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"
#include "server/util/process.h"

// Tasks on the way to the database, and the bytes of their results.
enum { SAVING_MAX = 4096, SAVING_BYTES = 256 << 20 };

bool jobs_is_behind(const JobManager *manager) {
    return manager->saving >= SAVING_MAX || manager->saving_bytes >= SAVING_BYTES;
}

bool status_is_transient(Status status) {
    return status == STATUS_IO || status == STATUS_FULL || status == STATUS_BUSY ||
           status == STATUS_NO_MEMORY;
}

char *problem_document(const Problem *problem) {
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, encode_problem_code(problem->status), NULL);
    return bytes_take(&bytes, NULL);
}

// A problem document with a status and a detail.
static char *commit_problem_document(Status status, const char *detail) {
    Problem problem;
    problem_clear(&problem);
    problem_set(&problem, status, "%s", detail);
    return problem_document(&problem);
}

void run_result_fail(RunResult *run_result, Status status, Problem *problem) {
    problem_set(problem, status, "%s", status_title(status)); // where there is none
    run_result->status = status;
    text_fit(run_result->detail, sizeof run_result->detail, problem->detail);
    free(run_result->problem);
    run_result->problem = problem_document(problem);
}

Status run_result_add_to_study(RunResult *run_result, Problem *problem) {
    Bytes study = {.most = DOCUMENT_BYTES};
    // What is unknown is left out, so that it can be read again.
    encode_item(&study, study_answer_fields, &run_result->answer, WRITE_SCENE);
    run_result->result.study = bytes_take(&study, NULL);
    run_result->result.created_unix_ms = clock_unix_ms();
    return study_result(status_made(run_result->result.study != NULL), problem);
}

// With the lock held: the jobs that wait, in their last state. One whose insertion is under way
// waits for the next transaction.
static void commit_collect(Task *task) {
    const RunResult *run = &task->run_result;
    const int64_t now_ms = clock_unix_ms(), now_ns = clock_monotonic_ns();
    for (Job **at = &task->jobs, *job; (job = *at) != NULL;) {
        if (job->is_inserting) {
            at = &job->next_shared;
            continue;
        }
        *at = job->next_shared;
        JobRow *row = &job->written;
        *row = job->row;
        row->is_unsaved = !job->is_durable;
        row->state = run->status == STATUS_OK ? JOB_SUCCESSFUL : JOB_FAILED;
        row->finished_unix_ms = now_ms;
        row->run = 1e-9 * (double)(run->ended_ns - run->began_ns);
        row->total = 1e-9 * (double)(now_ns - job->submitted_ns);
        row->problem = run->problem; // borrowed
        row->next = task->committing != NULL ? &task->committing->written : NULL;
        job->is_ending = true;
        job->next_shared = task->committing;
        task->committing = job;
    }
}

static void commit_done(void *context, Status status, const char *detail);

// With the lock held.
static void commit_enqueue(Task *task) {
    const bool has_result = task->run_result.status == STATUS_OK && !task->is_saved;
    task->commit = (ResultCommit){.result = has_result ? &task->run_result.result : NULL,
                                  .jobs = &task->committing->written};
    task->write.done = (WriteDone){commit_done, task};
    task->manager->writes++;
    db_result_post(task->manager->db, &task->commit, &task->write);
}

void commit_continue(Task *task) {
    JobManager *manager = task->manager;
    const RunResult *run = &task->run_result;
    if (task->committing != NULL || task->is_waiting)
        return;
    commit_collect(task);
    if (task->committing != NULL)
        commit_enqueue(task);
    if (task->committing != NULL || task->jobs != NULL)
        return; // when these are written, or the others inserted
    if (task->result_waiters.count > 0 && run->status != STATUS_OK) {
        Failure *failure = &manager->failures[manager->next_failure++ % OUTCOME_FAILURES];
        text_fit(failure->result, sizeof failure->result, task->result);
        text_fit(failure->detail, sizeof failure->detail, run->detail);
        failure->status = run->status;
    }
    task_release(task);
    if (jobs_is_behind(manager)) {
        pthread_cond_broadcast(&manager->work);
        pthread_cond_broadcast(&manager->spare_work);
    }
    manager->saving--;
    manager->saving_bytes -= task->saving_bytes;
    task_free(task);
}

// With the lock held: one of the jobs whose end was written, or could not be.
static void commit_end_job(Task *task, Job *job, Status status, const char *detail) {
    JobManager *manager = task->manager;
    const RunResult *run = &task->run_result;
    job->is_ending = false;
    if (status != STATUS_OK && job->is_durable &&
        (status_is_transient(status) || manager->is_closing)) {
        job->next_shared = task->jobs; // as it was
        task->jobs = job;
        return;
    }
    job->task = NULL;
    job->next_shared = NULL;
    if (status != STATUS_OK && !job->is_durable) {
        job_refuse(job, status, detail); // it was not accepted: its client gets this error
    } else {
        // What commit_collect set; the rest never changes, and is read without the lock.
        job->row.state = job->written.state;
        job->row.finished_unix_ms = job->written.finished_unix_ms;
        job->row.run = job->written.run;
        job->row.total = job->written.total;
        job->row.problem = run->problem != NULL ? strdup(run->problem) : NULL;
        job->is_durable = status == STATUS_OK;
        if (status == STATUS_OK) {
            if (job->row.state == JOB_SUCCESSFUL)
                job->summary = result_summary_ref(task->summary);
            job_retire(job);
        } else { // until the next start, which computes it again
            free(job->row.problem);
            job->row.problem = commit_problem_document(status, detail);
            job->row.state = JOB_FAILED;
            job_release(job);
        }
        job_metrics_ended(&manager->metrics, job->row.state, false);
        subscribers_call(&job->subscribers);
    }
    job_unref(job); // the task's
}

static void commit_log(Task *task, Status status, const char *detail) {
    if (status != STATUS_OK && !task->is_logged) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the result %s could not be saved: %s", task->result, detail);
        log_write(&line);
        bytes_clear(&line);
    }
    task->is_logged = status != STATUS_OK;
}

// With the lock held: a result that can never be saved, because it is too large, makes its jobs
// failed ones.
static void commit_fail(Task *task, Status status, const char *detail) {
    RunResult *run = &task->run_result;
    free(run->problem);
    run->problem = commit_problem_document(status, detail);
    run->status = status;
    text_fit(run->detail, sizeof run->detail, detail);
    for (Job *job = task->committing; job != NULL; job = job->next_shared) {
        job->written.problem = run->problem;
        job->written.state = JOB_FAILED;
    }
    commit_enqueue(task);
}

static void commit_done(void *context, Status status, const char *detail) {
    Task *task = context;
    JobManager *manager = task->manager;
    RunResult *run = &task->run_result;
    commit_log(task, status, detail);
    pthread_mutex_lock(&manager->lock);
    if (status != STATUS_OK && !status_is_transient(status) && run->status == STATUS_OK) {
        commit_fail(task, status, detail);
    } else {
        // What is cached must be in the database.
        if (status == STATUS_OK && run->status == STATUS_OK) {
            task->is_saved = true;
            cache_put(manager, task->result, run->outcome, task->summary);
        }
        while (task->committing != NULL) {
            Job *job = task->committing;
            task->committing = job->next_shared;
            commit_end_job(task, job, status, detail);
        }
        if (status == STATUS_OK || task->jobs == NULL) {
            commit_continue(task);
        } else if (!manager->is_closing) {
            task_wait(task);
        } // else jobs_stop releases it
    }
    jobs_end_write(manager);
    pthread_mutex_unlock(&manager->lock);
}

// Of memory, about.
static size_t run_result_bytes(const RunResult *run) {
    const ResultRow *row = &run->result;
    const char *const texts[] = {row->scene, row->plan, row->summary, row->study};
    size_t bytes =
        sizeof(Task) + row->outcome.size + (run->outcome != NULL ? outcome_bytes(run->outcome) : 0);
    for (size_t i = 0; i < COUNT(texts); i++)
        bytes += texts[i] != NULL ? strlen(texts[i]) : 0;
    return bytes;
}

void task_finish(JobManager *manager, Task *task, RunResult *run_result) {
    RunResult *run = &task->run_result;
    Outcome *outcome = run_result->outcome != NULL ? outcome_ref(run_result->outcome) : NULL;
    const double seconds = run_result->seconds;
    char result[sizeof task->result];
    memcpy(result, task->result, sizeof result);
    *run = *run_result;
    *run_result = (RunResult){0};
    task->saving_bytes = run_result_bytes(run);
    if (run->status == STATUS_OK && !task->recompute_only)
        task->summary = result_summary_new(&run->result);
    // Only the series was wanted: the result is saved already, unless it was deleted meanwhile.
    const uint64_t deletions = cache_deletions(manager);
    const bool is_cached =
        outcome != NULL && task->recompute_only && db_result_exists(manager->db, task->result);
    pthread_mutex_lock(&manager->lock);
    manager->saving++;
    manager->saving_bytes += task->saving_bytes;
    task->is_saving = true;
    if (is_cached && deletions == manager->deletions)
        cache_put(manager, task->result, outcome, NULL);
    commit_continue(task);
    pthread_mutex_unlock(&manager->lock);
    if (outcome != NULL)
        jobs_keep_series(manager, result, outcome, seconds);
    outcome_unref(outcome);
}

void task_abandon(JobManager *manager, Task *task) {
    pthread_mutex_lock(&manager->lock);
    task_release(task);
    pthread_mutex_unlock(&manager->lock);
    task_free(task);
}

static void cancel_done(void *context, Status status, const char *detail) {
    Job *job = context;
    JobManager *manager = job->manager;
    pthread_mutex_lock(&manager->lock);
    job->is_durable = status == STATUS_OK;
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    // Until the database has it, it is found here.
    if (status == STATUS_OK) {
        job_retire(job);
    } else if (!manager->is_closing) {
        job->next_retry = manager->retry_cancels;
        manager->retry_cancels = job_ref(job);
    }
    subscribers_call(&job->subscribers);
    jobs_end_write(manager);
    pthread_mutex_unlock(&manager->lock);
    job_unref(job);
}

// With the lock held, of a cancelled job.
static void cancel_enqueue(Job *job) {
    job->written = job->row;
    job->written.is_unsaved = !job->is_durable;
    job->is_durable = false;
    job->write.done = (WriteDone){cancel_done, job_ref(job)};
    job->manager->writes++;
    db_job_update_post(job->manager->db, &job->written, &job->write);
}

// With the lock held: the job as it is to be inserted.
static void insert_begin(Job *job) {
    job->is_inserting = true;
    job->written = job->row;
    if (!job_state_is_final(job->row.state))
        job->written.state = JOB_ACCEPTED; // the database knows no running jobs
}

// With the lock held.
static void insert_end(Job *job, Status status, const char *detail) {
    Task *task = job->task != NULL && job->task->is_saving ? job->task : NULL;
    job->is_inserting = false;
    job->is_durable = status == STATUS_OK;
    if (status == STATUS_OK) {
        free(job->row.scene);
        job->row.scene = NULL;
    }
    if (job->row.state == JOB_DISMISSED) {
        cancel_enqueue(job);
    } else if (status != STATUS_OK) {
        job_detach(job);
        job_refuse(job, status, detail);
    } else {
        subscribers_call(&job->subscribers);
    }
    if (task != NULL)
        commit_continue(task);
}

static void insert_done(void *context, Status status, const char *detail) {
    Job *job = context;
    JobManager *manager = job->manager;
    pthread_mutex_lock(&manager->lock);
    insert_end(job, status, detail);
    jobs_end_write(manager);
    pthread_mutex_unlock(&manager->lock);
    job_unref(job);
}

void job_insert_later(Job *job) {
    insert_begin(job);
    job->write.done = (WriteDone){insert_done, job_ref(job)};
    job->manager->writes++;
    db_job_post(job->manager->db, &job->written, &job->write);
}

Status job_insert_now(Job *job, Problem *problem) {
    JobManager *manager = job->manager;
    pthread_mutex_lock(&manager->lock);
    insert_begin(job);
    pthread_mutex_unlock(&manager->lock);
    const Status status = db_job_add(manager->db, &job->written, problem);
    pthread_mutex_lock(&manager->lock);
    insert_end(job, status, status != STATUS_OK ? problem->detail : "");
    pthread_mutex_unlock(&manager->lock);
    return status;
}

void job_save(Job *job) {
    if (job->manager == NULL)
        return;
    pthread_mutex_lock(&job->manager->lock);
    if (!job->is_durable && !job->is_inserting && !job->is_ending && job->refusal == STATUS_OK &&
        !job_state_is_final(job->row.state))
        job_insert_later(job);
    pthread_mutex_unlock(&job->manager->lock);
}

static Status cancel_refuse(const char *id, int state, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT,
                       "the job %.40s cannot be dismissed: it is %s already", id,
                       job_state_names[state]);
}

// With the lock held.
static Status cancel_live(Job *job, Problem *problem) {
    JobRow *row = &job->row;
    if (job->is_ending || job_state_is_final(row->state))
        return cancel_refuse(row->id, job->is_ending ? job->written.state : row->state, problem);
    const int64_t now_ns = clock_monotonic_ns();
    row->state = JOB_DISMISSED;
    row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(now_ns - job->submitted_ns);
    if (job->started_ns > 0)
        row->run = 1e-9 * (double)(now_ns - job->started_ns);
    else
        row->queued = row->total;
    job_detach(job);
    job_release(job);
    if (!job->is_inserting)
        cancel_enqueue(job); // else insert_done does
    else
        job->is_durable = false;
    subscribers_call(&job->subscribers);
    job_metrics_ended(&job->manager->metrics, JOB_DISMISSED, false);
    return STATUS_OK;
}

Status jobs_cancel(JobManager *manager, const char *id, Job **cancelled, Problem *problem) {
    Job *job;
    *cancelled = NULL;
    TRY(jobs_find(manager, id, &job, problem));
    Status status;
    if (job->manager == NULL) {
        status = cancel_refuse(id, job->row.state, problem);
    } else {
        pthread_mutex_lock(&manager->lock);
        Task *task = job->task != NULL && job->task->is_saving ? job->task : NULL;
        status = cancel_live(job, problem);
        if (status == STATUS_OK && task != NULL)
            commit_continue(task);
        pthread_mutex_unlock(&manager->lock);
    }
    if (status == STATUS_OK)
        *cancelled = job;
    else
        job_unref(job);
    return status;
}

void commit_retry_cancels(JobManager *manager) {
    for (Job *job; (job = manager->retry_cancels) != NULL; job_unref(job)) {
        manager->retry_cancels = job->next_retry;
        cancel_enqueue(job);
    }
}
