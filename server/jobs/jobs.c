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
    Task *computation = calloc(1, sizeof *computation);
    if (computation == NULL)
        return NULL;
    text_fit(computation->result, sizeof computation->result, result);
    computation->indexed.key = computation->result;
    atomic_init(&computation->is_stopped, false);
    atomic_init(&computation->progress, 0);
    return computation;
}

void task_free(Task *computation) {
    if (computation == NULL)
        return;
    study_run_free(computation->study);
    study_request_clear(&computation->inquiry);
    free(computation->scene);
    free(computation->warnings);
    free(computation->askers.at);
    free(computation);
}

Task *task_of(QueueEntry *entry) {
    return (Task *)(void *)((char *)entry - offsetof(Task, queued));
}

void jobs_call_worker(JobManager *intake) {
    pthread_cond_signal(&intake->work);
    if (intake->slow_running >= intake->settings.workers)
        pthread_cond_signal(&intake->spare_work);
}

void jobs_enqueue(JobManager *intake, Task *computation, QueueClient *client) {
    hashmap_add(intake->in_flight, &computation->indexed);
    study_estimate(computation, &intake->settings.limits);
    resolve_records_drop(&computation->inquiry); // until it is its turn
    if (client == NULL)
        queue_push_front(intake->queue, &computation->queued);
    else
        queue_put(intake->queue, &computation->queued, client, 1e-9 * (double)clock_monotonic_ns());
    jobs_call_worker(intake);
}

void jobs_release(Job *job) {
    if (!job->is_counted)
        return;
    job->is_counted = false;
    job->intake->live--;
    job->client->live--;
    job->intake->scene_bytes -= job->scene_size;
}

void jobs_retire(Job *job) {
    jobs_release(job);
    if (!job->is_live)
        return;
    job->is_live = false;
    hashmap_remove(job->intake->jobs, &job->indexed);
    job_unref(job);
}

void jobs_settle(JobManager *intake) {
    if (--intake->posted == 0)
        pthread_cond_broadcast(&intake->settled);
}

void jobs_refuse(Job *job, Status status, const char *detail) {
    job->refusal = status;
    text_fit(job->refused, sizeof job->refused, detail);
    job->row.state = JOB_FAILED;
    subscribers_call(&job->wakers);
    subscribers_call(&job->keepers);
    jobs_detach(job);
    jobs_retire(job);
}

void jobs_withdraw(Job *job) {
    if (job->ticket == NULL || !db_cancel_write(job->intake->store, job->ticket))
        return;
    job->ticket = NULL;
    jobs_settle(job->intake);
    job_unref(job); // the post's hold
}

void jobs_drop(JobManager *intake) {
    if (intake == NULL || atomic_fetch_sub(&intake->holds, 1) != 1)
        return;
    pthread_cond_destroy(&intake->work);
    pthread_cond_destroy(&intake->spare_work);
    pthread_cond_destroy(&intake->keys_free);
    pthread_cond_destroy(&intake->settled);
    pthread_mutex_destroy(&intake->retries);
    naming_destroy(&intake->naming);
    pthread_mutex_destroy(&intake->lock);
    free(intake);
}

void jobs_detach(Job *job) {
    Task *computation = job->computation;
    if (computation == NULL)
        return;
    for (Job **at = &computation->jobs; *at != NULL; at = &(*at)->next_shared)
        if (*at == job) {
            *at = job->next_shared;
            break;
        }
    job->computation = NULL;
    job->next_shared = NULL;
    job_unref(job); // the computation's hold
    if (computation->jobs != NULL || computation->askers.count > 0)
        return;
    // Nobody wants it any more. Whoever asks for the same scene from now on starts anew.
    hashmap_remove(job->intake->in_flight, &computation->indexed);
    if (computation->is_running) {
        atomic_store(&computation->is_stopped, true);
        if (computation->study != NULL)
            study_stop(computation->study);
    } else {
        queue_remove(job->intake->queue, &computation->queued);
        task_free(computation);
    }
}

void jobs_attach(Job *job, Task *computation) {
    job->computation = computation;
    job->next_shared = computation->jobs;
    computation->jobs = job_ref(job);
    if (computation->is_running) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = clock_unix_ms();
        job->started_ns = clock_monotonic_ns();
    }
}

