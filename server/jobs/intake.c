// The door. A scene becomes a job that is durable before anyone hears of it; equal scenes in flight share one
// computation; a known result finishes its job at once.
#include "server/jobs/intake.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "server/base/bytes.h"
#include "server/base/clock.h"
#include "server/codec/write.h"
#include "server/jobs/documents.h"
#include "server/jobs/intake_state.h"

// CPU time of a solver step, with its share of statistics and spectra, on a middling machine [s].
static const double step_seconds = 4e-8;

// --- computations ----------------------------------------------------------------------------------------

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
    simulation_clear(&computation->simulation);
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
    job_drop(job);  // the computation's hold
    if (computation->jobs != NULL || computation->askers.count > 0)
        return;
    // Nobody wants it any more. Whoever asks for the same scene from now on starts anew.
    index_remove(job->intake->in_flight, &computation->indexed);
    if (computation->is_running) {
        atomic_store(&computation->is_stopped, true);
    } else {
        dequeue(job->intake, computation);
        computation_free(computation);
    }
}

static void attach(Job *job, Computation *computation) {
    job->computation = computation;
    job->next_shared = computation->jobs;
    computation->jobs = job_hold(job);
    if (computation->is_running) {
        job->row.state = JOB_RUNNING;
        job->row.started_unix_ms = clock_unix_ms();
        job->started_ns = clock_monotonic_ns();
    }
}

// --- opening and closing -----------------------------------------------------------------------------------

static Status make_id(char id[40]) {
    unsigned char bytes[12];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes)
        return STATUS_INTERNAL;
    size_t at = (size_t)snprintf(id, 40, "j-");
    for (size_t i = 0; i < sizeof bytes; i++)
        at += (size_t)snprintf(id + at, 40 - at, "%02x", (unsigned)bytes[i]);
    return STATUS_OK;
}

static char *document_text(Bytes *bytes) {
    return bytes_take(bytes, NULL);
}

static void fail_row(JobRow *row, const Problem *problem) {
    Bytes bytes = {.most = 1 << 20};
    write_problem(&bytes, problem, 422, NULL);
    row->state = JOB_FAILED;
    row->problem = document_text(&bytes);
    row->finished_unix_ms = clock_unix_ms();
}

// A job that an earlier run of the daemon accepted and did not finish. Takes the row.
static Status take_up(Intake *intake, JobRow *row, Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    Job *job = job_new(intake);
    Computation *computation = NULL;
    Simulation simulation = {0};
    Warnings warnings = {NULL, 0};
    Status status = fault == NULL || job == NULL ? STATUS_NO_MEMORY : STATUS_OK;
    if (status == STATUS_OK) {
        const Status prepared = intake_prepare(intake->store, row->scene, strlen(row->scene),
                                               &intake->settings.limits, &simulation, &warnings, fault);
        if (prepared != STATUS_OK) {
            // The limits or the program changed meanwhile: the job's owner learns why.
            fail_row(row, fault);
            status = store_job_update(intake->store, row, problem);
        } else {
            intake_result_id(&simulation, row->result);
            job->row = *row;
            *row = (JobRow){0};
            job->row.state = JOB_ACCEPTED;
            job->submitted_ns = clock_monotonic_ns();
            job->indexed.key = job->row.id;
            computation = index_find(intake->in_flight, job->row.result);
            if (computation == NULL && (computation = computation_new(job->row.result)) != NULL) {
                computation->simulation = simulation;
                simulation = (Simulation){0};
                computation->scene = strdup(job->row.scene);
                computation->warnings = job->row.warnings == NULL ? NULL : strdup(job->row.warnings);
                intake_enqueue(intake, computation, false);
            }
            status = computation == NULL ? STATUS_NO_MEMORY : STATUS_OK;
            if (status == STATUS_OK) {
                index_add(intake->jobs, &job_hold(job)->indexed);
                intake->live++;
                attach(job, computation);
            }
        }
    }
    simulation_clear(&simulation);
    warnings_clear(&warnings);
    job_drop(job);
    free(fault);
    return status == STATUS_NO_MEMORY ? problem_set(problem, status, "no memory for the unfinished jobs") : status;
}

static Status take_up_all(Intake *intake, Problem *problem) {
    JobRows rows = {NULL, 0};
    Status status = store_job_unfinished(intake->store, &rows, problem);
    for (size_t i = 0; i < rows.count && status == STATUS_OK; i++)
        status = take_up(intake, &rows.at[i], problem);
    job_rows_clear(&rows);
    return status;
}

