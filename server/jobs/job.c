#include "server/jobs/job.h"

#include <stdlib.h>
#include <string.h>

#include "server/jobs/study.h"
#include "server/util/clock.h"

const char *const job_state_names[] = {"accepted", "running",   "successful",
                                       "failed",   "dismissed", NULL};

bool job_state_is_final(int state) {
    return state != JOB_ACCEPTED && state != JOB_RUNNING;
}

bool subscribers_add(Subscribers *subscribers, const Callback *callback) {
    for (size_t i = 0; i < subscribers->count; i++)
        if (subscribers->at[i].context == callback->context)
            return true;
    Callback *grown = realloc(subscribers->at, (subscribers->count + 1) * sizeof *grown);
    if (grown == NULL)
        return false;
    subscribers->at = grown;
    grown[subscribers->count++] = *callback;
    return true;
}

void subscribers_remove(Subscribers *subscribers, const Callback *callback) {
    for (size_t i = 0; i < subscribers->count; i++)
        if (subscribers->at[i].context == callback->context) {
            subscribers->at[i] = subscribers->at[--subscribers->count];
            return;
        }
}

void subscribers_call(Subscribers *subscribers) {
    for (size_t i = 0; i < subscribers->count; i++)
        subscribers->at[i].wake(subscribers->at[i].context);
    free(subscribers->at);
    *subscribers = (Subscribers){NULL, 0};
}

Job *job_new(JobManager *manager) {
    Job *job = calloc(1, sizeof *job);
    if (job == NULL)
        return NULL;
    atomic_init(&job->refcount, 1);
    job->manager = manager;
    if (manager != NULL)
        atomic_fetch_add(&manager->refcount, 1);
    return job;
}

Job *job_ref(Job *job) {
    atomic_fetch_add(&job->refcount, 1);
    return job;
}

void job_unref(Job *job) {
    if (job == NULL || atomic_fetch_sub(&job->refcount, 1) != 1)
        return;
    job_row_clear(&job->row);
    result_summary_unref(job->head);
    free(job->subscribers.at);
    free(job->save_waiters.at);
    jobs_drop(job->manager);
    free(job);
}

static void lock(Job *job) {
    if (job->manager != NULL)
        pthread_mutex_lock(&job->manager->lock);
}

static void unlock(Job *job) {
    if (job->manager != NULL)
        pthread_mutex_unlock(&job->manager->lock);
}

bool job_is_finished(Job *job) {
    lock(job);
    const bool is_finished = job_state_is_final(job->row.state);
    unlock(job);
    return is_finished;
}

const char *job_client(const Job *job) {
    return job->row.client; // never changes
}

static bool copy(char **target, const char *text) {
    *target = text == NULL ? NULL : strdup(text);
    return text == NULL || *target != NULL;
}

Status job_view(Job *job, JobView *show) {
    *show = (JobView){0};
    lock(job);
    const JobRow *row = &job->row;
    text_fit(show->id, sizeof show->id, row->id);
    show->state = (JobState)row->state;
    show->is_cached = row->is_cached;
    show->created_unix_ms = row->created_unix_ms;
    show->started_unix_ms = row->started_unix_ms;
    show->finished_unix_ms = row->finished_unix_ms;
    show->queued = row->queued;
    show->run = row->run;
    show->total = row->total;
    if (row->state == JOB_SUCCESSFUL) {
        text_fit(show->result, sizeof show->result, row->result);
        show->progress = 100;
        show->is_result_deleted = job->manager == NULL && !row->has_result;
    } else if (job->task != NULL) {
        show->progress = atomic_load(&job->task->progress) / 100.0;
        SweepRun *sweep = job->task->study != NULL ? job->task->study->sweep : NULL;
        if (sweep != NULL) {
            show->points = sweep->row.points;
            show->points_done = atomic_load(&sweep->made);
            show->points_failed = atomic_load(&sweep->made_failed);
        }
    }
    if (!job_state_is_final(row->state) && job->submitted_ns > 0) {
        const int64_t now = clock_monotonic_ns();
        show->total = 1e-9 * (double)(now - job->submitted_ns);
        show->queued = job->started_ns > 0 ? row->queued : show->total;
        show->run = job->started_ns > 0 ? 1e-9 * (double)(now - job->started_ns) : 0;
    }
    const bool is_whole = copy(&show->problem, row->problem) &&
                          copy(&show->warnings, row->warnings) && copy(&show->title, row->title) &&
                          copy(&show->labels, row->labels) && copy(&show->study, row->study) &&
                          copy(&show->client, row->client);
    show->head = result_summary_ref(job->head);
    unlock(job);
    if (show->head != NULL) {
        show->plan = show->head->plan;
        show->summary = show->head->summary;
        show->work = show->head->work;
        show->notes = show->head->notes;
    }
    return is_whole ? STATUS_OK : STATUS_NO_MEMORY;
}

void job_view_clear(JobView *show) {
    free(show->problem);
    free(show->warnings);
    free(show->title);
    free(show->labels);
    free(show->study);
    free(show->client);
    result_summary_unref(show->head);
    *show = (JobView){0};
}

JobState job_peek(Job *job, double *progress) {
    lock(job);
    const JobState state = (JobState)job->row.state;
    *progress = state == JOB_SUCCESSFUL ? 100
                : job->task == NULL     ? 0
                                        : atomic_load(&job->task->progress) / 100.0;
    unlock(job);
    return state;
}

Status job_is_durable(Job *job, bool *is_kept, Problem *problem) {
    lock(job);
    *is_kept = job->is_kept;
    Status status = STATUS_OK;
    if (!job->is_kept && job->refusal != STATUS_OK)
        status = problem_set(problem, job->refusal, "%s", job->refused);
    if (job->ticket != NULL)
        db_expedite(job->manager->db, job->ticket);
    unlock(job);
    return status;
}

bool job_subscribe(Job *job, const Callback *callback) {
    lock(job);
    bool is_watched = true;
    if (job_state_is_final(job->row.state))
        callback->wake(callback->context);
    else
        is_watched = subscribers_add(&job->subscribers, callback);
    unlock(job);
    return is_watched;
}

bool job_subscribe_durable(Job *job, const Callback *callback) {
    lock(job);
    bool is_watched = true;
    if (job->is_kept || job->refusal != STATUS_OK)
        callback->wake(callback->context);
    else
        is_watched = subscribers_add(&job->save_waiters, callback);
    unlock(job);
    return is_watched;
}

void job_unsubscribe(Job *job, const Callback *callback) {
    lock(job);
    subscribers_remove(&job->subscribers, callback);
    subscribers_remove(&job->save_waiters, callback);
    unlock(job);
}
