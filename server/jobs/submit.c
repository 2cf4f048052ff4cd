// How a scene becomes a job that is durable before anyone hears of it: known results finish it at
// once, equal scenes in flight share one computation, and jobs of an earlier life of the daemon
// come in by the same way.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "server/base/bytes.h"
#include "server/base/clock.h"
#include "server/codec/write.h"
#include "server/jobs/documents.h"
#include "server/jobs/intake_state.h"

static Status make_id(char id[40]) {
    unsigned char bytes[12];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes)
        return STATUS_INTERNAL;
    size_t at = (size_t)snprintf(id, 40, "j-");
    for (size_t i = 0; i < sizeof bytes; i++)
        at += (size_t)snprintf(id + at, 40 - at, "%02x", (unsigned)bytes[i]);
    return STATUS_OK;
}

// Plan, summary, work and notes of a result that is there already. STATUS_NOT_FOUND if it is not.
static Status find_known(Intake *intake, Job *job, Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    Outcome *outcome = cache_find(intake->cache, job->row.result);
    pthread_mutex_unlock(&intake->lock);
    if (outcome != NULL) {
        Bytes plan = {0}, summary = {0}, work = {0}, notes = {0};
        document_plan(&plan, &outcome->plan);
        document_summary(&summary, &outcome->summary);
        document_work(&work, &outcome->work);
        document_warnings(&notes, &outcome->warnings);
        job->plan = bytes_take(&plan, NULL);
        job->summary = bytes_take(&summary, NULL);
        job->work = bytes_take(&work, NULL);
        job->notes = bytes_take(&notes, NULL);
        outcome_drop(outcome);
        return STATUS_OK;
    }
    ResultRow row = {0};
    const Status status = store_result_head(intake->store, job->row.result, &row, NULL);
    if (status == STATUS_OK) {
        job->plan = row.plan;
        job->summary = row.summary;
        job->work = row.work;
        job->notes = row.notes;
        row.plan = row.summary = row.work = row.notes = NULL;
    }
    result_row_clear(&row);
    if (status == STATUS_OK || status == STATUS_NOT_FOUND)
        return status;
    return problem_set(problem, status, "the results could not be searched");
}

static Status finish_known(Intake *intake, Job *job, Problem *problem) {
    JobRow *row = &job->row;
    row->state = JOB_SUCCESSFUL;
    row->is_cached = true;
    row->started_unix_ms = row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    TRY(store_job_add(intake->store, row, problem));
    totals_ended(&intake->totals, JOB_SUCCESSFUL, true);
    return STATUS_OK;
}

// Room in the queue, or why there is none; the job counts from here on.
static Status enter(Intake *intake, Job *job, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&intake->lock);
    if (intake->is_closing)
        status = problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    else if (intake->live >= intake->settings.queue_most)
        status = problem_set(problem, STATUS_BUSY,
                             "the queue is full: %zu jobs are unfinished, %zu are allowed",
                             intake->live, intake->settings.queue_most);
    else if (intake->scene_bytes + strlen(job->row.scene) > intake->settings.queue_bytes)
        status = problem_set(problem, STATUS_BUSY,
                             "the queue is full: %zu bytes of scenes wait, %zu are allowed",
                             intake->scene_bytes, intake->settings.queue_bytes);
    else
        intake_admit(intake, job);
    pthread_mutex_unlock(&intake->lock);
    return status;
}

static void leave(Intake *intake, Job *job) {
    pthread_mutex_lock(&intake->lock);
    intake_retire(job);
    pthread_mutex_unlock(&intake->lock);
}

// A computation of this scene, without jobs. Takes the inquiry. NULL without memory.
static Computation *begin(const char *result, Inquiry *inquiry, const char *warnings) {
    Computation *computation = computation_new(result);
    Bytes scene = {0};
    if (computation != NULL) {
        document_scene(&scene, inquiry);
        computation->scene = bytes_take(&scene, NULL);
        computation->warnings = strdup(warnings);
        computation->inquiry = *inquiry;
        *inquiry = (Inquiry){0};
        if (computation->scene != NULL && computation->warnings != NULL)
            return computation;
    }
    computation_free(computation);
    inquiry_clear(inquiry);
    return NULL;
}

// Takes the inquiry unless the computation is under way already.
static Status start(Intake *intake, Job *job, Inquiry *inquiry, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&intake->lock);
    Computation *computation = index_find(intake->in_flight, job->row.result);
    // It may have been dismissed meanwhile, by whoever saw it in the store.
    if (!job_state_is_final(job->row.state)) {
        if (computation == NULL &&
            (computation = begin(job->row.result, inquiry, job->row.warnings)) != NULL)
            intake_enqueue(intake, computation, false);
        if (computation != NULL)
            intake_attach(job, computation);
        else
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    }
    // The store has it, and the computation.
    free(job->row.scene);
    job->row.scene = NULL;
    pthread_mutex_unlock(&intake->lock);
    return status;
}

static Status fill_job(Job *job, const Inquiry *inquiry, const Warnings *warnings,
                       Problem *problem) {
    JobRow *row = &job->row;
    const char *title = inquiry->simulation.title;
    Bytes scene = {0}, told = {0};
    TRY(make_id(row->id) == STATUS_OK
            ? STATUS_OK
            : problem_set(problem, STATUS_INTERNAL, "no random numbers for a job's id"));
    job->indexed.key = row->id;
    row->created_unix_ms = clock_unix_ms();
    intake_result_id(inquiry, row->result);
    document_scene(&scene, inquiry);
    document_warnings(&told, warnings);
    row->scene = bytes_take(&scene, NULL);
    row->warnings = bytes_take(&told, NULL);
    row->title = title == NULL ? NULL : strdup(title);
    if (row->result[0] == '\0' || row->scene == NULL || row->warnings == NULL ||
        (row->title == NULL && title != NULL))
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    return STATUS_OK;
}

