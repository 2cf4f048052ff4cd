// The way of a sweep:
//
//     a worker:   judge all points - pilot - chunks written down - launch
//     any worker: take a chunk, make its rows, store them ... until none is left
//     the last:   result and jobs, as of any computation
//
// While it has parts that wait, one turn of it stands in the queue: whoever takes that takes a part
// and puts the next turn behind the others'. What the store has is done. A full disk pauses it: the
// chunk's rows wait in memory and are tried again now and then.
#include "server/jobs/sweep.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/sweep_judge.h"
#include "server/base/clock.h"

enum { PILOT = 16, CHUNKS_PER_SLOT = 4 };
static const double pilot_seconds = 0.2;
static const double judging = 0.1; // of the progress of the study, to judge all points

void sweep_free(SweepRun *run) {
    if (run == NULL)
        return;
    while (run->first != NULL) {
        SweepPart *part = run->first;
        run->first = part->next;
        sweep_part_free(part);
    }
    sweep_plan_free(run->plan);
    sweep_row_clear(&run->row);
    findings_clear(&run->findings);
    free(run);
}

// With the lock held: the next turn is in the queue if there is something to do.
static void enqueue(SweepRun *run) {
    Intake *intake = run->intake;
    Computation *computation = run->computation;
    QueueEntry *entry = &computation->queued;
    if (entry->number != 0 || run->first == NULL || run->is_paused)
        return;
    entry->is_turn = true;
    entry->seconds = fmax(run->turn, 1e-3 * SWEEP_TURN_MS);
    Client *client = computation->jobs != NULL ? computation->jobs->client : entry->client;
    queue_put(intake->queue, entry, client, 1e-9 * (double)clock_monotonic_ns());
    intake_call_worker(intake);
}

void sweep_wait(SweepRun *run, SweepPart *part, bool is_first) {
    if (is_first || run->first == NULL) {
        part->next = run->first;
        run->first = part;
        if (run->last == NULL)
            run->last = part;
    } else {
        part->next = NULL;
        run->last->next = part;
        run->last = part;
    }
    enqueue(run);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the sweep");
}

// CPU that a point takes, about, by some of them [s].
static Status fly_pilot(Worker *worker, SweepRun *run, double *seconds, Problem *problem) {
    const Watch watch = {run, sweep_goes_on};
    const size_t points = run->plan->points, most = points < PILOT ? points : PILOT;
    double *values = calloc(run->row.metrics, sizeof *values);
    if (values == NULL)
        return no_memory(problem);
    const int64_t began_ns = clock_thread_cpu_ns();
    Status status = STATUS_OK;
    size_t made = 0;
    while (made < most && status == STATUS_OK) {
        SweepStatus kept;
        status = sweep_run_point(run->plan, (points - 1) * made / (most > 1 ? most - 1 : 1),
                                 &worker->intake->settings.limits, &watch, &worker->workspace,
                                 values, &kept, problem);
        made++;
        *seconds = 1e-9 * (double)(clock_thread_cpu_ns() - began_ns) / (double)made;
        if (*seconds * (double)made > pilot_seconds)
            break;
    }
    if (status == STATUS_OK)
        problem_clear(problem);
    free(values);
    return status;
}

static uint64_t count_chunks(const SweepPlan *plan, const ExecutorLimits *limits, double seconds) {
    const double points = (double)plan->points;
    double chunks = fmin(ceil(seconds * points / limits->chunk_seconds), (double)limits->chunks);
    chunks = fmax(chunks, ceil(points / (double)limits->chunk_points));
    chunks = fmax(chunks, (double)(CHUNKS_PER_SLOT * limits->slots));
    return (uint64_t)fmin(chunks, points);
}

// Intent is durable before anything runs; an earlier one stands.
static Status write_down(Worker *worker, SweepRun *run, Problem *problem) {
    Store *store = worker->intake->store;
    const Computation *computation = run->computation;
    ExecutorLimits limits;
    double seconds = 0;
    const uint64_t metrics = run->plan->study->metrics.count;
    const Status known = store_sweep_load(store, computation->result, &run->row, NULL);
    if (known != STATUS_OK && known != STATUS_NOT_FOUND)
        return problem_set(problem, known, "the sweeps could not be searched");
    if (known == STATUS_NOT_FOUND) {
        TRY(run->executor->probe(worker->intake, &limits, problem));
        run->row.metrics = metrics;
        TRY(fly_pilot(worker, run, &seconds, problem));
        text_fit(run->row.result, sizeof run->row.result, computation->result);
        run->row.scene = strdup(computation->scene);
        if (run->row.scene == NULL)
            return no_memory(problem);
        run->row.points = run->plan->points;
        run->row.chunks = count_chunks(run->plan, &limits, seconds);
        run->row.created_unix_ms = clock_unix_ms();
    }
    // Also what is there: it may be on the way out, with the last job before this one.
    TRY(store_sweep_begin(store, &run->row, problem));
    if (run->row.points != run->plan->points || run->row.metrics != metrics)
        return problem_set(problem, STATUS_INTERNAL,
                           "the stored sweep no longer stands for this scene");
    return STATUS_OK;
}

