// What has run goes to the store without anyone waiting: result and jobs in one transaction,
// posted.
//
//     worker ---- jobs_save ----> store ---- saved ----> finished, for all who asked
//                     ^                          |
//                     +---- who joined since ----+
//
// Only when the store has them are the jobs finished, and the result known. Until then others may
// join the computation; they get a turn of their own. What is on the way is bounded: workers wait.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/study.h"
#include "server/json/encode.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"
#include "server/util/log.h"

// Computations on the way to the store, and the bytes of what they came to.
enum { SAVING_MAX = 4096, SAVING_BYTES = 256 << 20 };

typedef struct Saving {
    JobManager *manager;
    Task *task;
    RunResult run_result;
    ResultSummary *head; // of a successful one
    size_t bytes;
    bool is_saved;       // the result is in the store
    bool is_told;        // that it could not be saved
    struct Saving *next; // of those that wait for room
    Job **jobs;          // held: those whose rows are on the way
    const JobRow **rows;
    size_t count, room;
} Saving;

static void saved(void *context, Status status, const char *detail);

bool jobs_is_behind(const JobManager *manager) {
    return manager->saving >= SAVING_MAX || manager->saving_bytes >= SAVING_BYTES;
}

static char *problem_text(Status status, const char *detail) {
    Problem *problem = malloc(sizeof *problem);
    if (problem == NULL)
        return NULL;
    Bytes bytes = {.most = 1 << 20};
    problem_clear(problem);
    problem_set(problem, status, "%s", detail);
    encode_problem(&bytes, problem, encode_problem_code(status), NULL);
    free(problem);
    return bytes_take(&bytes, NULL);
}

static bool make_room(Saving *saving, size_t count) {
    if (count <= saving->room)
        return true;
    Job **jobs = realloc(saving->jobs, count * sizeof *jobs);
    if (jobs == NULL)
        return false;
    saving->jobs = jobs;
    const JobRow **rows = realloc(saving->rows, count * sizeof *rows);
    if (rows == NULL)
        return false;
    saving->rows = rows;
    saving->room = count;
    return true;
}

// With the lock held: the rows as they go to the store, of at most so many jobs that have none on
// the way.
static void close_jobs(Saving *saving, size_t most) {
    const RunResult *run_result = &saving->run_result;
    const int64_t now_ms = clock_unix_ms(), now_ns = clock_monotonic_ns();
    size_t count = 0;
    for (Job *job = saving->task->jobs; job != NULL; job = job->next_shared)
        count += !job->is_closing && count < most;
    saving->count = 0;
    if (!make_room(saving, count))
        count = saving->room; // the others get the next turn
    for (Job *job = saving->task->jobs; job != NULL && saving->count < count;
         job = job->next_shared) {
        if (job->is_closing)
            continue;
        jobs_withdraw(job);
        job->is_closing = true;
        job->final_row = job->row;
        JobRow *row = &job->final_row;
        row->is_unsaved = !job->is_kept;
        row->state = run_result->status == STATUS_OK ? JOB_SUCCESSFUL : JOB_FAILED;
        row->finished_unix_ms = now_ms;
        row->run = 1e-9 * (double)(run_result->ended_ns - run_result->began_ns);
        row->total = 1e-9 * (double)(now_ns - job->submitted_ns);
        row->problem = run_result->problem == NULL ? NULL : strdup(run_result->problem);
        saving->jobs[saving->count] = job_ref(job);
        saving->rows[saving->count++] = row;
    }
}

// With the lock held.
static void tell_askers(const Saving *saving) {
    JobManager *manager = saving->manager;
    Task *task = saving->task;
    if (task->result_waiters.count > 0 && saving->run_result.status != STATUS_OK) {
        Failure *failure = &manager->failures[manager->next_failure++ % OUTCOME_FAILURES];
        text_fit(failure->result, sizeof failure->result, task->result);
        text_fit(failure->detail, sizeof failure->detail, saving->run_result.detail);
        failure->status = saving->run_result.status;
    }
    subscribers_call(&task->result_waiters);
}

// With the lock held: nobody waits for it any more. saving_free is to follow without the lock.
static void end(Saving *saving) {
    JobManager *manager = saving->manager;
    Task *task = saving->task;
    hashmap_remove(manager->in_flight, &task->indexed);
    tell_askers(saving);
    while (task->jobs != NULL) {
        Job *job = task->jobs;
        task->jobs = job->next_shared;
        job->task = NULL;
        job->next_shared = NULL;
        job_unref(job); // the computation's hold
    }
    const bool was_behind = jobs_is_behind(manager);
    manager->saving--;
    manager->saving_bytes -= saving->bytes;
    if (was_behind) {
        pthread_cond_broadcast(&manager->work);
        pthread_cond_broadcast(&manager->spare_work);
    }
}

