// The members of one chunk: made one after the other, with a look now and then whether others wait.
// What was made stays gathered when the chunk is put back.
#include "server/jobs/study_sink.h"
#include "server/util/clock.h"

static const double before = STUDY_OWN + (1 - STUDY_OWN) * STUDY_BEGUN; // of the whole progress
static const int64_t look_ns = 1000000; // how often a chunk looks whether others wait

enum { MILLION = 1000000 };

// A member that is being made.
typedef struct Making {
    StudyRun *run;
    uint_fast64_t told; // millionths of it
} Making;

bool study_continues(void *context, double fraction) {
    (void)fraction;
    StudyRun *run = context;
    return !atomic_load(&run->is_over) && !atomic_load(&run->task->is_stopped);
}

void study_count(StudyRun *run, size_t members) {
    atomic_fetch_add(&run->millionths, (uint_fast64_t)members * MILLION);
}

// Others tell it too: it never goes back.
static void tell_progress(StudyRun *run) {
    const double expected = MILLION * (double)atomic_load(&run->expected);
    const double share = fmin((double)atomic_load(&run->millionths) / fmax(expected, 1), 1);
    const unsigned told = (unsigned)(1e4 * (before + (1 - before) * share));
    atomic_uint *progress = &run->task->progress;
    unsigned last = atomic_load(progress);
    while (last < told && !atomic_compare_exchange_weak(progress, &last, told))
        ;
}

static bool advance(void *context, double fraction) {
    Making *making = context;
    const double share = fmax(0, fmin(fraction, 1));
    const uint_fast64_t done = (uint_fast64_t)(MILLION * share);
    if (done > making->told) {
        atomic_fetch_add(&making->run->millionths, done - making->told);
        making->told = done;
    }
    return study_continues(making->run, fraction);
}

static Status make_member(Worker *worker, StudyRun *run, ChunkRun *chunk_run, Problem *problem) {
    const Chunk *chunk = &chunk_run->chunk;
    Making making = {run, 0};
    const Progress watch = {&making, advance};
    const StudyTools tools = {.limits = &worker->manager->settings.limits,
                              .progress = &watch,
                              .workspace = &worker->workspace};
    StudyPart *part = NULL;
    if (run->gather->has != NULL && run->gather->has(run, chunk_run))
        return STATUS_OK;
    const Status status = study_part_make(run->work, chunk->first + chunk_run->done * chunk->stride,
                                          &tools, &part, problem);
    if (status != STATUS_OK) {
        study_part_free(run->work, part);
        return status;
    }
    (void)advance(&making, 1);
    return run->gather->take(run, chunk_run, part, problem);
}

static bool others_wait(JobManager *manager, const StudyRun *run) {
    pthread_mutex_lock(&manager->lock);
    const size_t own = run->task->queued.number != 0;
    const bool is_wanted = queue_count(manager->queue) > own || manager->is_closing;
    pthread_mutex_unlock(&manager->lock);
    return is_wanted;
}

Status study_chunk_make(Worker *worker, StudyRun *run, ChunkRun *chunk_run, Problem *problem) {
    const int64_t turn_ns = (int64_t)STUDY_TURN_MS * 1000000;
    const int64_t began_ns = clock_monotonic_ns();
    int64_t looked_ns = began_ns;
    if (!chunk_run->is_begun && run->gather->begin != NULL)
        TRY(run->gather->begin(run, chunk_run, problem));
    chunk_run->is_begun = true;
    Status status = STATUS_OK;
    for (; status == STATUS_OK && chunk_run->done < chunk_run->chunk.count; chunk_run->done++) {
        const int64_t now_ns = clock_monotonic_ns();
        if (now_ns - looked_ns >= look_ns) {
            looked_ns = now_ns;
            tell_progress(run);
            if (now_ns - began_ns >= turn_ns && others_wait(worker->manager, run)) {
                status = STATUS_BUSY;
                break;
            }
        }
        if (!study_continues(run, 0))
            status = STATUS_CANCELLED;
        else
            status = make_member(worker, run, chunk_run, problem);
        if (status != STATUS_OK)
            break;
    }
    chunk_run->is_made = status == STATUS_OK;
    tell_progress(run);
    return status;
}