static Status fill_answer(const SweepRun *run, Findings *findings, Problem *problem) {
    findings->answer.study = variant_new(study_sweep.answer);
    if (findings->answer.study == NULL)
        return no_memory(problem);
    return sweep_tell(run->plan->study, run->plan->simulation,
                      (Sweep *)(void *)findings->answer.study, problem);
}

static Status open_run(Worker *worker, SweepRun *run, Findings *findings, const Watch *watch,
                       Problem *problem) {
    const Inquiry *inquiry = &run->computation->inquiry;
    const SimulationLimits *limits = &worker->intake->settings.limits;
    Stage stage = stage_of(watch, 0, judging);
    const Watch judge = stage_watch(&stage);
    run->executor = executors[0];
    TRY(sweep_plan_new((const SweepStudy *)(const void *)inquiry->study, &inquiry->simulation,
                       limits, &run->plan, problem));
    TRY(sweep_check(run->plan, false, limits, &judge, problem));
    TRY(fill_answer(run, findings, problem));
    return write_down(worker, run, problem);
}

Status sweep_open(Worker *worker, Computation *computation, Findings *findings, const Watch *watch,
                  Problem *problem) {
    Intake *intake = worker->intake;
    SweepRun *run = calloc(1, sizeof *run);
    if (run == NULL)
        return no_memory(problem);
    run->intake = intake;
    run->computation = computation;
    run->in_hand = 1; // ours, until it was launched: nobody ends it meanwhile
    atomic_init(&run->done, 0);
    atomic_init(&run->failed, 0);
    const Status status = open_run(worker, run, findings, watch, problem);
    if (status != STATUS_OK) {
        sweep_free(run);
        return status;
    }
    pthread_mutex_lock(&intake->lock);
    computation->sweep = run; // which frees it from here on
    pthread_mutex_unlock(&intake->lock);
    return STATUS_OK;
}

// Chunks that the store has not and that nobody is at.
static Status submit_missing(SweepRun *run, Problem *problem) {
    SweepChunkRows there = {NULL, 0};
    TRY(store_sweep_chunks(run->intake->store, run->row.number, &there, problem));
    size_t *missing = calloc(run->row.chunks, sizeof *missing);
    size_t count = 0, next = 0, left = 0;
    for (size_t chunk = 0; missing != NULL && chunk < run->row.chunks; chunk++) {
        const SweepChunkRow *row =
            next < there.count && there.at[next].chunk == chunk ? &there.at[next++] : NULL;
        if (row != NULL) {
            const size_t rows = sweep_rows_of(&run->row, chunk);
            atomic_fetch_add(&run->done, row->is_open ? rows - row->failed : rows);
            atomic_fetch_add(&run->failed, row->is_open ? 0 : row->failed);
        }
        if (row != NULL && !row->is_open)
            continue;
        left++;
        if (run->executor->poll(run, chunk) == CHUNK_DEAD)
            missing[count++] = chunk;
    }
    sweep_chunk_rows_clear(&there);
    pthread_mutex_lock(&run->intake->lock);
    run->left = left;
    pthread_mutex_unlock(&run->intake->lock);
    const Status status =
        missing == NULL ? no_memory(problem) : run->executor->submit(run, missing, count, problem);
    free(missing);
    return status;
}

// With the lock held.
static void fail(SweepRun *run, Status status, const Problem *problem) {
    if (run->is_failed)
        return;
    run->is_failed = true;
    findings_fail(&run->findings, status, problem);
}

static bool is_over(const SweepRun *run) {
    return run->left == 0 || run->is_failed || atomic_load(&run->computation->is_stopped);
}