Status intake_open(Store *store, const IntakeSettings *settings, Intake **opened, Problem *problem) {
    Intake *intake = calloc(1, sizeof *intake);
    *opened = NULL;
    if (intake == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
    intake->store = store;
    intake->settings = *settings;
    pthread_mutex_init(&intake->lock, NULL);
    pthread_cond_init(&intake->work, NULL);
    intake->jobs = index_new();
    intake->in_flight = index_new();
    intake->cache = cache_new(settings->cache_bytes);
    intake->workers = calloc(settings->workers, sizeof *intake->workers);
    Status status = STATUS_OK;
    if (intake->jobs == NULL || intake->in_flight == NULL || intake->cache == NULL || intake->workers == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the job queue");
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
        index_remove(job->intake->jobs, &job->indexed);
        wakers_call(&job->wakers);
        job_drop(job);  // the computation's hold
        job_drop(job);  // the index's
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
    cache_free(intake->cache);
    index_free(intake->jobs);
    index_free(intake->in_flight);
    pthread_cond_destroy(&intake->work);
    pthread_mutex_destroy(&intake->lock);
    free(intake->workers);
    free(intake);
}

// --- submitting --------------------------------------------------------------------------------------------

// The plan and summary of a result that is there already; false if it is not.
static bool find_known(Intake *intake, Job *job) {
    pthread_mutex_lock(&intake->lock);
    Outcome *outcome = cache_find(intake->cache, job->row.result);
    pthread_mutex_unlock(&intake->lock);
    if (outcome != NULL) {
        Bytes plan = {0}, summary = {0};
        document_plan(&plan, &outcome->plan);
        document_summary(&summary, &outcome->summary);
        job->plan = document_text(&plan);
        job->summary = document_text(&summary);
        outcome_drop(outcome);
        return true;
    }
    ResultRow row = {0};
    if (store_result_head(intake->store, job->row.result, &row, NULL) != STATUS_OK) {
        result_row_clear(&row);
        return false;
    }
    job->plan = row.plan;
    job->summary = row.summary;
    row.plan = row.summary = NULL;
    result_row_clear(&row);
    return true;
}

static Status finish_known(Intake *intake, Job *job, Problem *problem) {
    JobRow *row = &job->row;
    row->state = JOB_SUCCESSFUL;
    row->is_cached = true;
    row->started_unix_ms = row->finished_unix_ms = clock_unix_ms();
    row->total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    return store_job_add(intake->store, row, problem);
}

// Room in the queue, or why there is none; the job counts from here on.
static Status enter(Intake *intake, Job *job, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&intake->lock);
    if (intake->is_closing)
        status = problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    else if (intake->live >= intake->settings.queue_most)
        status = problem_set(problem, STATUS_BUSY, "the queue is full: %zu jobs are unfinished, %zu are allowed",
                             intake->live, intake->settings.queue_most);
    else {
        index_add(intake->jobs, &job_hold(job)->indexed);
        intake->live++;
    }
    pthread_mutex_unlock(&intake->lock);
    return status;
}

static void leave(Intake *intake, Job *job) {
    pthread_mutex_lock(&intake->lock);
    index_remove(intake->jobs, &job->indexed);
    intake->live--;
    pthread_mutex_unlock(&intake->lock);
    job_drop(job);
}

// Takes the simulation unless the computation is under way already.
static Status start(Intake *intake, Job *job, Simulation *simulation, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&intake->lock);
    Computation *computation = index_find(intake->in_flight, job->row.result);
    if (job_state_is_final(job->row.state)) {
        computation = NULL;  // dismissed meanwhile
    } else if (computation != NULL) {
        attach(job, computation);
    } else if ((computation = computation_new(job->row.result)) == NULL ||
               (computation->scene = strdup(job->row.scene)) == NULL ||
               (computation->warnings = strdup(job->row.warnings)) == NULL) {
        computation_free(computation);
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    } else {
        computation->simulation = *simulation;
        *simulation = (Simulation){0};
        attach(job, computation);
        intake_enqueue(intake, computation, false);
    }
    pthread_mutex_unlock(&intake->lock);
    return status;
}

static Status fill_job(Job *job, const Simulation *simulation, const Warnings *warnings, Problem *problem) {
    JobRow *row = &job->row;
    Bytes scene = {0}, told = {0};
    TRY(make_id(row->id) == STATUS_OK ? STATUS_OK
                                      : problem_set(problem, STATUS_INTERNAL, "no random numbers for a job's id"));
    job->indexed.key = row->id;
    row->created_unix_ms = clock_unix_ms();
    intake_result_id(simulation, row->result);
    document_scene(&scene, simulation);
    document_warnings(&told, warnings);
    row->scene = document_text(&scene);
    row->warnings = document_text(&told);
    row->title = simulation->title == NULL ? NULL : strdup(simulation->title);
    if (row->result[0] == '\0' || row->scene == NULL || row->warnings == NULL ||
        (row->title == NULL && simulation->title != NULL))
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    return STATUS_OK;
}

static Status submit(Intake *intake, Job *job, Simulation *simulation, Problem *problem) {
    if (find_known(intake, job))
        return finish_known(intake, job, problem);
    TRY(enter(intake, job, problem));
    Status status = store_job_add(intake->store, &job->row, problem);
    if (status == STATUS_OK)
        status = start(intake, job, simulation, problem);
    if (status != STATUS_OK)
        leave(intake, job);
    return status;
}

