// The jobs room as a whole: its computations and who waits for them, opening, closing and finding.
#include "server/jobs/jobs.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/resolve_record.h"
#include "server/jobs/study.h"
#include "server/util/clock.h"

// Of scenes that wait, where the settings say nothing.
static const size_t queue_bytes_usual = (size_t)256 << 20;

Task *task_new(const char *result) {
    Task *task = calloc(1, sizeof *task);
    if (task == NULL)
        return NULL;
    text_fit(task->result, sizeof task->result, result);
    task->indexed.key = task->result;
    atomic_init(&task->is_stopped, false);
    atomic_init(&task->progress, 0);
    return task;
}

void task_free(Task *task) {
    if (task == NULL)
        return;
    study_run_free(task->study);
    study_request_clear(&task->inquiry);
    free(task->scene);
    free(task->warnings);
    free(task->result_waiters.at);
    free(task);
}

Task *task_of(QueueEntry *entry) {
    return (Task *)(void *)((char *)entry - offsetof(Task, queued));
}

void jobs_call_worker(JobManager *manager) {
    pthread_cond_signal(&manager->work);
    if (manager->slow_running >= manager->settings.workers)
        pthread_cond_signal(&manager->spare_work);
}

void jobs_enqueue(JobManager *manager, Task *task, QueueClient *client) {
    hashmap_add(manager->in_flight, &task->indexed);
    study_estimate(task, &manager->settings.limits);
    resolve_records_drop(&task->inquiry); // until it is its turn
    if (client == NULL)
        queue_push_front(manager->queue, &task->queued);
    else
        queue_put(manager->queue, &task->queued, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(manager);
}

void jobs_release(Job *job) {
    if (!job->is_counted)
        return;
    job->is_counted = false;
    job->manager->live--;
    job->client->live--;
    job->manager->scene_bytes -= job->scene_size;
}

void jobs_retire(Job *job) {
    jobs_release(job);
    if (!job->is_live)
        return;
    job->is_live = false;
    hashmap_remove(job->manager->jobs, &job->indexed);
    job_unref(job);
}

void jobs_settle(JobManager *manager) {
    if (--manager->posted == 0)
        pthread_cond_broadcast(&manager->settled);
}

void jobs_refuse(Job *job, Status status, const char *detail) {
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    job->row.state = JOB_FAILED;
    subscribers_call(&job->subscribers);
    subscribers_call(&job->save_waiters);
    jobs_detach(job);
    jobs_retire(job);
}

void jobs_withdraw(Job *job) {
    if (job->ticket == NULL || !db_cancel_write(job->manager->db, job->ticket))
        return;
    job->ticket = NULL;
    jobs_settle(job->manager);
    job_unref(job); // the post's hold
}

void jobs_drop(JobManager *manager) {
    if (manager == NULL || atomic_fetch_sub(&manager->refcount, 1) != 1)
        return;
    pthread_cond_destroy(&manager->work);
    pthread_cond_destroy(&manager->spare_work);
    pthread_cond_destroy(&manager->keys_free);
    pthread_cond_destroy(&manager->settled);
    pthread_mutex_destroy(&manager->retries);
    naming_destroy(&manager->naming);
    pthread_mutex_destroy(&manager->lock);
    free(manager);
}

void jobs_detach(Job *job) {
    Task *task = job->task;
    if (task == NULL)
        return;
    for (Job **at = &task->jobs; *at != NULL; at = &(*at)->next_shared)
        if (*at == job) {
            *at = job->next_shared;
            break;
        }
    job->task = NULL;
    job->next_shared = NULL;
    job_unref(job); // the computation's hold
    if (task->jobs != NULL || task->result_waiters.count > 0)
        return;
    // Nobody wants it any more. Whoever asks for the same scene from now on starts anew.
    hashmap_remove(job->manager->in_flight, &task->indexed);
    if (task->is_running) {
        atomic_store(&task->is_stopped, true);
        if (task->study != NULL)
            study_stop(task->study);
    } else {
        queue_remove(job->manager->queue, &task->queued);
        task_free(task);
    }
}

void jobs_attach(Job *job, Task *task) {
    job->task = task;
    job->next_shared = task->jobs;
    task->jobs = job_ref(job);
    if (task->is_running) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = clock_unix_ms();
        job->started_ns = clock_monotonic_ns();
    }
}

