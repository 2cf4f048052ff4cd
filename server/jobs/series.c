// Outcomes for readers of series: from memory, from the database where computing it was dear, else
// computed again, ahead of ordinary jobs and once for all who ask.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"
#include "server/jobs/outcome_blob.h"

// What reading a series is taken to cost, and the writing of it that comes before.
static const double read_rate = 2e8, read_once = 5e-4; // [B/s], [s]

enum { KEEPING_BYTES = 64 << 20 }; // on the way to the database; more are not kept

// A series on its way, of so many bytes.
typedef struct Keeping {
    JobManager *intake;
    size_t size;
} Keeping;

static void kept(void *context, Status status, const char *detail) {
    Keeping *keeping = context;
    JobManager *intake = keeping->intake;
    (void)status; // it is computed again then
    (void)detail;
    pthread_mutex_lock(&intake->lock);
    intake->keeping_bytes -= keeping->size;
    jobs_settle(intake);
    pthread_mutex_unlock(&intake->lock);
    free(keeping);
}

void jobs_keep_series(JobManager *intake, const char *result, const Outcome *outcome,
                      double seconds) {
    const size_t size = outcome_bytes(outcome);
    if (outcome->response.series.count == 0 || size > intake->settings.db_bytes ||
        seconds <= read_once + (double)size / read_rate)
        return;
    Keeping *keeping = malloc(sizeof *keeping);
    Bytes bytes = {.most = KEEPING_BYTES};
    pthread_mutex_lock(&intake->lock);
    const bool has_room =
        keeping != NULL && !intake->is_closing && intake->keeping_bytes + size <= KEEPING_BYTES;
    if (has_room) {
        intake->keeping_bytes += size;
        intake->posted++;
    }
    pthread_mutex_unlock(&intake->lock);
    if (!has_room) {
        free(keeping);
        return;
    }
    *keeping = (Keeping){intake, size};
    outcome_blob_write(&bytes, outcome);
    const WriteDone done = {kept, keeping};
    size_t count = 0;
    char *body = bytes_take(&bytes, &count);
    if (body == NULL || db_series_post(intake->store, result, body, count,
                                       intake->settings.db_bytes, &done) != STATUS_OK)
        kept(keeping, STATUS_NO_MEMORY, "");
}

// From the database, and then in memory; NULL where it is not there.
static Outcome *load_series(JobManager *intake, const char *result) {
    char *body = NULL;
    size_t size = 0;
    Outcome *outcome = NULL;
    if (db_series_load(intake->store, result, &body, &size, NULL) == STATUS_OK)
        outcome = outcome_blob_read(body, size);
    free(body);
    pthread_mutex_lock(&intake->lock);
    intake->stored.hits += outcome != NULL;
    intake->stored.misses += outcome == NULL;
    if (outcome != NULL)
        cache_put(intake->cache, result, outcome, NULL);
    pthread_mutex_unlock(&intake->lock);
    return outcome;
}

// With the lock held: a failure of an earlier computation for readers is told once.
static Status tell_failure(JobManager *intake, const char *result, Problem *problem) {
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

static Status compute_again(JobManager *intake, const char *result, const Callback *waker,
                            Problem *problem) {
    ResultRow row = {0};
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    Task *computation = NULL;
    Status status = db_result_scene(intake->store, result, &row, problem);
    if (status == STATUS_OK && strcmp(row.engine, engine_version) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the series was made by %s, this is %s: to have it again, POST to "
                             "/v1/results/%.72s/again, which submits the scene anew",
                             row.engine, engine_version, result);
    // The scene was judged when it came; today's limits are no reason to refuse it now.
    if (status == STATUS_OK)
        status = jobs_prepare(intake->store, row.scene, strlen(row.scene), NULL, &inquiry,
                              &warnings, problem);
    char id[72] = "";
    if (status == STATUS_OK)
        jobs_result_id(&inquiry, id);
    if (status == STATUS_OK && strcmp(id, result) != 0)
        status = problem_set(problem, STATUS_INTERNAL,
                             "the stored scene no longer stands for this result");
    if (status == STATUS_OK && (computation = task_new(result)) == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the series");
    if (status == STATUS_OK) {
        computation->inquiry = inquiry;
        inquiry = (StudyRequest){0};
        computation->is_again = true;
        pthread_mutex_lock(&intake->lock);
        Task *other = hashmap_find(intake->in_flight, result);
        const bool is_asked =
            subscribers_add(&(other != NULL ? other : computation)->askers, waker);
        if (other == NULL && is_asked && !intake->is_closing) {
            jobs_enqueue(intake, computation, NULL);
            computation = NULL;
        }
        if (!is_asked || intake->is_closing)
            status = problem_set(problem, STATUS_BUSY, "the series cannot be computed now");
        pthread_mutex_unlock(&intake->lock);
    }
    task_free(computation);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    result_row_clear(&row);
    return status;
}

Status jobs_outcome(JobManager *intake, const char *result, const Callback *waker,
                    Outcome **outcome, Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    Status status = STATUS_OK;
    *outcome = cache_find(intake->cache, result);
    Task *computation = NULL;
    if (*outcome == NULL) {
        status = tell_failure(intake, result, problem);
        computation = hashmap_find(intake->in_flight, result);
        if (status == STATUS_OK && computation != NULL &&
            !subscribers_add(&computation->askers, waker))
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader");
    }
    pthread_mutex_unlock(&intake->lock);
    if (status != STATUS_OK || *outcome != NULL || computation != NULL)
        return status;
    *outcome = load_series(intake, result);
    if (*outcome != NULL)
        return STATUS_OK;
    return compute_again(intake, result, waker, problem);
}
