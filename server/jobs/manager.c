// The job manager: its tables, its workers, the unfinished jobs of the database, its maintenance
// and metrics.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/solve/solver.h"

#include "server/jobs/jobs_private.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"
#include "server/util/process.h"
#include "server/util/thread_pool.h"

static const size_t queue_bytes_default = (size_t)256 << 20; // of scenes

enum { RETENTION_MS = 5000, RETENTION_PAUSE_MS = 10, RETRY_MS = 1000 };

void jobs_retry_writes(JobManager *manager) {
    pthread_mutex_lock(&manager->lock);
    jobs_call_waiting(manager);
    commit_retry_cancels(manager);
    pthread_mutex_unlock(&manager->lock);
}

static void manager_forget(JobManager *manager, const char *result) {
    pthread_mutex_lock(&manager->lock);
    manager->deletions++;
    LruEntry *entry = lru_peek(manager->cache, result);
    if (entry != NULL)
        lru_remove(manager->cache, entry);
    pthread_mutex_unlock(&manager->lock);
    if (manager->settings.deleted.wake != NULL)
        manager->settings.deleted.wake(manager->settings.deleted.context);
}

// Waits until then, a second at most. False once the manager stops.
static bool maintenance_wait(JobManager *manager, int64_t until_ns) {
    const int64_t retry_ns = clock_monotonic_ns() + RETRY_MS * 1000000LL;
    const int64_t end_ns = until_ns < retry_ns ? until_ns : retry_ns;
    const struct timespec end = {(time_t)(end_ns / 1000000000), (long)(end_ns % 1000000000)};
    pthread_mutex_lock(&manager->lock);
    while (!manager->is_closing &&
           pthread_cond_timedwait(&manager->stopping, &manager->lock, &end) == 0) {
    }
    const bool continues = !manager->is_closing;
    pthread_mutex_unlock(&manager->lock);
    return continues;
}

// Every second it retries writes that failed for want of space. Every few seconds it deletes
// what exceeds the rules of retention: in small steps, with a pause between them in which others
// write. What cannot be deleted now is tried again the next time.
static void *maintenance_main(void *context) {
    JobManager *manager = context;
    int64_t next_ns = 0; // of retention
    uint64_t pages = 0;
    do {
        jobs_retry_writes(manager);
        if (clock_monotonic_ns() < next_ns)
            continue;
        Removed removed;
        const Status status = db_remove(manager->db, &manager->settings.keep, &removed, NULL);
        for (size_t i = 0; status == STATUS_OK && i < removed.results; i++)
            manager_forget(manager, removed.result[i]);
        const bool is_more = status == STATUS_OK && removed.is_more;
        process_trim_memory(&pages);
        next_ns = clock_monotonic_ns() + (is_more ? RETENTION_PAUSE_MS : RETENTION_MS) * 1000000LL;
    } while (maintenance_wait(manager, next_ns));
    return NULL;
}

