// Failed points of a sweep once more: their chunks are opened in the store, and the same scene is
// submitted again, which finds them so.
#include <string.h>

#include "server/jobs/intake_state.h"

static Status judge(Intake *intake, const char *id, SweepRow *row, Problem *problem) {
    Job *job = NULL;
    char result[72];
    TRY(intake_find(intake, id, &job, problem));
    const bool is_finished = job_is_finished(job);
    memcpy(result, job->row.result, sizeof result); // never changes
    job_drop(job);
    if (!is_finished)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: its failed points can be made again "
                           "when it is",
                           id);
    TRY(store_sweep_load(intake->store, result, row, problem));
    if (!store_result_exists(intake->store, result))
        return problem_set(problem, STATUS_CONFLICT,
                           "the sweep was not brought to an end: submit its scene again");
    return STATUS_OK;
}

// Chunks of another engine's cannot be mended by this one.
static Status judge_engine(Intake *intake, const SweepRow *row, Problem *problem) {
    Inquiry inquiry = {0};
    Warnings warnings = {NULL, 0};
    char result[72] = "";
    Status status = intake_prepare(intake->store, row->scene, strlen(row->scene), NULL, &inquiry,
                                   &warnings, problem);
    if (status == STATUS_OK)
        intake_result_id(&inquiry, result);
    if (status == STATUS_OK && strcmp(result, row->result) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the sweep was made by another engine version, this is %s: submit its "
                             "scene anew",
                             engine_version);
    inquiry_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

Status intake_retry(Intake *intake, const char *id, const char *client, Job **job,
                    Problem *problem) {
    SweepRow row = {0};
    *job = NULL;
    Status status = judge(intake, id, &row, problem);
    if (status == STATUS_OK)
        status = judge_engine(intake, &row, problem);
    if (status == STATUS_OK)
        status = store_sweep_reopen(intake->store, row.result, problem);
    if (status == STATUS_OK) {
        const Submission submission = {
            .text = row.scene, .size = strlen(row.scene), .client = client, .is_retry = true};
        status = intake_submit(intake, &submission, job, problem);
    }
    sweep_row_clear(&row);
    return status;
}
