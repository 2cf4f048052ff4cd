// Results in memory, and outcomes for readers of series: from memory, from the database where
// computing it was expensive, else computed again, ahead of ordinary jobs and once for all readers.
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"

typedef struct CachedResult {
    LruEntry entry;         // by id
    Outcome *outcome;       // or NULL
    ResultSummary *summary; // or NULL
    size_t series_bytes, summary_bytes;
    char id[72];
} CachedResult;

void cache_release(LruEntry *entry, void *owner, bool is_evicted) {
    JobManager *manager = owner;
    CachedResult *result = (CachedResult *)(void *)entry;
    manager->series.evictions += is_evicted && result->outcome != NULL;
    manager->summaries.evictions += is_evicted && result->summary != NULL;
    manager->series.count -= result->outcome != NULL;
    manager->summaries.count -= result->summary != NULL;
    manager->series.bytes -= result->series_bytes;
    manager->summaries.bytes -= result->summary_bytes;
    outcome_unref(result->outcome);
    result_summary_unref(result->summary);
    free(result);
}

void cache_put(JobManager *manager, const char *id, Outcome *outcome, ResultSummary *summary) {
    const CachedResult *old = lru_peek(manager->cache, id);
    CachedResult *result = calloc(1, sizeof *result);
    if (result == NULL)
        return;
    text_fit(result->id, sizeof result->id, id);
    outcome = outcome != NULL ? outcome : old != NULL ? old->outcome : NULL;
    summary = summary != NULL ? summary : old != NULL ? old->summary : NULL;
    result->outcome = outcome != NULL ? outcome_ref(outcome) : NULL;
    result->summary = result_summary_ref(summary);
    result->series_bytes = outcome != NULL ? outcome_bytes(outcome) : 0;
    result->summary_bytes = sizeof *result + (summary != NULL ? summary->bytes : 0);
    result->entry.indexed.key = result->id;
    result->entry.bytes = result->series_bytes + result->summary_bytes;
    manager->series.bytes += result->series_bytes;
    manager->summaries.bytes += result->summary_bytes;
    manager->series.count += outcome != NULL;
    manager->summaries.count += summary != NULL;
    lru_add(manager->cache, &result->entry);
}

static Outcome *cache_find(JobManager *manager, const char *id) {
    const CachedResult *entry = lru_find(manager->cache, id);
    const bool is_hit = entry != NULL && entry->outcome != NULL;
    manager->series.hits += is_hit;
    manager->series.misses += !is_hit;
    return is_hit ? outcome_ref(entry->outcome) : NULL;
}

ResultSummary *cache_head(JobManager *manager, const char *id) {
    const CachedResult *entry = lru_find(manager->cache, id);
    const bool is_hit = entry != NULL && entry->summary != NULL;
    manager->summaries.hits += is_hit;
    manager->summaries.misses += !is_hit;
    return is_hit ? result_summary_ref(entry->summary) : NULL;
}

uint64_t cache_deletions(JobManager *manager) {
    pthread_mutex_lock(&manager->lock);
    const uint64_t deletions = manager->deletions;
    pthread_mutex_unlock(&manager->lock);
    return deletions;
}

bool cache_has(const JobManager *manager, const char *id, bool with_series) {
    const CachedResult *entry = lru_peek(manager->cache, id);
    return entry != NULL && (with_series ? entry->outcome != NULL : entry->summary != NULL);
}

// Assumed cost of reading a series, with that of writing it before.
static const double read_rate = 2e8, read_once = 5e-4; // [B/s], [s]

enum { KEEPING_BYTES = 64 << 20 }; // on the way to the database; more are not kept

// A series on its way, of so many bytes.
typedef struct Keeping {
    JobManager *manager;
    size_t size;
} Keeping;

static void series_kept(void *context, Status status, const char *detail) {
    Keeping *keeping = context;
    JobManager *manager = keeping->manager;
    (void)status; // it is computed again then
    (void)detail;
    pthread_mutex_lock(&manager->lock);
    manager->keeping_bytes -= keeping->size;
    jobs_end_write(manager);
    pthread_mutex_unlock(&manager->lock);
    free(keeping);
}

void jobs_keep_series(JobManager *manager, const char *result, const Outcome *outcome,
                      double seconds) {
    const size_t size = outcome_bytes(outcome);
    if (outcome->response.series.count == 0 || size > manager->settings.store_bytes ||
        seconds <= read_once + (double)size / read_rate)
        return;
    Keeping *keeping = malloc(sizeof *keeping);
    Bytes bytes = {.most = KEEPING_BYTES};
    pthread_mutex_lock(&manager->lock);
    const bool has_room =
        keeping != NULL && !manager->is_closing && manager->keeping_bytes + size <= KEEPING_BYTES;
    if (has_room) {
        manager->keeping_bytes += size;
        manager->writes++;
    }
    pthread_mutex_unlock(&manager->lock);
    if (!has_room) {
        free(keeping);
        return;
    }
    *keeping = (Keeping){manager, size};
    series_blob_write(&bytes, &outcome->response.series);
    const WriteDone done = {series_kept, keeping};
    size_t count = 0;
    char *body = bytes_take(&bytes, &count);
    if (body == NULL || db_series_post(manager->db, result, body, count,
                                       manager->settings.store_bytes, &done) != STATUS_OK)
        series_kept(keeping, STATUS_NO_MEMORY, "");
}