static Status manager_resume_all(JobManager *manager, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = db_job_unfinished(manager->db, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = jobs_resume(manager, rows.at[i].id, problem);
    job_rows_clear(&rows);
    return status;
}

static Status manager_start_workers(JobManager *manager, Problem *problem) {
    const size_t count = manager->settings.workers + 1;
    Status status = STATUS_OK;
    pthread_mutex_lock(&manager->lock); // started workers read worker_count and workers[]
    while (status == STATUS_OK && manager->worker_count < count) {
        Worker *worker = &manager->workers[manager->worker_count];
        worker->manager = manager;
        worker->is_spare = manager->worker_count == count - 1;
        status = thread_start(&worker->thread, worker_main, worker, "a worker", problem);
        if (status == STATUS_OK)
            manager->worker_count++;
    }
    pthread_mutex_unlock(&manager->lock);
    if (status != STATUS_OK || !manager->settings.has_maintenance)
        return status;
    TRY(thread_start(&manager->maintenance, maintenance_main, manager, "the maintenance thread",
                     problem));
    manager->is_maintained = true;
    return STATUS_OK;
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
    pthread_condattr_t monotonic; // a clock that is set back makes no wait longer
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&manager->stopping, &monotonic);
    pthread_condattr_destroy(&monotonic);
    manager->queue = queue_new();
    manager->jobs = hashmap_new();
    manager->tasks = hashmap_new();
    manager->cache = lru_new(settings->cache_bytes, cache_release, manager);
    manager->workers = calloc(settings->workers + 1, sizeof *manager->workers);
    const bool is_made = manager->jobs != NULL && manager->tasks != NULL &&
                         manager->cache != NULL && manager->queue != NULL &&
                         manager->workers != NULL;
    Status status = study_result(status_made(is_made), problem);
    if (status == STATUS_OK)
        status = db_sweep_tidy(db, problem);
    if (status == STATUS_OK)
        status = manager_resume_all(manager, problem);
    if (status == STATUS_OK && settings->cluster.shared != NULL)
        status = cluster_open(manager, problem);
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
    pthread_cond_broadcast(&manager->stopping);
    pthread_mutex_unlock(&manager->lock);
    if (is_stopped)
        return;
    if (manager->is_maintained)
        pthread_join(manager->maintenance, NULL);
    for (size_t i = 0; i < manager->worker_count; i++)
        pthread_join(manager->workers[i].thread, NULL);
    cluster_close(manager->cluster); // which workers use to their end
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
    lru_free(manager->cache);
    queue_free(manager->queue);
    hashmap_free(manager->jobs);
    hashmap_free(manager->tasks);
    free(manager->workers);
    pthread_cond_destroy(&manager->work);
    pthread_cond_destroy(&manager->spare_work);
    pthread_cond_destroy(&manager->settled);
    pthread_cond_destroy(&manager->stopping);
    pthread_mutex_destroy(&manager->retries);
    pthread_mutex_destroy(&manager->lock);
    free(manager);
}