static void fail_row(JobRow *row, const Problem *problem) {
    Bytes bytes = {.most = 1 << 20};
    write_problem(&bytes, problem, write_problem_code(problem->status), NULL);
    row->state = JOB_FAILED;
    row->problem = bytes_take(&bytes, NULL);
    row->finished_unix_ms = clock_unix_ms();
}

static Status submit(Intake *intake, Job *job, Inquiry *inquiry, bool is_retry, Problem *problem) {
    const Status known = is_retry ? STATUS_NOT_FOUND : find_known(intake, job, problem);
    if (known == STATUS_OK)
        return finish_known(intake, job, problem);
    if (known != STATUS_NOT_FOUND)
        return known;
    TRY(enter(intake, job, problem));
    Status status = store_job_add(intake->store, &job->row, problem);
    if (status == STATUS_OK && (status = start(intake, job, inquiry, problem)) != STATUS_OK) {
        // The client is told that it was refused: the next start must not run it all the same.
        fail_row(&job->row, problem);
        (void)store_job_update(intake->store, &job->row, NULL);
    }
    if (status != STATUS_OK)
        leave(intake, job);
    return status;
}

Status intake_submit(Intake *intake, const Submission *submission, Job **accepted,
                     Problem *problem) {
    *accepted = NULL;
    Job *job = job_new(intake);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->submitted_ns = clock_monotonic_ns();
    Inquiry inquiry = {0};
    Warnings warnings = {NULL, 0};
    Status status = intake_prepare(intake->store, submission->text, submission->size,
                                   &intake->settings.limits, &inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = fill_job(job, &inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = submit(intake, job, &inquiry, submission->is_retry, problem);
    inquiry_clear(&inquiry);
    warnings_clear(&warnings);
    if (status != STATUS_OK) {
        job_drop(job);
        return status;
    }
    *accepted = job;
    return STATUS_OK;
}

// Takes the row and the inquiry.
static Status resume(Intake *intake, JobRow *row, Inquiry *inquiry, Problem *problem) {
    Job *job = job_new(intake);
    Computation *computation = NULL;
    intake_result_id(inquiry, row->result);
    if (job != NULL && row->result[0] != '\0' &&
        (computation = index_find(intake->in_flight, row->result)) == NULL &&
        (computation = begin(row->result, inquiry, row->warnings)) != NULL)
        intake_enqueue(intake, computation, false);
    if (computation == NULL) {
        job_drop(job);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    }
    // Its age counts as waiting.
    const int64_t age_ms = clock_unix_ms() - row->created_unix_ms;
    job->submitted_ns = clock_monotonic_ns() - (age_ms > 0 ? age_ms : 0) * 1000000;
    job->row = *row;
    *row = (JobRow){0};
    job->row.state = JOB_ACCEPTED;
    job->indexed.key = job->row.id;
    intake_admit(intake, job);
    intake_attach(job, computation);
    free(job->row.scene);
    job->row.scene = NULL;
    job_drop(job);
    return STATUS_OK;
}

Status intake_take_up(Intake *intake, JobRow *row, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    Inquiry inquiry = {0};
    Warnings warnings = {NULL, 0};
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the unfinished jobs");
    Status status = intake_prepare(intake->store, row->scene, strlen(row->scene),
                                   &intake->settings.limits, &inquiry, &warnings, fault);
    if (status == STATUS_OK) {
        status = resume(intake, row, &inquiry, problem);
    } else if (status == STATUS_INVALID || status == STATUS_UNREADABLE) {
        // The limits or the program changed meanwhile: the job's owner learns why.
        fail_row(row, fault);
        status = store_job_update(intake->store, row, problem);
    } else {
        problem_set(problem, status, "%s", fault->detail);
    }
    inquiry_clear(&inquiry);
    warnings_clear(&warnings);
    free(fault);
    return status;
}

void dry_run_clear(DryRun *dry_run) {
    inquiry_clear(&dry_run->inquiry);
    warnings_clear(&dry_run->warnings);
    fields_clear(plan_report_fields, &dry_run->plan);
}

Status intake_dry_run(Intake *intake, const char *text, size_t size, DryRun *dry_run,
                      Problem *problem) {
    memset(dry_run, 0, sizeof *dry_run);
    TRY(intake_prepare(intake->store, text, size, &intake->settings.limits, &dry_run->inquiry,
                       &dry_run->warnings, problem));
    intake_result_id(&dry_run->inquiry, dry_run->result);
    TRY(simulation_plan(&dry_run->inquiry.simulation, &dry_run->plan, problem));
    TRY(inquiry_cost(&dry_run->inquiry, &intake->settings.limits, &dry_run->cost, problem));
    pthread_mutex_lock(&intake->lock);
    Outcome *outcome = cache_find(intake->cache, dry_run->result);
    pthread_mutex_unlock(&intake->lock);
    dry_run->is_cached = outcome != NULL || store_result_exists(intake->store, dry_run->result);
    outcome_drop(outcome);
    return STATUS_OK;
}
