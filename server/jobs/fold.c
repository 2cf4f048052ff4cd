// Members folded in memory, in their order whatever order they come in: so the answer has the same
// bytes for any number of threads, and a study that has enough ends at the same member.
//
//     folded | window: made ahead, waiting for those before them, or under way | not begun
//
// The window bounds what waits. Whoever brings the member that is next folds, and all that follow
// it; others leave theirs and go on.
#include <stdlib.h>

#include "server/jobs/gather.h"

enum { WINDOW_BYTES = 32 << 20, WINDOW_PER_SLOT = 8 };

typedef struct FoldOrder {
    pthread_mutex_t lock;
    void **parts;  // member i at i % window
    size_t window; // members
    size_t next;   // to be folded
    size_t submitted;
    bool is_folding;
    ExecutorLimits limits;
    double seconds; // of CPU a member, as foretold
} FoldOrder;

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static size_t window_of(const StudyWork *work, const ExecutorLimits *limits) {
    const size_t by_bytes = WINDOW_BYTES / (work->part_bytes + 1);
    const size_t by_slots = WINDOW_PER_SLOT * limits->slots;
    const size_t window = by_bytes > by_slots ? by_bytes : by_slots;
    return window < work->members ? window : work->members + 1;
}

static Status fold_open(Worker *worker, StudyRun *run, Problem *problem) {
    const Inquiry *inquiry = &run->computation->inquiry;
    FoldOrder *order = calloc(1, sizeof *order);
    Cost cost;
    if (order == NULL)
        return no_memory(problem);
    pthread_mutex_init(&order->lock, NULL);
    run->order = order;
    TRY(run->executor->probe(worker->intake, &order->limits, problem));
    TRY(inquiry_cost(inquiry, &worker->intake->settings.limits, &cost, problem));
    order->seconds = cost.cpu_seconds / (double)(run->work->members + 1);
    order->window = window_of(run->work, &order->limits);
    order->parts = calloc(order->window, sizeof *order->parts);
    return order->parts != NULL ? STATUS_OK : no_memory(problem);
}

// With the order's lock held: members that are wanted, that there is room for, and that nobody was
// asked for: from ... to - 1. Not a few at a time.
static void next_stretch(const StudyRun *run, size_t *from, size_t *to) {
    const FoldOrder *order = run->order;
    const size_t most = order->next + order->window, wanted = run->work->wanted;
    const bool is_early = order->submitted > order->next + order->window / 2;
    *from = order->submitted;
    *to = is_early ? *from : wanted < most ? wanted : most;
}

static Status submit_stretch(StudyRun *run, size_t from, size_t to, Problem *problem) {
    const size_t count = executor_chunks(&run->order->limits, to - from, run->order->seconds);
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
    FoldOrder *order = run->order;
    size_t from, to;
    pthread_mutex_lock(&order->lock);
    // The work changes while it is folded alone.
    if (order->is_folding) {
        pthread_mutex_unlock(&order->lock);
        return STATUS_OK;
    }
    const bool is_whole = order->next >= run->work->wanted;
    next_stretch(run, &from, &to);
    if (!is_whole && to > from)
        order->submitted = to;
    pthread_mutex_unlock(&order->lock);
    if (is_whole)
        atomic_store(&run->is_over, true);
    return !is_whole && to > from ? submit_stretch(run, from, to, problem) : STATUS_OK;
}

static Status fold_begin(StudyRun *run, Shift *shift, Problem *problem) {
    (void)run;
    (void)shift;
    (void)problem;
    return STATUS_OK;
}

static bool fold_has(const StudyRun *run, const Shift *shift) {
    (void)run;
    (void)shift;
    return false;
}

// With the order's lock held, which is given up for each member: nobody else folds meanwhile.
static Status fold_all(StudyRun *run, Problem *problem) {
    FoldOrder *order = run->order;
    const StudyMembers *members = run->work->kind->members;
    Status status = STATUS_OK;
    while (status == STATUS_OK && order->next < run->work->wanted) {
        void **place = &order->parts[order->next % order->window], *part = *place;
        if (part == NULL)
            break;
        *place = NULL;
        pthread_mutex_unlock(&order->lock);
        status = members->fold(run->work, order->next, part, problem);
        members->drop(part);
        atomic_store(&run->expected, run->work->expected);
        pthread_mutex_lock(&order->lock);
        order->next++;
    }
    return status;
}

static Status fold_take(StudyRun *run, Shift *shift, void *part, Problem *problem) {
    FoldOrder *order = run->order;
    const size_t member = shift->chunk.first + shift->done * shift->chunk.stride;
    pthread_mutex_lock(&order->lock);
    order->parts[member % order->window] = part;
    if (order->is_folding || member != order->next) {
        pthread_mutex_unlock(&order->lock);
        return STATUS_OK;
    }
    order->is_folding = true;
    const Status status = fold_all(run, problem);
    order->is_folding = false;
    pthread_mutex_unlock(&order->lock);
    return status == STATUS_OK ? fold_submit(run, problem) : status;
}

static Status fold_end(StudyRun *run, Shift *shift, Problem *problem) {
    (void)run;
    (void)shift;
    (void)problem;
    return STATUS_OK;
}

static Status fold_finish(StudyRun *run, const StudyTools *tools, Problem *problem) {
    return run->work->kind->members->end(run->work, tools, problem);
}

static void fold_drop(Shift *shift) {
    (void)shift;
}

static void fold_free(StudyRun *run) {
    FoldOrder *order = run->order;
    if (order == NULL)
        return;
    for (size_t i = 0; order->parts != NULL && i < order->window; i++)
        run->work->kind->members->drop(order->parts[i]);
    pthread_mutex_destroy(&order->lock);
    free(order->parts);
    free(order);
}

const Gather gather_fold = {
    .open = fold_open,
    .submit = fold_submit,
    .begin = fold_begin,
    .has = fold_has,
    .take = fold_take,
    .end = fold_end,
    .finish = fold_finish,
    .drop = fold_drop,
    .free = fold_free,
};
