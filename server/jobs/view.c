// Jobs as their readers see them.
#include <stdlib.h>

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
    if (!job_state_is_final(job->row.state) && job->submitted_ns > 0) {
        const int64_t now = clock_monotonic_ns();
        view->total = 1e-9 * (double)(now - job->submitted_ns);
        view->queued = job->started_ns > 0 ? job->row.queued : view->total;
        view->run = job->started_ns > 0 ? 1e-9 * (double)(now - job->started_ns) : 0;
    }
}

void job_view_row(const JobRow *row, JobView *view) {
    *view = (JobView){.state = (JobState)row->state,
                      .is_cached = row->is_cached,
                      .created_unix_ms = row->created_unix_ms,
                      .started_unix_ms = row->started_unix_ms,
                      .finished_unix_ms = row->finished_unix_ms,
                      .queued = row->queued,
                      .run = row->run,
                      .total = row->total,
                      .problem = row->problem,
                      .title = row->title,
                      .labels = row->labels,
                      .study = row->study,
                      .client = row->client};
    text_fit(view->id, sizeof view->id, row->id);
}

Status job_view(Job *job, JobView *view) {
    job_lock(job);
    const JobRow *row = &job->row;
    job_view_row(row, view);
    if (row->state == JOB_SUCCESSFUL) {
        text_fit(view->result, sizeof view->result, row->result);
        view->is_result_deleted = job->manager == NULL && !row->has_result;
    }
    job_view_progress(job, view);
    const Status all[] = {
        text_copy(row->problem, &view->problem), text_copy(row->warnings, &view->warnings),
        text_copy(row->title, &view->title),     text_copy(row->labels, &view->labels),
        text_copy(row->study, &view->study),     text_copy(row->client, &view->client)};
    view->head = result_summary_ref(job->summary);
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
    free(view->problem);
    free(view->warnings);
    free(view->title);
    free(view->labels);
    free(view->study);
    free(view->client);
    result_summary_unref(view->head);
    *view = (JobView){0};
}

JobState job_peek(Job *job, double *progress) {
    JobView view = {0};
    job_lock(job);
    const JobState state = (JobState)job->row.state;
    job_view_progress(job, &view);
    job_unlock(job);
    *progress = view.progress;
    return state;
}