// With the lock held, by whoever had something of it in hand: whether it is to be ended now, by
// them. It is in no list any more then, and stays in their hands.
static bool let_go(SweepRun *run) {
    if (!is_over(run) || run->in_hand > 1) {
        run->in_hand--;
        return false;
    }
    Intake *intake = run->intake;
    queue_remove(intake->queue, &run->computation->queued);
    for (SweepRun **at = &intake->sweeps; *at != NULL; at = &(*at)->next)
        if (*at == run) {
            *at = run->next;
            break;
        }
    return true;
}

void sweep_launch(Intake *intake, Computation *computation, Findings *findings, Problem *problem) {
    SweepRun *run = computation->sweep;
    run->findings = *findings;
    *findings = (Findings){0};
    pthread_mutex_lock(&intake->lock);
    run->next = intake->sweeps;
    intake->sweeps = run;
    run->left = run->row.chunks;
    pthread_mutex_unlock(&intake->lock);
    problem_clear(problem);
    const Status status = submit_missing(run, problem);
    pthread_mutex_lock(&intake->lock);
    if (status != STATUS_OK)
        fail(run, status, problem);
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&intake->lock);
    if (is_ended)
        sweep_end(intake, run);
}

SweepPart *sweep_take(SweepRun *run, bool *is_ended) {
    run->in_hand++;
    *is_ended = false;
    if (is_over(run)) {
        *is_ended = let_go(run);
        return NULL;
    }
    SweepPart *part = run->first; // there is one: else it would have no turn
    run->first = part->next;
    if (run->first == NULL)
        run->last = NULL;
    part->next = NULL;
    enqueue(run);
    return part;
}

void sweep_stop(SweepRun *run) {
    if (run->in_hand > 0)
        return; // they will see
    queue_remove(run->intake->queue, &run->computation->queued);
    queue_urge(run->intake->queue, &run->computation->queued);
    intake_call_worker(run->intake);
}

void sweeps_resume(Intake *intake) {
    while (intake->stalled != NULL) {
        Computation *computation = intake->stalled;
        intake->stalled = computation->next_stalled;
        queue_urge(intake->queue, &computation->queued);
        intake_call_worker(intake);
    }
    for (SweepRun *run = intake->sweeps; run != NULL; run = run->next)
        if (run->is_paused) {
            run->is_paused = false;
            enqueue(run);
        }
}

// With the lock held.
static void pause(SweepRun *run, const Problem *problem) {
    if (!run->is_told)
        fprintf(stderr, "impactd: the sweep %s pauses: %s\n", run->row.result, problem->detail);
    run->is_told = run->is_paused = true;
    queue_remove(run->intake->queue, &run->computation->queued);
}

void sweep_work(Worker *worker, SweepRun *run, SweepPart *part, Problem *problem) {
    Intake *intake = worker->intake;
    const size_t place = part->place;
    const int64_t began_ns = clock_monotonic_ns(), began_cpu_ns = clock_thread_cpu_ns();
    problem_clear(problem);
    Status status = part->is_computed ? STATUS_OK : sweep_part_make(worker, run, part, problem);
    const double seconds = 1e-9 * (double)(clock_monotonic_ns() - began_ns);
    const bool is_parked = status == STATUS_BUSY;
    totals_study_part(&intake->totals, clock_thread_cpu_ns() - began_cpu_ns);
    if (status == STATUS_OK)
        status = store_sweep_take(intake->store, &part->row, problem);
    pthread_mutex_lock(&intake->lock);
    worker->sweep = NULL;
    intake->slow_running--;
    // At least one row is made at a time.
    if (part->place > place)
        run->turn = seconds / (double)(part->place - place);
    if (status == STATUS_OK) {
        run->left--;
        run->is_told = false;
    } else if (is_parked || status_is_passing(status)) {
        if (!is_parked)
            pause(run, problem);
        sweep_wait(run, part, true);
        part = NULL;
    } else if (status != STATUS_CANCELLED) {
        fail(run, status, problem);
    }
    const bool is_ended = let_go(run);
    pthread_mutex_unlock(&intake->lock);
    sweep_part_free(part);
    if (is_ended)
        sweep_end(intake, run);
}

void sweep_end(Intake *intake, SweepRun *run) {
    Computation *computation = run->computation;
    run->executor->cancel(run);
    run->findings.ended_ns = clock_monotonic_ns();
    if (atomic_load(&computation->is_stopped)) {
        computation_abandon(intake, computation); // and the run
        (void)store_sweep_tidy(intake->store, NULL);
    } else {
        Findings findings = run->findings;
        run->findings = (Findings){0};
        computation_finish(intake, computation, &findings);
        findings_clear(&findings);
    }
}
