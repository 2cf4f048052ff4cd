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
    JobManager *intake = job->intake;
    pthread_mutex_lock(&intake->lock);
    job->is_kept = status == STATUS_OK;
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    // Until the store has it, the job is found here.
    if (status == STATUS_OK) {
        jobs_retire(job);
    } else if (!intake->is_closing) {
        job->next_undismissed = intake->undismissed;
        intake->undismissed = job_ref(job);
    }
    subscribers_call(&job->keepers);
    jobs_settle(intake);
    pthread_mutex_unlock(&intake->lock);
    job_unref(job); // the post's hold
}

void jobs_retry_dismissed(JobManager *intake) {
    Job *job = intake->undismissed, *next;
    intake->undismissed = NULL;
    for (; job != NULL; job = next) {
        next = job->next_undismissed;
        const WriteDone done = {dismissed, job}; // takes the list's hold
        if (db_job_update_post(intake->store, &job->closing, &done) == STATUS_OK) {
            intake->posted++;
        } else {
            job->next_undismissed = intake->undismissed;
            intake->undismissed = job;
        }
    }
}

// Live jobs only: dismissed for all at once, and on its way to the store.
static Status dismiss(JobManager *intake, Job *job, const char *id, Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    if (job->is_closing || job_state_is_final(job->row.state)) {
        const int state = job->is_closing ? job->closing.state : job->row.state;
        pthread_mutex_unlock(&intake->lock);
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
    job->closing = job->row;
    job->closing.is_unsaved = !job->is_kept;
    job->is_kept = false;
    jobs_detach(job);
    jobs_release(job);
    const WriteDone done = {dismissed, job_ref(job)};
    const Status status = db_job_update_post(intake->store, &job->closing, &done);
    if (status == STATUS_OK) {
        intake->posted++;
    } else {
        job->refusal = status;
        text_fit(job->refused, sizeof job->refused, "no memory to save the job");
        subscribers_call(&job->keepers);
        job_unref(job); // the post's hold
    }
    subscribers_call(&job->wakers);
    job_metrics_ended(&intake->totals, JOB_DISMISSED, false);
    pthread_mutex_unlock(&intake->lock);
    return STATUS_OK;
}

Status jobs_cancel(JobManager *intake, const char *id, Job **dismissed, Problem *problem) {
    *dismissed = NULL;
    Job *job = jobs_find_live(intake, id);
    Status status;
    if (job != NULL) {
        status = dismiss(intake, job, id, problem);
    } else {
        TRY(jobs_find(intake, id, &job, problem));
        status = refuse_finished(id, job->row.state, problem);
    }
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    *dismissed = job;
    return STATUS_OK;
}
