#include "server/jobs/reorder.h"

#include <stdlib.h>

enum { WINDOW_BYTES = 32 << 20, WINDOW_PER_SLOT = 8 };

Status reorder_make(StudyWork *work, size_t slots, ReorderBuffer *order, Problem *problem) {
    const size_t by_bytes = WINDOW_BYTES / (work->part_bytes + 1);
    const size_t by_slots = WINDOW_PER_SLOT * slots;
    const size_t window = by_bytes > by_slots ? by_bytes : by_slots;
    *order = (ReorderBuffer){.work = work,
                             .window = window < work->members ? window : work->members + 1,
                             .expected = work->expected};
    pthread_mutex_init(&order->lock, NULL);
    order->parts = calloc(order->window, sizeof *order->parts);
    return order->parts != NULL ? STATUS_OK
                                : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

void reorder_clear(ReorderBuffer *order) {
    for (size_t i = 0; order->parts != NULL && i < order->window; i++)
        study_part_free(order->work, order->parts[i]);
    free(order->parts);
    pthread_mutex_destroy(&order->lock);
}

// With the lock held, which is given up for each member: nobody else folds meanwhile.
static Status fold(ReorderBuffer *order, Problem *problem) {
    Status status = STATUS_OK;
    while (status == STATUS_OK && order->next < order->work->wanted) {
        StudyPart **place = &order->parts[order->next % order->window], *part = *place;
        if (part == NULL)
            break;
        *place = NULL;
        pthread_mutex_unlock(&order->lock);
        status = study_part_fold(order->work, order->next, part, problem);
        study_part_free(order->work, part);
        pthread_mutex_lock(&order->lock);
        order->next++;
        order->expected = order->work->expected;
    }
    return status;
}

Status reorder_put(ReorderBuffer *order, size_t member, StudyPart *part, Problem *problem) {
    Status status = STATUS_OK;
    pthread_mutex_lock(&order->lock);
    order->parts[member % order->window] = part;
    if (!order->is_folding && member == order->next) {
        order->is_folding = true;
        status = fold(order, problem);
        order->is_folding = false;
    }
    pthread_mutex_unlock(&order->lock);
    return status;
}

bool reorder_begin(ReorderBuffer *order, size_t most, size_t *from, size_t *to) {
    bool is_open = true;
    pthread_mutex_lock(&order->lock);
    *from = *to = order->begun;
    // The work changes while it is folded.
    if (!order->is_folding) {
        const size_t wanted = order->work->wanted, room = order->next + order->window;
        const size_t end = wanted < room ? wanted : room;
        const bool is_early = order->begun > order->next + order->window / 2;
        is_open = order->next < wanted;
        if (is_open && !is_early && end > *from)
            *to = end - *from < most ? end : *from + most;
        order->begun = *to;
    }
    pthread_mutex_unlock(&order->lock);
    return is_open;
}

size_t reorder_expected(ReorderBuffer *order) {
    pthread_mutex_lock(&order->lock);
    const size_t expected = order->expected;
    pthread_mutex_unlock(&order->lock);
    return expected;
}
