// Dismissing: a job is dismissed for all at once, and told so when the store has it. Where the
// store cannot be told, it is tried again with what else waits for room.
#include "server/jobs/jobs_private.h"
#include "server/util/clock.h"

static Status refuse_finished(const char *id, int state, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT,
                       "the job %.40s cannot be dismissed: it is %s already", id,
                       job_state_names[state]);
}

static void dismissed(void *context, Status status, const char *detail) {
    Job *job = context;
    JobManager *manager = job->manager;
    pthread_mutex_lock(&manager->lock);
    job->is_kept = status == STATUS_OK;
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    // Until the store has it, the job is found here.
    if (status == STATUS_OK) {
        jobs_retire(job);
    } else if (!manager->is_closing) {
        job->next_undismissed = manager->retry_cancels;
        manager->retry_cancels = job_ref(job);
    }
    subscribers_call(&job->save_waiters);
    jobs_settle(manager);
    pthread_mutex_unlock(&manager->lock);
    job_unref(job); // the post's hold
}

void jobs_retry_dismissed(JobManager *manager) {
    Job *job = manager->retry_cancels, *next;
    manager->retry_cancels = NULL;
    for (; job != NULL; job = next) {
        next = job->next_undismissed;
        const WriteDone done = {dismissed, job}; // takes the list's hold
        if (db_job_update_post(manager->db, &job->final_row, &done) == STATUS_OK) {
            manager->posted++;
        } else {
            job->next_undismissed = manager->retry_cancels;
            manager->retry_cancels = job;
        }
    }
}

// Live jobs only: dismissed for all at once, and on its way to the store.
static Status dismiss(JobManager *manager, Job *job, const char *id, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    if (job->is_closing || job_state_is_final(job->row.state)) {
        const int state = job->is_closing ? job->final_row.state : job->row.state;
        pthread_mutex_unlock(&manager->lock);
        return refuse_finished(id, state, problem);
    }
    job->row.state = JOB_DISMISSED;
    if (job->started_ns > 0)
        job->row.run = 1e-9 * (double)(clock_monotonic_ns() - job->started_ns);
    job->row.finished_unix_ms = clock_unix_ms();
    job->row.total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    if (job->started_ns == 0)
        job->row.queued = job->row.total;
    jobs_withdraw(job);
    job->is_closing = true;
    job->final_row = job->row;
    job->final_row.is_unsaved = !job->is_kept;
    job->is_kept = false;
    jobs_detach(job);
    jobs_release(job);
    const WriteDone done = {dismissed, job_ref(job)};
    const Status status = db_job_update_post(manager->db, &job->final_row, &done);
    if (status == STATUS_OK) {
        manager->posted++;
    } else {
        job->refusal = status;
        text_fit(job->refused, sizeof job->refused, "no memory to save the job");
        subscribers_call(&job->save_waiters);
        job_unref(job); // the post's hold
    }
    subscribers_call(&job->subscribers);
    job_metrics_ended(&manager->totals, JOB_DISMISSED, false);
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

Status jobs_cancel(JobManager *manager, const char *id, Job **dismissed, Problem *problem) {
    *dismissed = NULL;
    Job *job = jobs_find_live(manager, id);
    Status status;
    if (job != NULL) {
        status = dismiss(manager, job, id, problem);
    } else {
        TRY(jobs_find(manager, id, &job, problem));
        status = refuse_finished(id, job->row.state, problem);
    }
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    *dismissed = job;
    return STATUS_OK;
}