static void saving_free(Saving *saving) {
    task_free(saving->task);
    run_result_clear(&saving->run_result);
    result_summary_unref(saving->head);
    free(saving->jobs);
    free(saving->rows);
    free(saving);
}

bool status_is_transient(Status status) {
    return status == STATUS_IO || status == STATUS_FULL || status == STATUS_BUSY ||
           status == STATUS_NO_MEMORY;
}

// With the lock held: the jobs are what the store says they are. If it could not be told of their
// end, they go on running where `may_wait`; otherwise they are failed here and unfinished there:
// the next start computes them again. If it never had them, they never were.
static void publish(Saving *saving, Status status, const char *detail, bool may_wait) {
    for (size_t i = 0; i < saving->count; i++) {
        Job *job = saving->jobs[i];
        if (status != STATUS_OK && !job->is_kept) {
            free(job->final_row.problem);
            job->final_row.problem = NULL;
            jobs_refuse(job, status, detail);
        } else if (status != STATUS_OK && may_wait) {
            free(job->final_row.problem);
            job->final_row.problem = NULL;
            job->is_closing = false;
        } else {
            job->row = job->final_row;
            job->row.is_unsaved = false;
            if (status != STATUS_OK) {
                free(job->row.problem);
                job->row.problem = problem_text(status, detail);
                job->row.state = JOB_FAILED;
                jobs_release(job);
            } else {
                if (job->row.state == JOB_SUCCESSFUL)
                    job->head = result_summary_ref(saving->head);
                job->is_kept = true;
                jobs_retire(job);
            }
            job_metrics_ended(&saving->manager->totals, job->row.state, false);
            subscribers_call(&job->subscribers);
            subscribers_call(&job->save_waiters);
        }
        job_unref(job); // close_jobs's hold
    }
    saving->count = 0;
}

// A result that can never be saved, because it is too large, makes its jobs failed ones.
static void give_up(Saving *saving, Status status, const char *detail) {
    RunResult *run_result = &saving->run_result;
    free(run_result->problem);
    run_result->problem = problem_text(status, detail);
    run_result->status = status;
    text_fit(run_result->detail, sizeof run_result->detail, detail);
    for (size_t i = 0; i < saving->count; i++) {
        JobRow *row = &saving->jobs[i]->final_row;
        free(row->problem);
        row->problem = run_result->problem == NULL ? NULL : strdup(run_result->problem);
        row->state = JOB_FAILED;
    }
}

// With the lock held: whether others will have run in a moment, to be saved together with this.
static bool is_followed(const JobManager *manager) {
    static const double moment = 5e-3; // [s]
    return queue_seconds(manager->queue) < moment * (double)queue_count(manager->queue);
}

// With the lock held.
static Status post(Saving *saving) {
    const bool has_result = saving->run_result.status == STATUS_OK && !saving->is_saved;
    const WriteDone done = {saved, saving};
    const Status status = db_result_post(
        saving->manager->db, has_result ? &saving->run_result.result : NULL, saving->rows,
        saving->count, is_followed(saving->manager) ? STORE_SOON : STORE_NOW, &done);
    if (status == STATUS_OK)
        saving->manager->posted++;
    return status;
}

// With the lock held: what waits is on the way to the store, or else this is at its end (false).
static bool go_on(Saving *saving) {
    for (;;) {
        close_jobs(saving, SIZE_MAX);
        if (saving->count == 0)
            return false;
        const Status status = post(saving);
        if (status == STATUS_OK)
            return true;
        publish(saving, status, "no memory to save the job", false);
    }
}

// With the lock held: whether it is tried again when there may be room.
static bool wait_for_room(Saving *saving) {
    JobManager *manager = saving->manager;
    if (saving->task->jobs == NULL || manager->is_closing)
        return false;
    saving->next = manager->retry_commits;
    manager->retry_commits = saving;
    return true;
}