Status jobs_delete(JobManager *manager, const char *result, Problem *problem) {
    pthread_mutex_lock(&manager->lock);
    const bool is_wanted = hashmap_find(manager->tasks, result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    if (is_wanted)
        return problem_set(problem, STATUS_CONFLICT,
                           "the result is being computed; dismiss its job first, or wait");
    TRY(db_result_delete(manager->db, result, problem));
    manager_forget(manager, result);
    return STATUS_OK;
}

Status jobs_remove(JobManager *manager, const char *id, Problem *problem) {
    Removed removed;
    pthread_mutex_lock(&manager->lock);
    const bool is_live = hashmap_find(manager->jobs, id) != NULL; // also while its end is written
    pthread_mutex_unlock(&manager->lock);
    if (is_live)
        return problem_set(problem, STATUS_CONFLICT,
                           "the job %.40s is not finished: dismiss it first, or wait", id);
    TRY(db_job_remove(manager->db, id, &removed, problem));
    if (removed.results > 0)
        manager_forget(manager, removed.result[0]);
    return STATUS_OK;
}

void jobs_layers(JobManager *manager, const char *result, CacheLayers *layers) {
    pthread_mutex_lock(&manager->lock);
    *layers = (CacheLayers){.in_memory = cache_has(manager, result, false),
                            .series_in_memory = cache_has(manager, result, true)};
    pthread_mutex_unlock(&manager->lock);
    layers->in_database = db_result_exists(manager->db, result);
    layers->series_in_database = db_series_exists(manager->db, result);
}

void jobs_stats(JobManager *manager, JobStats *stats) {
    pthread_mutex_lock(&manager->lock);
    *stats = (JobStats){.queued = queue_count(manager->queue),
                        .workers = manager->settings.workers,
                        .queue_most = manager->settings.queue_most,
                        .unfinished = manager->live,
                        .saving = manager->saving,
                        .heads = manager->summaries,
                        .series = manager->series,
                        .rows = manager->rows,
                        .stored = manager->stored};
    stats->series.most_bytes = stats->heads.most_bytes = manager->settings.cache_bytes;
    stats->cached_outcomes = stats->series.count;
    stats->cached_bytes = stats->series.bytes + stats->heads.bytes;
    for (size_t i = 0; i < manager->worker_count; i++)
        stats->running += manager->workers[i].running != NULL || manager->workers[i].study != NULL;
    pthread_mutex_unlock(&manager->lock);
    stats->stored.most_bytes = manager->settings.store_bytes;
}

static void metrics_write_jobs(const JobMetrics *metrics, Bytes *bytes) {
    static const char jobs[] = "impactd_jobs_total", waited[] = "impactd_queue_wait_seconds";
    char labels[64];
    metrics_family(bytes, jobs, "counter", "Jobs that ended, by their final state.");
    for (int state = 0; state < METRICS_STATES; state++)
        if (job_state_is_final(state)) {
            snprintf(labels, sizeof labels, "state=\"%s\"", job_state_names[state]);
            metrics_count(bytes, jobs, labels, counter_get(&metrics->ended[state]));
        }
    metrics_counter(bytes, "impactd_jobs_known_total",
                    "Jobs that were answered from known results, without computing.",
                    counter_get(&metrics->cached));
    metrics_family(bytes, waited, "histogram", "Time in the queue, of jobs that were computed.");
    metrics_histogram(bytes, waited, "", &metrics->waited);
}

// Only solvers that ran.
static void metrics_write_solvers(const JobMetrics *metrics, Bytes *bytes) {
    static const char runs[] = "impactd_engine_runs_total", work[] = "impactd_engine_work_total";
    static const char cpu[] = "impactd_engine_cpu_seconds_total";
    Bytes of_cpu = {.most = 1 << 16}, of_work = {.most = 1 << 16};
    char labels[128];
    metrics_family(bytes, runs, "counter",
                   "Scenes simulated, by solver; a study's runs are apart.");
    metrics_family(&of_cpu, cpu, "counter", "CPU time of these simulations, by solver.");
    metrics_family(&of_work, work, "counter",
                   "What the engine did in these simulations, by solver and kind: steps, contacts, "
                   "bounces and others.");
    for (size_t i = 0; solvers[i] != NULL && i < METRICS_SOLVERS; i++) {
        const SolverMetrics *solver = &metrics->solvers[i];
        if (counter_get(&solver->runs) == 0)
            continue;
        snprintf(labels, sizeof labels, "solver=\"%s\"", solvers[i]->kind.name);
        metrics_count(bytes, runs, labels, counter_get(&solver->runs));
        metrics_real(&of_cpu, cpu, labels, 1e-9 * (double)counter_get(&solver->cpu_ns));
        const Field *field = work_counters_fields;
        for (size_t k = 0; field[k].kind == FIELD_KIND_COUNT && k < METRICS_WORK; k++) {
            snprintf(labels, sizeof labels, "solver=\"%s\",kind=\"%s\"", solvers[i]->kind.name,
                     field[k].name);
            metrics_count(&of_work, work, labels, counter_get(&solver->work[k]));
        }
    }
    bytes_put(bytes, of_cpu.at, of_cpu.count);
    bytes_put(bytes, of_work.at, of_work.count);
    bytes_clear(&of_cpu);
    bytes_clear(&of_work);
}

void jobs_write_metrics(const JobManager *manager, Bytes *bytes) {
    const JobMetrics *metrics = &manager->metrics;
    metrics_write_jobs(metrics, bytes);
    metrics_write_solvers(metrics, bytes);
    metrics_counter(bytes, "impactd_study_runs_total", "Studies that were run.",
                    counter_get(&metrics->study_runs));
    metrics_family(bytes, "impactd_study_cpu_seconds_total", "counter", "CPU time of studies.");
    metrics_real(bytes, "impactd_study_cpu_seconds_total", "",
                 1e-9 * (double)counter_get(&metrics->study_cpu_ns));
}
