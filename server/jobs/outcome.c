// Outcomes for readers of series: from memory, else computed again, ahead of ordinary jobs and once
// for all who ask.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/intake_state.h"

// With the lock held: a failure of an earlier computation for readers is told once.
static Status tell_failure(Intake *intake, const char *result, Problem *problem) {
    for (size_t i = 0; i < OUTCOME_FAILURES; i++) {
        Failure *failure = &intake->failures[i];
        if (failure->status != STATUS_OK && strcmp(failure->result, result) == 0) {
            const Status status = failure->status;
            failure->status = STATUS_OK;
            return problem_set(problem, status, "%s", failure->detail);
        }
    }
    return STATUS_OK;
}

static Status compute_again(Intake *intake, const char *result, const Waker *waker,
                            Problem *problem) {
    ResultRow row = {0};
    Inquiry inquiry = {0};
    Warnings warnings = {NULL, 0};
    Computation *computation = NULL;
    Status status = store_result_scene(intake->store, result, &row, problem);
    if (status == STATUS_OK && strcmp(row.engine, engine_version) != 0)
        status = problem_set(
            problem, STATUS_GONE,
            "the series was made by %s, this is %s: submit the scene anew to have it again",
            row.engine, engine_version);
    // The scene was judged when it came; today's limits are no reason to refuse it now.
    if (status == STATUS_OK)
        status = intake_prepare(intake->store, row.scene, strlen(row.scene), NULL, &inquiry,
                                &warnings, problem);
    char id[72] = "";
    if (status == STATUS_OK)
        intake_result_id(&inquiry, id);
    if (status == STATUS_OK && strcmp(id, result) != 0)
        status = problem_set(problem, STATUS_INTERNAL,
                             "the stored scene no longer stands for this result");
    if (status == STATUS_OK && (computation = computation_new(result)) == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the series");
    if (status == STATUS_OK) {
        computation->inquiry = inquiry;
        inquiry = (Inquiry){0};
        computation->is_again = true;
        pthread_mutex_lock(&intake->lock);
        Computation *other = index_find(intake->in_flight, result);
        const bool is_asked = wakers_add(&(other != NULL ? other : computation)->askers, waker);
        if (other == NULL && is_asked && !intake->is_closing) {
            intake_enqueue(intake, computation, NULL);
            computation = NULL;
        }
        if (!is_asked || intake->is_closing)
            status = problem_set(problem, STATUS_BUSY, "the series cannot be computed now");
        pthread_mutex_unlock(&intake->lock);
    }
    computation_free(computation);
    inquiry_clear(&inquiry);
    warnings_clear(&warnings);
    result_row_clear(&row);
    return status;
}

Status intake_outcome(Intake *intake, const char *result, const Waker *waker, Outcome **outcome,
                      Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    Status status = STATUS_OK;
    *outcome = cache_find(intake->cache, result);
    Computation *computation = NULL;
    if (*outcome == NULL) {
        status = tell_failure(intake, result, problem);
        computation = index_find(intake->in_flight, result);
        if (status == STATUS_OK && computation != NULL && !wakers_add(&computation->askers, waker))
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader");
    }
    pthread_mutex_unlock(&intake->lock);
    if (status != STATUS_OK || *outcome != NULL || computation != NULL)
        return status;
    return compute_again(intake, result, waker, problem);
}
