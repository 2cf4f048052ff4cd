// Members folded in memory as they come, in their order. Nothing outlives the daemon: after a
// restart the study begins anew.
#include <stdlib.h>

#include "server/jobs/reorder.h"
#include "server/jobs/study_sink.h"

typedef struct Fold {
    ReorderBuffer order;
    ExecutorLimits limits;
    double seconds; // of CPU a member, as foretold
} Fold;

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static Status fold_open(Worker *worker, StudyRun *run, Problem *problem) {
    const StudyRequest *inquiry = &run->task->inquiry;
    Fold *fold = calloc(1, sizeof *fold);
    Cost cost;
    if (fold == NULL)
        return no_memory(problem);
    run->fold = fold;
    const Status status = run->executor->probe(worker->manager, &fold->limits, problem);
    TRY(reorder_make(run->work, fold->limits.slots, &fold->order, problem));
    TRY(status);
    TRY(study_request_cost(inquiry, &worker->manager->settings.limits, &cost, problem));
    fold->seconds = cost.cpu_seconds / (double)(run->work->members + 1);
    run->bytes = run->work->bytes + fold->order.window * run->work->part_bytes;
    return STATUS_OK;
}

static Status submit_stretch(StudyRun *run, size_t from, size_t to, Problem *problem) {
    const size_t count = executor_chunks(&run->fold->limits, to - from, run->fold->seconds);
    Chunk *chunks = calloc(count, sizeof *chunks);
    if (chunks == NULL)
        return no_memory(problem);
    for (size_t i = 0; i < count; i++)
        chunks[i] = chunk_deal(from, to, count, i);
    const Status status = run->executor->submit(run, chunks, count, problem);
    free(chunks);
    return status;
}

static Status fold_submit(StudyRun *run, Problem *problem) {
    size_t from, to;
    if (!reorder_begin(&run->fold->order, SIZE_MAX, &from, &to))
        atomic_store(&run->is_over, true);
    atomic_store(&run->expected, reorder_expected(&run->fold->order));
    return to > from ? submit_stretch(run, from, to, problem) : STATUS_OK;
}

static Status fold_take(StudyRun *run, ChunkRun *chunk_run, StudyPart *part, Problem *problem) {
    TRY(reorder_put(&run->fold->order,
                    chunk_run->chunk.first + chunk_run->done * chunk_run->chunk.stride, part,
                    problem));
    return fold_submit(run, problem);
}

static Status fold_finish(StudyRun *run, const StudyTools *tools, Problem *problem) {
    return study_end(run->work, tools, problem);
}

static void fold_free(StudyRun *run) {
    if (run->fold == NULL)
        return;
    reorder_clear(&run->fold->order);
    free(run->fold);
}

const StudySink gather_fold = {
    .open = fold_open,
    .submit = fold_submit,
    .take = fold_take,
    .finish = fold_finish,
    .free = fold_free,
};