// The store has answered; its writer's thread.
static void saved(void *context, Status status, const char *detail) {
    Saving *saving = context;
    JobManager *manager = saving->manager;
    if (status != STATUS_OK && !saving->is_told) {
        Bytes line = {.most = 1024};
        bytes_format(&line, "the result %s could not be saved: %s", saving->task->result, detail);
        log_write(&line);
        bytes_clear(&line);
    }
    saving->is_told = status != STATUS_OK;
    pthread_mutex_lock(&manager->lock);
    bool goes_on;
    if (status != STATUS_OK && !status_is_transient(status) &&
        saving->run_result.status == STATUS_OK) {
        give_up(saving, status, detail);
        goes_on = post(saving) == STATUS_OK;
        if (!goes_on) {
            publish(saving, STATUS_NO_MEMORY, "no memory to save the job", false);
            goes_on = go_on(saving);
        }
    } else if (status_is_transient(status)) {
        publish(saving, status, detail, !manager->is_closing);
        goes_on = wait_for_room(saving) || go_on(saving);
    } else {
        // What is in the cache is known, so it must be in the store.
        if (status == STATUS_OK && saving->run_result.status == STATUS_OK) {
            saving->is_saved = true;
            cache_put(manager->cache, saving->task->result, saving->run_result.outcome,
                      saving->head);
        }
        publish(saving, status, detail, false);
        goes_on = go_on(saving);
    }
    if (!goes_on)
        end(saving);
    jobs_settle(manager);
    pthread_mutex_unlock(&manager->lock);
    if (!goes_on)
        saving_free(saving);
}

void jobs_retry_sweep(JobManager *manager) {
    Saving *ended = NULL, *next;
    pthread_mutex_lock(&manager->lock);
    Saving *saving = manager->retry_commits;
    manager->retry_commits = NULL;
    for (; saving != NULL; saving = next) {
        next = saving->next;
        if (go_on(saving))
            continue;
        end(saving);
        saving->next = ended;
        ended = saving;
    }
    jobs_retry_dismissed(manager);
    studies_resume(manager);
    pthread_mutex_unlock(&manager->lock);
    for (; ended != NULL; ended = next) {
        next = ended->next;
        saving_free(ended);
    }
}

void jobs_abandon_delayed(JobManager *manager) {
    while (manager->retry_commits != NULL) {
        Saving *saving = manager->retry_commits;
        manager->retry_commits = saving->next;
        for (Job *job = saving->task->jobs; job != NULL; job = job->next_shared) {
            jobs_retire(job);
            subscribers_call(&job->subscribers);
        }
        end(saving);
        saving_free(saving);
    }
}

static size_t text_bytes(const char *text) {
    return text != NULL ? strlen(text) : 0;
}

static size_t run_result_bytes(const RunResult *run_result) {
    const ResultRow *row = &run_result->result;
    return sizeof(Saving) + (run_result->outcome != NULL ? outcome_bytes(run_result->outcome) : 0) +
           text_bytes(row->scene) + text_bytes(row->plan) + text_bytes(row->summary) +
           row->outcome.size + text_bytes(row->study);
}

// With the lock held: without memory for a Saving its jobs are failed here, and computed again at
// the next start.
static void lose(JobManager *manager, Task *task, RunResult *run_result) {
    Job *jobs[1];
    const JobRow *rows[1];
    Saving saving = {.manager = manager,
                     .task = task,
                     .run_result = *run_result,
                     .jobs = jobs,
                     .rows = rows,
                     .room = 1};
    manager->saving++;
    for (;;) {
        close_jobs(&saving, COUNT(jobs));
        if (saving.count == 0)
            break;
        publish(&saving, STATUS_NO_MEMORY, "no memory to save the job", false);
    }
    end(&saving);
}

void jobs_save(JobManager *manager, Task *task, RunResult *run_result) {
    Saving *saving = calloc(1, sizeof *saving);
    if (saving == NULL) {
        pthread_mutex_lock(&manager->lock);
        lose(manager, task, run_result);
        pthread_mutex_unlock(&manager->lock);
        task_free(task);
        return;
    }
    *saving = (Saving){.manager = manager,
                       .task = task,
                       .run_result = *run_result,
                       .bytes = run_result_bytes(run_result)};
    *run_result = (RunResult){0};
    if (saving->run_result.status == STATUS_OK && !task->recompute_only)
        saving->head = result_summary_new(&saving->run_result.result);
    pthread_mutex_lock(&manager->lock);
    manager->saving++;
    manager->saving_bytes += saving->bytes;
    // Only the series was wanted: the result is saved already. But it may have been deleted
    // meanwhile, and what is in the cache counts as known.
    if (saving->run_result.outcome != NULL && task->recompute_only &&
        db_result_exists(manager->db, task->result))
        cache_put(manager->cache, task->result, saving->run_result.outcome, NULL);
    const bool goes_on = go_on(saving);
    if (!goes_on)
        end(saving);
    pthread_mutex_unlock(&manager->lock);
    if (!goes_on)
        saving_free(saving);
}
