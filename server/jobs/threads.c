// The workers' threads as executor of sweeps: chunks wait in the sweep's own list, and a worker
// takes one between ordinary jobs. Nothing of a chunk outlives the daemon, so after a restart all
// that the store has not is dead.
#include <stdlib.h>

#include "server/jobs/sweep.h"

// Short ones let rows appear soon, and little is lost with the daemon.
static const double chunk_seconds = 0.25;
enum { CHUNKS = 4096, CHUNK_POINTS = 1 << 16 };

static Status threads_probe(Intake *intake, ExecutorLimits *limits, Problem *problem) {
    (void)problem;
    *limits = (ExecutorLimits){.slots = intake->settings.workers,
                               .chunk_seconds = chunk_seconds,
                               .chunks = CHUNKS,
                               .chunk_points = CHUNK_POINTS};
    return STATUS_OK;
}

static void drop_waiting(SweepRun *run) {
    while (run->first != NULL) {
        SweepPart *part = run->first;
        run->first = part->next;
        sweep_part_free(part);
    }
    run->last = NULL;
}

static Status threads_submit(SweepRun *run, const size_t *chunks, size_t count, Problem *problem) {
    SweepPart *first = NULL, **last = &first;
    Intake *intake = run->intake;
    for (size_t i = 0; i < count; i++) {
        *last = calloc(1, sizeof **last);
        if (*last == NULL) {
            while (first != NULL) {
                SweepPart *part = first;
                first = part->next;
                sweep_part_free(part);
            }
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu chunks", count);
        }
        (*last)->chunk = chunks[i];
        last = &(*last)->next;
    }
    pthread_mutex_lock(&intake->lock);
    while (first != NULL) {
        SweepPart *part = first;
        first = part->next;
        sweep_wait(run, part, false);
    }
    pthread_mutex_unlock(&intake->lock);
    return STATUS_OK;
}

static ChunkState threads_poll(SweepRun *run, size_t chunk) {
    ChunkState state = CHUNK_DEAD;
    pthread_mutex_lock(&run->intake->lock);
    for (const SweepPart *part = run->first; part != NULL; part = part->next)
        if (part->chunk == chunk)
            state = CHUNK_LIVE;
    for (size_t i = 0; i < run->intake->worker_count; i++)
        if (run->intake->workers[i].sweep == run && run->intake->workers[i].chunk == chunk)
            state = CHUNK_LIVE;
    pthread_mutex_unlock(&run->intake->lock);
    return state;
}

static void threads_cancel(SweepRun *run) {
    pthread_mutex_lock(&run->intake->lock);
    drop_waiting(run);
    pthread_mutex_unlock(&run->intake->lock);
}

const Executor executor_threads = {
    .name = "threads",
    .doc = "the daemon's own workers",
    .probe = threads_probe,
    .submit = threads_submit,
    .poll = threads_poll,
    .cancel = threads_cancel,
};
