// Jobs as their readers see them.
#include "server/jobs/study.h"
#include "server/util/clock.h"

static void job_view_progress(const Job *job, JobView *view) {
    const Task *task = job->task;
    if (job->row.state == JOB_SUCCESSFUL) {
        view->progress = 100;
    } else if (task != NULL) {
        view->progress = atomic_load(&task->progress) / 100.0;
    }
    if (task != NULL && task->study != NULL && task->study->is_sweep) {
        view->points = task->study->sweep.points;
        view->points_done = atomic_load(&task->study->rows_made);
        view->points_failed = atomic_load(&task->study->rows_failed);
    }
    if (task != NULL && task->study != NULL)
        view->cluster = task->study->view;
    if (!job_state_is_final(job->row.state) && job->submitted_ns > 0) {
        const int64_t now = clock_monotonic_ns();
        view->row.total = 1e-9 * (double)(now - job->submitted_ns);
        view->row.queued = job->started_ns > 0 ? job->row.queued : view->row.total;
        view->row.run = job->started_ns > 0 ? 1e-9 * (double)(now - job->started_ns) : 0;
    }
}

Status job_view(Job *job, JobView *view) {
    job_lock(job);
    const JobRow *row = &job->row;
    JobRow *copy = &view->row;
    *view = (JobView){.row = *row, .head = result_summary_ref(job->summary)};
    copy->scene = copy->words = copy->idempotency_key = copy->request = copy->uses = NULL;
    copy->has_result = row->has_result || job->manager != NULL;
    job_view_progress(job, view);
    const Status all[] = {
        text_copy(row->problem, &copy->problem), text_copy(row->warnings, &copy->warnings),
        text_copy(row->title, &copy->title),     text_copy(row->labels, &copy->labels),
        text_copy(row->study, &copy->study),     text_copy(row->client, &copy->client)};
    job_unlock(job);
    if (view->head != NULL) {
        view->plan = view->head->plan;
        view->summary = view->head->summary;
        view->work = view->head->work;
        view->notes = view->head->notes;
    }
    return status_first(all, COUNT(all));
}

void job_view_clear(JobView *view) {
    job_row_clear(&view->row);
    result_summary_unref(view->head);
    *view = (JobView){.head = NULL};
}

JobState job_peek(Job *job, double *progress) {
    JobView view = {.head = NULL};
    job_lock(job);
    const JobState state = (JobState)job->row.state;
    job_view_progress(job, &view);
    job_unlock(job);
    *progress = view.progress;
    return state;
}