void jobs_admit(JobManager *intake, Job *job) {
    job->scene_size = strlen(job->row.scene);
    hashmap_add(intake->jobs, &job_ref(job)->indexed);
    job->is_live = true;
    job->is_counted = true;
    intake->live++;
    job->client->live++;
    intake->scene_bytes += job->scene_size;
}

static Status take_up_all(JobManager *intake, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = db_job_unfinished(intake->store, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = jobs_take_up(intake, &rows.at[i], problem);
    job_rows_clear(&rows);
    return status;
}

Status jobs_open(Db *store, const JobManagerSettings *settings, JobManager **opened,
                 Problem *problem) {
    JobManager *intake = calloc(1, sizeof *intake);
    *opened = NULL;
    if (intake == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    atomic_init(&intake->holds, 1);
    intake->store = store;
    intake->settings = *settings;
    if (intake->settings.queue_bytes == 0)
        intake->settings.queue_bytes = queue_bytes_usual;
    pthread_mutex_init(&intake->lock, NULL);
    pthread_mutex_init(&intake->retries, NULL);
    naming_init(&intake->naming);
    pthread_cond_init(&intake->work, NULL);
    pthread_cond_init(&intake->spare_work, NULL);
    pthread_cond_init(&intake->keys_free, NULL);
    intake->pace = 1;
    intake->queue = queue_new();
    pthread_cond_init(&intake->settled, NULL);
    intake->jobs = hashmap_new();
    intake->in_flight = hashmap_new();
    intake->cache = cache_new(settings->cache_bytes);
    intake->workers = calloc(settings->workers + 1, sizeof *intake->workers);
    Status status = STATUS_OK;
    if (intake->jobs == NULL || intake->in_flight == NULL || intake->cache == NULL ||
        intake->queue == NULL || intake->workers == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    if (status == STATUS_OK)
        status = db_sweep_tidy(store, problem);
    if (status == STATUS_OK)
        status = take_up_all(intake, problem);
    pthread_mutex_lock(&intake->lock); // those that run already look at the others
    while (status == STATUS_OK && intake->worker_count < settings->workers + 1) {
        Worker *worker = &intake->workers[intake->worker_count];
        worker->intake = intake;
        worker->is_spare = intake->worker_count == settings->workers;
        if (pthread_create(&worker->thread, NULL, worker_main, worker) != 0)
            status = problem_set(problem, STATUS_INTERNAL, "worker %zu of %zu could not be started",
                                 intake->worker_count + 1, settings->workers + 1);
        else
            intake->worker_count++;
    }
    pthread_mutex_unlock(&intake->lock);
    if (status != STATUS_OK) {
        jobs_close(intake);
        return status;
    }
    *opened = intake;
    return STATUS_OK;
}

static void let_go(Task *computation) {
    while (computation->jobs != NULL) {
        Job *job = computation->jobs;
        computation->jobs = job->next_shared;
        job->computation = NULL;
        jobs_retire(job);
        subscribers_call(&job->wakers);
        job_unref(job); // the computation's hold
    }
    subscribers_call(&computation->askers);
    task_free(computation);
}

void jobs_close(JobManager *intake) {
    if (intake == NULL)
        return;
    pthread_mutex_lock(&intake->lock);
    intake->is_closing = true;
    for (size_t i = 0; i < intake->worker_count; i++)
        if (intake->workers[i].running != NULL)
            atomic_store(&intake->workers[i].running->is_stopped, true);
    for (StudyRun *run = intake->studies; run != NULL; run = run->next)
        atomic_store(&run->computation->is_stopped, true);
    pthread_cond_broadcast(&intake->work);
    pthread_cond_broadcast(&intake->spare_work);
    pthread_mutex_unlock(&intake->lock);
    for (size_t i = 0; i < intake->worker_count; i++)
        pthread_join(intake->workers[i].thread, NULL);
    pthread_mutex_lock(&intake->lock);
    while (intake->posted > 0)
        pthread_cond_wait(&intake->settled, &intake->lock);
    pthread_mutex_unlock(&intake->lock);
    // Whoever is still queued stays unfinished in the store, for the next start.
    while (intake->stalled != NULL) {
        Task *computation = intake->stalled;
        intake->stalled = computation->next_stalled;
        let_go(computation);
    }
    while (intake->studies != NULL) {
        Task *computation = intake->studies->computation;
        intake->studies = intake->studies->next;
        queue_remove(intake->queue, &computation->queued);
        let_go(computation);
    }
    for (QueueEntry *entry; (entry = queue_take(intake->queue, false)) != NULL;)
        let_go(task_of(entry));
    jobs_abandon_delayed(intake);
    for (Job *job; (job = intake->undismissed) != NULL;) {
        intake->undismissed = job->next_undismissed;
        job_unref(job);
    }
    for (Job *job; (job = intake->keyed) != NULL;) {
        intake->keyed = job->next_keyed;
        job_unref(job);
    }
    // Those whose end could not be stored are still here.
    for (Job *job; (job = hashmap_any(intake->jobs)) != NULL;)
        jobs_retire(job);
    cache_free(intake->cache);
    queue_free(intake->queue);
    hashmap_free(intake->jobs);
    hashmap_free(intake->in_flight);
    free(intake->workers);
    jobs_drop(intake);
}

Job *jobs_find_live(JobManager *intake, const char *id) {
    pthread_mutex_lock(&intake->lock);
    Job *job = hashmap_find(intake->jobs, id);
    if (job != NULL)
        job_ref(job);
    pthread_mutex_unlock(&intake->lock);
    return job;
}

Status jobs_find(JobManager *intake, const char *id, Job **found, Problem *problem) {
    *found = jobs_find_live(intake, id);
    if (*found != NULL)
        return STATUS_OK;
    Job *job = job_new(NULL);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->is_kept = true;
    const Status status = db_job_load(intake->store, id, &job->row, problem);
    if (status != STATUS_OK) {
        job_unref(job);
        return status;
    }
    ResultRow result = {0};
    if (job->row.state == JOB_SUCCESSFUL &&
        db_result_head(intake->store, job->row.result, &result, NULL) == STATUS_OK)
        job->head = result_summary_new(&result);
    result_row_clear(&result);
    *found = job;
    return STATUS_OK;
}

void jobs_forget(JobManager *intake, const char *result) {
    pthread_mutex_lock(&intake->lock);
    cache_forget(intake->cache, result);
    pthread_mutex_unlock(&intake->lock);
    if (intake->settings.deleted.wake != NULL)
        intake->settings.deleted.wake(intake->settings.deleted.context);
}

Status jobs_delete(JobManager *intake, const char *result, Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    const bool is_wanted = hashmap_find(intake->in_flight, result) != NULL;
    pthread_mutex_unlock(&intake->lock);
    if (is_wanted)
        return problem_set(problem, STATUS_CONFLICT,
                           "the result is being computed; dismiss its job first, or wait");
    TRY(db_result_delete(intake->store, result, problem));
    jobs_forget(intake, result);
    return STATUS_OK;
}

void jobs_layers(JobManager *intake, const char *result, CacheLayers *layers) {
    pthread_mutex_lock(&intake->lock);
    *layers = (CacheLayers){.in_memory = cache_has(intake->cache, result, false),
                            .series_in_memory = cache_has(intake->cache, result, true)};
    pthread_mutex_unlock(&intake->lock);
    layers->in_database = db_result_exists(intake->store, result);
    layers->series_in_database = db_series_exists(intake->store, result);
}

const JobMetrics *jobs_totals(const JobManager *intake) {
    return &intake->totals;
}

void jobs_tally(JobManager *intake, JobStats *tally) {
    pthread_mutex_lock(&intake->lock);
    *tally = (JobStats){.queued = queue_count(intake->queue),
                        .workers = intake->settings.workers,
                        .queue_most = intake->settings.queue_most,
                        .saving = intake->saving,
                        .rows = intake->rows,
                        .stored = intake->stored};
    cache_tally(intake->cache, &tally->series, &tally->heads);
    tally->cached_outcomes = tally->series.count;
    tally->cached_bytes = tally->series.bytes + tally->heads.bytes;
    for (size_t i = 0; i < intake->worker_count; i++)
        tally->running += intake->workers[i].running != NULL || intake->workers[i].study != NULL;
    pthread_mutex_unlock(&intake->lock);
    tally->stored.most_bytes = intake->settings.db_bytes;
}