Status intake_submit(Intake *intake, const char *text, size_t size, Job **accepted, Problem *problem) {
    *accepted = NULL;
    Job *job = job_new(intake);
    if (job == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a job");
    job->submitted_ns = clock_monotonic_ns();
    Simulation simulation = {0};
    Warnings warnings = {NULL, 0};
    Status status = intake_prepare(intake->store, text, size, &intake->settings.limits, &simulation, &warnings,
                                   problem);
    if (status == STATUS_OK)
        status = fill_job(job, &simulation, &warnings, problem);
    if (status == STATUS_OK)
        status = submit(intake, job, &simulation, problem);
    simulation_clear(&simulation);
    warnings_clear(&warnings);
    if (status != STATUS_OK) {
        job_drop(job);
        return status;
    }
    *accepted = job;
    return STATUS_OK;
}

// --- dry runs ------------------------------------------------------------------------------------------------

void dry_run_clear(DryRun *dry_run) {
    simulation_clear(&dry_run->simulation);
    warnings_clear(&dry_run->warnings);
    fields_clear(plan_report_fields, &dry_run->plan);
}

Status intake_dry_run(Intake *intake, const char *text, size_t size, DryRun *dry_run, Problem *problem) {
    memset(dry_run, 0, sizeof *dry_run);
    TRY(intake_prepare(intake->store, text, size, &intake->settings.limits, &dry_run->simulation,
                       &dry_run->warnings, problem));
    intake_result_id(&dry_run->simulation, dry_run->result);
    TRY(simulation_plan(&dry_run->simulation, &dry_run->plan, problem));
    dry_run->cost = simulation_cost(&dry_run->simulation);
    dry_run->cpu_seconds = dry_run->cost.steps * step_seconds;
    pthread_mutex_lock(&intake->lock);
    Outcome *outcome = cache_find(intake->cache, dry_run->result);
    pthread_mutex_unlock(&intake->lock);
    dry_run->is_cached = outcome != NULL || store_result_exists(intake->store, dry_run->result);
    outcome_drop(outcome);
    return STATUS_OK;
}

// --- finding and dismissing ------------------------------------------------------------------------------------

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
        result.plan = result.summary = NULL;
    }
    result_row_clear(&result);
    *found = job;
    return STATUS_OK;
}

static Status refuse_finished(const char *id, int state, Problem *problem) {
    return problem_set(problem, STATUS_CONFLICT, "the job %.40s cannot be dismissed: it is %s already", id,
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
    job->row.finished_unix_ms = clock_unix_ms();
    job->row.total = 1e-9 * (double)(clock_monotonic_ns() - job->submitted_ns);
    intake_detach(job);
    index_remove(intake->jobs, &job->indexed);
    intake->live--;
    wakers_call(&job->wakers);
    pthread_mutex_unlock(&intake->lock);
    const Status status = store_job_update(intake->store, &job->row, problem);
    job_drop(job);  // the index's hold
    return status;
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

// --- outcomes --------------------------------------------------------------------------------------------------

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

static Status compute_again(Intake *intake, const char *result, const Waker *waker, Problem *problem) {
    ResultRow row = {0};
    Simulation simulation = {0};
    Warnings warnings = {NULL, 0};
    Computation *computation = NULL;
    Status status = store_result_load(intake->store, result, &row, problem);
    if (status == STATUS_OK && strcmp(row.engine, engine_version) != 0)
        status = problem_set(problem, STATUS_GONE,
                             "the series was made by %s, this is %s: submit the scene anew to have it again",
                             row.engine, engine_version);
    // The scene was judged when it came; today's limits are no reason to refuse it now.
    if (status == STATUS_OK)
        status = intake_prepare(intake->store, row.scene, strlen(row.scene), NULL, &simulation, &warnings, problem);
    if (status == STATUS_OK && (computation = computation_new(result)) == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the series");
    if (status == STATUS_OK) {
        computation->simulation = simulation;
        simulation = (Simulation){0};
        computation->is_again = true;
        pthread_mutex_lock(&intake->lock);
        Computation *other = index_find(intake->in_flight, result);
        const bool is_asked = wakers_add(&(other != NULL ? other : computation)->askers, waker);
        if (other == NULL && is_asked && !intake->is_closing) {
            intake_enqueue(intake, computation, true);
            computation = NULL;
        }
        if (!is_asked || intake->is_closing)
            status = problem_set(problem, STATUS_BUSY, "the series cannot be computed now");
        pthread_mutex_unlock(&intake->lock);
    }
    computation_free(computation);
    simulation_clear(&simulation);
    warnings_clear(&warnings);
    result_row_clear(&row);
    return status;
}

Status intake_outcome(Intake *intake, const char *result, const Waker *waker, Outcome **outcome, Problem *problem) {
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
