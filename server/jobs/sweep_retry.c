// A retry of a sweep that is under way already shares that.
#include "server/jobs/sweep_retry.h"

#include <string.h>

static Status judge(JobManager *manager, const char *id, SweepRow *row, Problem *problem) {
    Job *job = NULL;
    char result[72];
    TRY(jobs_find(manager, id, &job, problem));
    const bool is_finished = job_is_finished(job);
    memcpy(result, job->row.result, sizeof result); // never changes
    job_unref(job);
    if (!is_finished)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: its failed points can be made again "
                           "when it is",
                           id);
    TRY(db_sweep_load(manager->db, result, row, problem));
    if (!db_result_exists(manager->db, result))
        return problem_set(problem, STATUS_CONFLICT,
                           "the sweep was not brought to an end: submit its scene again");
    return STATUS_OK;
}

// Chunks of another engine's cannot be mended by this one.
static Status judge_engine(JobManager *manager, const SweepRow *row, Problem *problem) {
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    char result[72] = "";
    Status status = jobs_prepare(manager->db, row->scene, strlen(row->scene), NULL, &inquiry,
                                 &warnings, problem);
    if (status == STATUS_OK)
        jobs_result_id(&inquiry, result);
    if (status == STATUS_OK && strcmp(result, row->result) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the sweep was made by another engine version, this is %s: POST to "
                             "/v1/results/%.72s/again, which submits its scene anew",
                             engine_version, row->result);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

// With the retries' lock held, so that nobody opens chunks of a sweep that is under way.
static Status reopen(JobManager *manager, const char *result, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    const Task *task = hashmap_find(manager->tasks, result);
    const bool is_under_way = task != NULL && !task->recompute_only;
    pthread_mutex_unlock(&manager->lock);
    return is_under_way ? STATUS_OK : db_sweep_reopen(manager->db, result, problem);
}

Status sweep_retry_open(JobManager *manager, const char *id, SweepRow *row, Problem *problem) {
    memset(row, 0, sizeof *row);
    TRY(judge(manager, id, row, problem));
    TRY(judge_engine(manager, row, problem));
    return reopen(manager, row->result, problem);
}
