// The jobs room as a whole: its computations and who waits for them, opening, closing, finding and
// dismissing.
#include "server/jobs/intake.h"

#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/jobs/sweep.h"

// Of scenes that wait, where the settings say nothing.
static const size_t queue_bytes_usual = (size_t)256 << 20;

Computation *computation_new(const char *result) {
    Computation *computation = calloc(1, sizeof *computation);
    if (computation == NULL)
        return NULL;
    text_fit(computation->result, sizeof computation->result, result);
    computation->indexed.key = computation->result;
    atomic_init(&computation->is_stopped, false);
    atomic_init(&computation->progress, 0);
    return computation;
}

void computation_free(Computation *computation) {
    if (computation == NULL)
        return;
    sweep_free(computation->sweep);
    inquiry_clear(&computation->inquiry);
    free(computation->scene);
    free(computation->warnings);
    free(computation->askers.at);
    free(computation);
}

void intake_enqueue(Intake *intake, Computation *computation, bool is_urgent) {
    index_add(intake->in_flight, &computation->indexed);
    if (is_urgent) {
        computation->next = intake->first;
        intake->first = computation;
        if (intake->last == NULL)
            intake->last = computation;
    } else {
        *(intake->last != NULL ? &intake->last->next : &intake->first) = computation;
        intake->last = computation;
    }
    intake->queued++;
    pthread_cond_signal(&intake->work);
}

void intake_release(Job *job) {
    if (!job->is_counted)
        return;
    job->is_counted = false;
    job->intake->live--;
    job->intake->scene_bytes -= job->scene_size;
}

void intake_retire(Job *job) {
    Intake *intake = job->intake;
    intake_release(job);
    index_remove(intake->jobs, &job->indexed);
    job_drop(job);
}

void intake_drop(Intake *intake) {
    if (intake == NULL || atomic_fetch_sub(&intake->holds, 1) != 1)
        return;
    pthread_cond_destroy(&intake->work);
    pthread_mutex_destroy(&intake->lock);
    free(intake);
}

static void dequeue(Intake *intake, Computation *computation) {
    Computation *before = NULL;
    for (Computation *at = intake->first; at != NULL; before = at, at = at->next)
        if (at == computation) {
            *(before != NULL ? &before->next : &intake->first) = at->next;
            if (intake->last == at)
                intake->last = before;
            intake->queued--;
            return;
        }
}

void intake_detach(Job *job) {
    Computation *computation = job->computation;
    if (computation == NULL)
        return;
    for (Job **at = &computation->jobs; *at != NULL; at = &(*at)->next_shared)
        if (*at == job) {
            *at = job->next_shared;
            break;
        }
    job->computation = NULL;
    job->next_shared = NULL;
    job_drop(job); // the computation's hold
    if (computation->jobs != NULL || computation->askers.count > 0)
        return;
    // Nobody wants it any more. Whoever asks for the same scene from now on starts anew.
    index_remove(job->intake->in_flight, &computation->indexed);
    if (computation->is_running) {
        atomic_store(&computation->is_stopped, true);
        pthread_cond_broadcast(&job->intake->work); // a sweep that no worker has in hand
    } else {
        dequeue(job->intake, computation);
        computation_free(computation);
    }
}

void intake_attach(Job *job, Computation *computation) {
    job->computation = computation;
    job->next_shared = computation->jobs;
    computation->jobs = job_hold(job);
    if (computation->is_running) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = clock_unix_ms();
        job->started_ns = clock_monotonic_ns();
    }
}

void intake_admit(Intake *intake, Job *job) {
    job->scene_size = strlen(job->row.scene);
    index_add(intake->jobs, &job_hold(job)->indexed);
    job->is_counted = true;
    intake->live++;
    intake->scene_bytes += job->scene_size;
}

