// Opens and closes the job manager: its tables, its workers, the unfinished jobs of the database.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"
#include "server/jobs/study.h"

static const size_t queue_bytes_default = (size_t)256 << 20; // of scenes

static Status manager_take_up_all(JobManager *manager, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = db_job_unfinished(manager->db, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = jobs_take_up(manager, &rows.at[i], problem);
    job_rows_clear(&rows);
    return status;
}

static Status manager_start_workers(JobManager *manager, Problem *problem) {
    const size_t count = manager->settings.workers + 1;
    Status status = STATUS_OK;
    pthread_mutex_lock(&manager->lock); // those that run already look at the others
    while (status == STATUS_OK && manager->worker_count < count) {
        Worker *worker = &manager->workers[manager->worker_count];
        worker->manager = manager;
        worker->is_spare = manager->worker_count == count - 1;
        if (pthread_create(&worker->thread, NULL, worker_main, worker) != 0)
            status = problem_set(problem, STATUS_INTERNAL, "worker %zu of %zu could not be started",
                                 manager->worker_count + 1, count);
        else
            manager->worker_count++;
    }
    pthread_mutex_unlock(&manager->lock);
    return status;
}

Status jobs_open(Db *db, const JobManagerSettings *settings, JobManager **opened,
                 Problem *problem) {
    JobManager *manager = calloc(1, sizeof *manager);
    *opened = NULL;
    if (manager == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    manager->db = db;
    manager->settings = *settings;
    if (manager->settings.queue_bytes == 0)
        manager->settings.queue_bytes = queue_bytes_default;
    pthread_mutex_init(&manager->lock, NULL);
    pthread_mutex_init(&manager->retries, NULL);
    pthread_cond_init(&manager->work, NULL);
    pthread_cond_init(&manager->spare_work, NULL);
    pthread_cond_init(&manager->settled, NULL);
    manager->estimate_bias = 1;
    manager->queue = queue_new();
    manager->jobs = hashmap_new();
    manager->tasks = hashmap_new();
    manager->cache = cache_new(settings->cache_bytes);
    manager->workers = calloc(settings->workers + 1, sizeof *manager->workers);
    Status status = STATUS_OK;
    if (manager->jobs == NULL || manager->tasks == NULL || manager->cache == NULL ||
        manager->queue == NULL || manager->workers == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    if (status == STATUS_OK)
        status = db_sweep_tidy(db, problem);
    if (status == STATUS_OK)
        status = manager_take_up_all(manager, problem);
    if (status == STATUS_OK)
        status = manager_start_workers(manager, problem);
    if (status != STATUS_OK) {
        jobs_close(manager);
        return status;
    }
    *opened = manager;
    return STATUS_OK;
}

// What is left when the workers have ended and nothing is being written stays unfinished in the
// database, for the next start.
static void manager_release_all(JobManager *manager) {
    Task *task;
    while (manager->studies != NULL) {
        task = manager->studies->task;
        manager->studies = manager->studies->next;
        study_run_free(task->study);
        task_release(task);
        task_free(task);
    }
    while (manager->tasks != NULL && (task = hashmap_any(manager->tasks)) != NULL) {
        task_release(task);
        task_free(task);
    }
    for (Job *job; (job = manager->retry_cancels) != NULL;) {
        manager->retry_cancels = job->next_retry;
        job_unref(job);
    }
    for (Job *job; manager->jobs != NULL && (job = hashmap_any(manager->jobs)) != NULL;)
        job_retire(job);
}

static void manager_wait_for_writes(JobManager *manager) {
    pthread_mutex_lock(&manager->lock);
    while (manager->writes > 0)
        pthread_cond_wait(&manager->settled, &manager->lock);
    pthread_mutex_unlock(&manager->lock);
}

void jobs_stop(JobManager *manager) {
    pthread_mutex_lock(&manager->lock);
    const bool is_stopped = manager->is_closing;
    manager->is_closing = true;
    for (size_t i = 0; i < manager->worker_count; i++)
        if (manager->workers[i].running != NULL)
            atomic_store(&manager->workers[i].running->is_stopped, true);
    for (StudyRun *run = manager->studies; run != NULL; run = run->next)
        atomic_store(&run->task->is_stopped, true);
    pthread_cond_broadcast(&manager->work);
    pthread_cond_broadcast(&manager->spare_work);
    pthread_mutex_unlock(&manager->lock);
    if (is_stopped)
        return;
    for (size_t i = 0; i < manager->worker_count; i++)
        pthread_join(manager->workers[i].thread, NULL);
    manager_wait_for_writes(manager);
    pthread_mutex_lock(&manager->lock);
    manager_release_all(manager);
    pthread_mutex_unlock(&manager->lock);
}

void jobs_close(JobManager *manager) {
    if (manager == NULL)
        return;
    jobs_stop(manager);
    manager_wait_for_writes(manager); // of requests that were answered meanwhile
    cache_free(manager->cache);
    queue_free(manager->queue);
    hashmap_free(manager->jobs);
    hashmap_free(manager->tasks);
    free(manager->workers);
    pthread_cond_destroy(&manager->work);
    pthread_cond_destroy(&manager->spare_work);
    pthread_cond_destroy(&manager->settled);
    pthread_mutex_destroy(&manager->retries);
    pthread_mutex_destroy(&manager->lock);
    free(manager);
}

void jobs_retry_writes(JobManager *manager) {
    commit_retry(manager);
    pthread_mutex_lock(&manager->lock);
    jobs_call_waiting(manager);
    studies_resume(manager);
    pthread_mutex_unlock(&manager->lock);
}

void jobs_forget(JobManager *manager, const char *result) {
    pthread_mutex_lock(&manager->lock);
    cache_forget(manager->cache, result);
    pthread_mutex_unlock(&manager->lock);
    if (manager->settings.deleted.wake != NULL)
        manager->settings.deleted.wake(manager->settings.deleted.context);
}

Status jobs_delete(JobManager *manager, const char *result, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    const bool is_wanted = hashmap_find(manager->tasks, result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    if (is_wanted)
        return problem_set(problem, STATUS_CONFLICT,
                           "the result is being computed; dismiss its job first, or wait");
    TRY(db_result_delete(manager->db, result, problem));
    jobs_forget(manager, result);
    return STATUS_OK;
}

Status jobs_remove(JobManager *manager, const char *id, Problem *problem) {
    Job *job = NULL;
    Removed removed;
    TRY(jobs_find(manager, id, &job, problem));
    const bool is_live = job->manager != NULL; // also while its last state is being written
    job_unref(job);
    if (is_live)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: dismiss it first, or wait", id);
    TRY(db_job_remove(manager->db, id, &removed, problem));
    if (removed.results > 0)
        jobs_forget(manager, removed.result[0]);
    return STATUS_OK;
}

void jobs_layers(JobManager *manager, const char *result, CacheLayers *layers) {
    pthread_mutex_lock(&manager->lock);
    *layers = (CacheLayers){.in_memory = cache_has(manager->cache, result, false),
                            .series_in_memory = cache_has(manager->cache, result, true)};
    pthread_mutex_unlock(&manager->lock);
    layers->in_database = db_result_exists(manager->db, result);
    layers->series_in_database = db_series_exists(manager->db, result);
}

const JobMetrics *jobs_totals(const JobManager *manager) {
    return &manager->totals;
}

void jobs_tally(JobManager *manager, JobStats *stats) {
    pthread_mutex_lock(&manager->lock);
    *stats = (JobStats){.queued = queue_count(manager->queue),
                        .workers = manager->settings.workers,
                        .queue_most = manager->settings.queue_most,
                        .saving = manager->saving,
                        .rows = manager->rows,
                        .stored = manager->stored};
    cache_tally(manager->cache, &stats->series, &stats->heads);
    stats->cached_outcomes = stats->series.count;
    stats->cached_bytes = stats->series.bytes + stats->heads.bytes;
    for (size_t i = 0; i < manager->worker_count; i++)
        stats->running += manager->workers[i].running != NULL || manager->workers[i].study != NULL;
    pthread_mutex_unlock(&manager->lock);
    stats->stored.most_bytes = manager->settings.store_bytes;
}