// Without series.
static Status outcome_load(JobManager *manager, const char *result, Outcome **outcome,
                           Problem *problem) {
    ResultRow row = {0};
    *outcome = NULL;
    TRY(db_result_outcome(manager->db, result, &row, problem));
    errno = 0;
    *outcome = outcome_blob_read(row.outcome.at, row.outcome.size);
    const bool is_out_of_memory = *outcome == NULL && errno == ENOMEM;
    result_row_clear(&row);
    if (is_out_of_memory)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the stored result");
    return *outcome != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_INTERNAL, "the stored result cannot be read");
}

// Whether the blob has series of this outcome, which gets them.
static bool series_read(const char *body, size_t size, Response *response) {
    Columns series;
    if (!series_blob_read(body, size, &series))
        return false;
    if (series.rows == response->count || series.count == 0) {
        response->series = series;
        return true;
    }
    columns_clear(&series);
    return false;
}

// From the database, and then in memory; NULL where it is not there.
static Outcome *series_load(JobManager *manager, const char *result) {
    char *body = NULL;
    size_t size = 0;
    Outcome *outcome = NULL;
    const uint64_t deletions = cache_deletions(manager);
    if (db_series_load(manager->db, result, &body, &size, NULL) == STATUS_OK &&
        outcome_load(manager, result, &outcome, NULL) == STATUS_OK &&
        !series_read(body, size, &outcome->response)) {
        outcome_unref(outcome);
        outcome = NULL;
    }
    free(body);
    pthread_mutex_lock(&manager->lock);
    manager->stored.hits += outcome != NULL;
    manager->stored.misses += outcome == NULL;
    if (outcome != NULL && deletions == manager->deletions)
        cache_put(manager, result, outcome, NULL);
    pthread_mutex_unlock(&manager->lock);
    return outcome;
}

// With the lock held: a failure of an earlier computation for readers is reported once.
static Status series_report_failure(JobManager *manager, const char *result, Problem *problem) {
    for (size_t i = 0; i < OUTCOME_FAILURES; i++) {
        Failure *failure = &manager->failures[i];
        if (failure->status != STATUS_OK && strcmp(failure->result, result) == 0) {
            const Status status = failure->status;
            failure->status = STATUS_OK;
            return problem_set(problem, status, "%s", failure->detail);
        }
    }
    return STATUS_OK;
}

// The scene was validated when it was submitted: the present limits are no reason to refuse it.
static Status series_prepare(JobManager *manager, Task *task, Problem *problem) {
    ResultRow row = {0};
    bool is_same = true;
    TRY(db_result_scene(manager->db, task->result, &row, problem));
    Status status = STATUS_OK;
    if (strcmp(row.engine, engine_version) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the series was made by %s, this is %s: to have it again, POST to "
                             "/v1/results/%.72s/again, which submits the scene again",
                             row.engine, engine_version, task->result);
    if (status == STATUS_OK)
        status = jobs_prepare_stored(manager->db, row.scene, task->result, &task->inquiry, &is_same,
                                     problem);
    // It was resolved when it was submitted, and what a result names is never deleted.
    if (status == STATUS_INVALID || status == STATUS_NOT_FOUND) {
        problem_clear(problem);
        status = problem_set(problem, STATUS_INTERNAL,
                             "a material or record that %.72s names cannot be found: the database "
                             "is damaged; put a backup in its place (impactd restore)",
                             task->result);
    }
    if (status == STATUS_OK && !is_same)
        status = problem_set(problem, STATUS_INTERNAL,
                             "the stored scene no longer belongs to this result");
    result_row_clear(&row);
    return status;
}

static Status series_compute(JobManager *manager, const char *result, const Callback *callback,
                             Problem *problem) {
    Task *task = task_new(manager, result);
    if (task == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the series");
    task->recompute_only = true;
    Status status = series_prepare(manager, task, problem);
    if (status == STATUS_OK) {
        task_estimate(task);
        pthread_mutex_lock(&manager->lock);
        Task *other = hashmap_find(manager->tasks, result);
        const bool is_asked =
            subscribers_add(&(other != NULL ? other : task)->result_waiters, callback);
        if (!is_asked || manager->is_closing) {
            status = problem_set(problem, STATUS_BUSY, "the series cannot be computed now");
        } else if (other == NULL) {
            task_enqueue(task, NULL);
            task = NULL;
        }
        pthread_mutex_unlock(&manager->lock);
    }
    task_free(task);
    return status;
}

Status jobs_outcome(JobManager *manager, const char *result, const Callback *callback,
                    Outcome **outcome, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    Status status = STATUS_OK;
    *outcome = cache_find(manager, result);
    Task *task = NULL;
    if (*outcome == NULL) {
        status = series_report_failure(manager, result, problem);
        task = hashmap_find(manager->tasks, result);
        if (status == STATUS_OK && task != NULL &&
            !subscribers_add(&task->result_waiters, callback))
            status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader");
    }
    pthread_mutex_unlock(&manager->lock);
    if (status != STATUS_OK || *outcome != NULL || task != NULL)
        return status;
    *outcome = series_load(manager, result);
    return *outcome != NULL ? STATUS_OK : series_compute(manager, result, callback, problem);
}

Status jobs_outcome_stored(JobManager *manager, const char *result, Outcome **outcome,
                           Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    *outcome = cache_has(manager, result, true) ? cache_find(manager, result) : NULL;
    pthread_mutex_unlock(&manager->lock);
    return *outcome != NULL ? STATUS_OK : outcome_load(manager, result, outcome, problem);
}