static Status take_up_all(Intake *intake, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = store_job_unfinished(intake->store, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = intake_take_up(intake, &rows.at[i], problem);
    job_rows_clear(&rows);
    return status;
}

Status intake_open(Store *store, const IntakeSettings *settings, Intake **opened,
                   Problem *problem) {
    Intake *intake = calloc(1, sizeof *intake);
    *opened = NULL;
    if (intake == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    atomic_init(&intake->holds, 1);
    intake->store = store;
    intake->settings = *settings;
    if (intake->settings.queue_bytes == 0)
        intake->settings.queue_bytes = queue_bytes_usual;
    pthread_mutex_init(&intake->lock, NULL);
    pthread_condattr_t by_monotonic;
    pthread_condattr_init(&by_monotonic);
    pthread_condattr_setclock(&by_monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&intake->work, &by_monotonic);
    pthread_condattr_destroy(&by_monotonic);
    intake->jobs = index_new();
    intake->in_flight = index_new();
    intake->cache = cache_new(settings->cache_bytes);
    intake->workers = calloc(settings->workers, sizeof *intake->workers);
    Status status = STATUS_OK;
    if (intake->jobs == NULL || intake->in_flight == NULL || intake->cache == NULL ||
        intake->workers == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    if (status == STATUS_OK)
        status = store_sweep_tidy(store, problem);
    if (status == STATUS_OK)
        status = take_up_all(intake, problem);
    while (status == STATUS_OK && intake->worker_count < settings->workers) {
        Worker *worker = &intake->workers[intake->worker_count];
        worker->intake = intake;
        if (pthread_create(&worker->thread, NULL, worker_main, worker) != 0)
            status = problem_set(problem, STATUS_INTERNAL, "worker %zu of %zu could not be started",
                                 intake->worker_count + 1, settings->workers);
        else
            intake->worker_count++;
    }
    if (status != STATUS_OK) {
        intake_close(intake);
        return status;
    }
    *opened = intake;
    return STATUS_OK;
}

static void let_go(Computation *computation) {
    while (computation->jobs != NULL) {
        Job *job = computation->jobs;
        computation->jobs = job->next_shared;
        job->computation = NULL;
        intake_retire(job);
        wakers_call(&job->wakers);
        job_drop(job); // the computation's hold
    }
    wakers_call(&computation->askers);
    computation_free(computation);
}

void intake_close(Intake *intake) {
    if (intake == NULL)
        return;
    pthread_mutex_lock(&intake->lock);
    intake->is_closing = true;
    for (size_t i = 0; i < intake->worker_count; i++)
        if (intake->workers[i].running != NULL)
            atomic_store(&intake->workers[i].running->is_stopped, true);
    for (SweepRun *run = intake->sweeps; run != NULL; run = run->next)
        atomic_store(&run->computation->is_stopped, true);
    pthread_cond_broadcast(&intake->work);
    pthread_mutex_unlock(&intake->lock);
    for (size_t i = 0; i < intake->worker_count; i++)
        pthread_join(intake->workers[i].thread, NULL);
    // Whoever is still queued stays unfinished in the store, for the next start.
    while (intake->first != NULL) {
        Computation *computation = intake->first;
        dequeue(intake, computation);
        let_go(computation);
    }
    while (intake->sweeps != NULL) {
        Computation *computation = intake->sweeps->computation;
        intake->sweeps = intake->sweeps->next;
        let_go(computation);
    }
    // Those whose end could not be stored are still here.
    for (Job *job; (job = index_any(intake->jobs)) != NULL;)
        intake_retire(job);
    cache_free(intake->cache);
    index_free(intake->jobs);
    index_free(intake->in_flight);
    free(intake->workers);
    intake_drop(intake);
}

static Job *find_live(Intake *intake, const char *id) {
    pthread_mutex_lock(&intake->lock);
    Job *job = index_find(intake->jobs, id);
    if (job != NULL)
        job_hold(job);
    pthread_mutex_unlock(&intake->lock);
    return job;
}

Status intake_find(Intake *intake, const char *id, Job **found, Problem *problem) {
    *found = find_live(intake, id);
    if (*found != NULL)
        return STATUS_OK;
    Job *job = job_new(NULL);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    const Status status = store_job_load(intake->store, id, &job->row, problem);
    if (status != STATUS_OK) {
        job_drop(job);
        return status;
    }
    ResultRow result = {0};
    if (job->row.state == JOB_SUCCESSFUL &&
        store_result_head(intake->store, job->row.result, &result, NULL) == STATUS_OK) {
        job->plan = result.plan;
        job->summary = result.summary;
        job->work = result.work;
        job->notes = result.notes;
        result.plan = result.summary = result.work = result.notes = NULL;
    }
    result_row_clear(&result);
    *found = job;
    return STATUS_OK;
}

static Status refuse_finished(const char *id, int state, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT,
                       "the job %.40s cannot be dismissed: it is %s already", id,
                       job_state_names[state]);
}

// Live jobs only. The row is as it goes to the store.
static Status dismiss(Intake *intake, Job *job, Problem *problem) {
    pthread_mutex_lock(&intake->lock);
    if (job->is_closing || job_state_is_final(job->row.state)) {
        const int state = job->is_closing ? job->closing.state : job->row.state;
        pthread_mutex_unlock(&intake->lock);
        return refuse_finished(job->row.id, state, problem);
    }
    job->row.state = JOB_DISMISSED;
    if (job->started_ns > 0)
        job->row.run = 1e-9 * (double)(clock_monotonic_ns() - job->started_ns);
    job->row.finished_unix_ms = clock_unix_ms();
    job->row.total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    intake_detach(job);
    intake_release(job);
    wakers_call(&job->wakers);
    totals_ended(&intake->totals, JOB_DISMISSED, false);
    pthread_mutex_unlock(&intake->lock);
    // The row is final. Until the store has it, the job is found here.
    TRY(store_job_update(intake->store, &job->row, problem));
    pthread_mutex_lock(&intake->lock);
    intake_retire(job);
    pthread_mutex_unlock(&intake->lock);
    return STATUS_OK;
}

Status intake_dismiss(Intake *intake, const char *id, Job **dismissed, Problem *problem) {
    *dismissed = NULL;
    Job *job = find_live(intake, id);
    Status status;
    if (job != NULL) {
        status = dismiss(intake, job, problem);
    } else {
        TRY(intake_find(intake, id, &job, problem));
        status = refuse_finished(id, job->row.state, problem);
    }
    if (status != STATUS_OK) {
        job_drop(job);
        return status;
    }
    *dismissed = job;
    return STATUS_OK;
}

const Totals *intake_totals(const Intake *intake) {
    return &intake->totals;
}

void intake_tally(Intake *intake, IntakeTally *tally) {
    pthread_mutex_lock(&intake->lock);
    *tally = (IntakeTally){.queued = intake->queued,
                           .workers = intake->settings.workers,
                           .queue_most = intake->settings.queue_most,
                           .cached_outcomes = cache_count(intake->cache),
                           .cached_bytes = cache_bytes(intake->cache)};
    for (size_t i = 0; i < intake->settings.workers; i++)
        tally->running += intake->workers[i].running != NULL;
    pthread_mutex_unlock(&intake->lock);
}