void jobs_admit(JobManager *manager, Job *job) {
    job->scene_size = strlen(job->row.scene);
    hashmap_add(manager->jobs, &job_ref(job)->indexed);
    job->is_live = true;
    job->is_counted = true;
    manager->live++;
    job->client->live++;
    manager->scene_bytes += job->scene_size;
}

static Status take_up_all(JobManager *manager, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = db_job_unfinished(manager->db, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = jobs_take_up(manager, &rows.at[i], problem);
    job_rows_clear(&rows);
    return status;
}

Status jobs_open(Db *db, const JobManagerSettings *settings, JobManager **opened,
                 Problem *problem) {
    JobManager *manager = calloc(1, sizeof *manager);
    *opened = NULL;
    if (manager == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    atomic_init(&manager->refcount, 1);
    manager->db = db;
    manager->settings = *settings;
    if (manager->settings.queue_bytes == 0)
        manager->settings.queue_bytes = queue_bytes_usual;
    pthread_mutex_init(&manager->lock, NULL);
    pthread_mutex_init(&manager->retries, NULL);
    naming_init(&manager->naming);
    pthread_cond_init(&manager->work, NULL);
    pthread_cond_init(&manager->spare_work, NULL);
    pthread_cond_init(&manager->keys_free, NULL);
    manager->pace = 1;
    manager->queue = queue_new();
    pthread_cond_init(&manager->settled, NULL);
    manager->jobs = hashmap_new();
    manager->in_flight = hashmap_new();
    manager->cache = cache_new(settings->cache_bytes);
    manager->workers = calloc(settings->workers + 1, sizeof *manager->workers);
    Status status = STATUS_OK;
    if (manager->jobs == NULL || manager->in_flight == NULL || manager->cache == NULL ||
        manager->queue == NULL || manager->workers == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    if (status == STATUS_OK)
        status = db_sweep_tidy(db, problem);
    if (status == STATUS_OK)
        status = take_up_all(manager, problem);
    pthread_mutex_lock(&manager->lock); // those that run already look at the others
    while (status == STATUS_OK && manager->worker_count < settings->workers + 1) {
        Worker *worker = &manager->workers[manager->worker_count];
        worker->manager = manager;
        worker->is_spare = manager->worker_count == settings->workers;
        if (pthread_create(&worker->thread, NULL, worker_main, worker) != 0)
            status = problem_set(problem, STATUS_INTERNAL, "worker %zu of %zu could not be started",
                                 manager->worker_count + 1, settings->workers + 1);
        else
            manager->worker_count++;
    }
    pthread_mutex_unlock(&manager->lock);
    if (status != STATUS_OK) {
        jobs_close(manager);
        return status;
    }
    *opened = manager;
    return STATUS_OK;
}

static void let_go(Task *task) {
    while (task->jobs != NULL) {
        Job *job = task->jobs;
        task->jobs = job->next_shared;
        job->task = NULL;
        jobs_retire(job);
        subscribers_call(&job->subscribers);
        job_unref(job); // the computation's hold
    }
    subscribers_call(&task->result_waiters);
    task_free(task);
}

void jobs_close(JobManager *manager) {
    if (manager == NULL)
        return;
    pthread_mutex_lock(&manager->lock);
    manager->is_closing = true;
    for (size_t i = 0; i < manager->worker_count; i++)
        if (manager->workers[i].running != NULL)
            atomic_store(&manager->workers[i].running->is_stopped, true);
    for (StudyRun *run = manager->studies; run != NULL; run = run->next)
        atomic_store(&run->task->is_stopped, true);
    pthread_cond_broadcast(&manager->work);
    pthread_cond_broadcast(&manager->spare_work);
    pthread_mutex_unlock(&manager->lock);
    for (size_t i = 0; i < manager->worker_count; i++)
        pthread_join(manager->workers[i].thread, NULL);
    pthread_mutex_lock(&manager->lock);
    while (manager->posted > 0)
        pthread_cond_wait(&manager->settled, &manager->lock);
    pthread_mutex_unlock(&manager->lock);
    // Whoever is still queued stays unfinished in the store, for the next start.
    while (manager->waiting_for_memory != NULL) {
        Task *task = manager->waiting_for_memory;
        manager->waiting_for_memory = task->next_stalled;
        let_go(task);
    }
    while (manager->studies != NULL) {
        Task *task = manager->studies->task;
        manager->studies = manager->studies->next;
        queue_remove(manager->queue, &task->queued);
        let_go(task);
    }
    for (QueueEntry *entry; (entry = queue_take(manager->queue, false)) != NULL;)
        let_go(task_of(entry));
    jobs_abandon_delayed(manager);
    for (Job *job; (job = manager->retry_cancels) != NULL;) {
        manager->retry_cancels = job->next_undismissed;
        job_unref(job);
    }
    for (Job *job; (job = manager->keyed) != NULL;) {
        manager->keyed = job->next_keyed;
        job_unref(job);
    }
    // Those whose end could not be stored are still here.
    for (Job *job; (job = hashmap_any(manager->jobs)) != NULL;)
        jobs_retire(job);
    cache_free(manager->cache);
    queue_free(manager->queue);
    hashmap_free(manager->jobs);
    hashmap_free(manager->in_flight);
    free(manager->workers);
    jobs_drop(manager);
}

Job *jobs_find_live(JobManager *manager, const char *id) {
    pthread_mutex_lock(&manager->lock);
    Job *job = hashmap_find(manager->jobs, id);
    if (job != NULL)
        job_ref(job);
    pthread_mutex_unlock(&manager->lock);
    return job;
}

Status jobs_find(JobManager *manager, const char *id, Job **found, Problem *problem) {
    *found = jobs_find_live(manager, id);
    if (*found != NULL)
        return STATUS_OK;
    Job *job = job_new(NULL);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->is_kept = true;
    const Status status = db_job_load(manager->db, id, &job->row, problem);
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    ResultRow result = {0};
    if (job->row.state == JOB_SUCCESSFUL &&
        db_result_head(manager->db, job->row.result, &result, NULL) == STATUS_OK)
        job->head = result_summary_new(&result);
    result_row_clear(&result);
    *found = job;
    return STATUS_OK;
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
    const bool is_wanted = hashmap_find(manager->in_flight, result) != NULL;
    pthread_mutex_unlock(&manager->lock);
    if (is_wanted)
        return problem_set(problem, STATUS_CONFLICT,
                           "the result is being computed; dismiss its job first, or wait");
    TRY(db_result_delete(manager->db, result, problem));
    jobs_forget(manager, result);
    return STATUS_OK;
}

void jobs_layers(JobManager *manager, const char *result, CacheLayers *cache_layers) {
    pthread_mutex_lock(&manager->lock);
    *cache_layers = (CacheLayers){.in_memory = cache_has(manager->cache, result, false),
                                  .series_in_memory = cache_has(manager->cache, result, true)};
    pthread_mutex_unlock(&manager->lock);
    cache_layers->in_database = db_result_exists(manager->db, result);
    cache_layers->series_in_database = db_series_exists(manager->db, result);
}

const JobMetrics *jobs_totals(const JobManager *manager) {
    return &manager->totals;
}

void jobs_tally(JobManager *manager, JobStats *metrics) {
    pthread_mutex_lock(&manager->lock);
    *metrics = (JobStats){.queued = queue_count(manager->queue),
                          .workers = manager->settings.workers,
                          .queue_most = manager->settings.queue_most,
                          .saving = manager->saving,
                          .rows = manager->rows,
                          .stored = manager->stored};
    cache_tally(manager->cache, &metrics->series, &metrics->heads);
    metrics->cached_outcomes = metrics->series.count;
    metrics->cached_bytes = metrics->series.bytes + metrics->heads.bytes;
    for (size_t i = 0; i < manager->worker_count; i++)
        metrics->running +=
            manager->workers[i].running != NULL || manager->workers[i].study != NULL;
    pthread_mutex_unlock(&manager->lock);
    metrics->stored.most_bytes = manager->settings.store_bytes;
}
