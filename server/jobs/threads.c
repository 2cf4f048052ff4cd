// The workers' threads as executor of studies: chunks wait in the study's own list, and a worker
// takes one between ordinary jobs. Nothing of a chunk outlives the daemon, so after a restart all
// that the store has not is dead.
#include <stdlib.h>

#include "server/jobs/study.h"

// Short ones let rows appear soon, and little is lost with the daemon.
static const double chunk_seconds = 0.25;
enum { CHUNKS = 4096, CHUNK_MEMBERS = 1 << 16 };

static Status threads_probe(JobManager *manager, ExecutorLimits *limits, Problem *problem) {
    (void)problem;
    *limits = (ExecutorLimits){.slots = manager->settings.workers,
                               .chunk_seconds = chunk_seconds,
                               .chunks = CHUNKS,
                               .chunk_members = CHUNK_MEMBERS};
    return STATUS_OK;
}

static void drop_waiting(StudyRun *run) {
    while (run->first != NULL) {
        ChunkRun *chunk_run = run->first;
        run->first = chunk_run->next;
        chunk_run_free(run, chunk_run);
    }
    run->last = NULL;
}

static Status threads_submit(StudyRun *run, const Chunk *chunks, size_t count, Problem *problem) {
    ChunkRun *first = NULL, **last = &first;
    JobManager *manager = run->manager;
    for (size_t i = 0; i < count; i++) {
        *last = calloc(1, sizeof **last);
        if (*last == NULL) {
            while (first != NULL) {
                ChunkRun *chunk_run = first;
                first = chunk_run->next;
                chunk_run_free(run, chunk_run);
            }
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu chunks", count);
        }
        (*last)->chunk = chunks[i];
        last = &(*last)->next;
    }
    pthread_mutex_lock(&manager->lock);
    while (first != NULL) {
        ChunkRun *chunk_run = first;
        first = chunk_run->next;
        study_wait(run, chunk_run, false);
    }
    pthread_mutex_unlock(&manager->lock);
    return STATUS_OK;
}

static ChunkState threads_poll(StudyRun *run, const Chunk *chunk) {
    ChunkState state = CHUNK_DEAD;
    pthread_mutex_lock(&run->manager->lock);
    for (const ChunkRun *chunk_run = run->first; chunk_run != NULL; chunk_run = chunk_run->next)
        if (chunk_run->chunk.first == chunk->first)
            state = CHUNK_LIVE;
    for (size_t i = 0; i < run->manager->worker_count; i++)
        if (run->manager->workers[i].study == run && run->manager->workers[i].chunk == chunk->first)
            state = CHUNK_LIVE;
    pthread_mutex_unlock(&run->manager->lock);
    return state;
}

static void threads_cancel(StudyRun *run) {
    pthread_mutex_lock(&run->manager->lock);
    drop_waiting(run);
    pthread_mutex_unlock(&run->manager->lock);
}

const Executor executor_threads = {
    .name = "threads",
    .doc = "the daemon's own workers",
    .probe = threads_probe,
    .submit = threads_submit,
    .poll = threads_poll,
    .cancel = threads_cancel,
};
