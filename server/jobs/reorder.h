// A study's parts, folded in the order of their members whatever order they come in: so the answer
// has the same bytes for any number of threads, and a study that has enough ends at the same
// member. Not the threads and not the members. Used by fold.c and the commands.
#ifndef SERVER_JOBS_REORDER_H
#define SERVER_JOBS_REORDER_H

#include <pthread.h>

#include "core/study/study.h"

//     folded | window: wait for those before them, under way, or not begun | nobody may begin
//
// The window bounds what waits.
typedef struct ReorderBuffer {
    pthread_mutex_t lock;
    StudyWork *work;
    StudyPart **parts; // member i's at i % window
    size_t window;     // members
    size_t next;       // to be folded
    size_t begun;      // members that somebody was asked for
    size_t expected;   // as the work tells it
    bool is_folding;
} ReorderBuffer;

// `slots` make members side by side. `order` is cleared by reorder_clear, also after a failure.
Status reorder_make(StudyWork *work, size_t slots, ReorderBuffer *order, Problem *problem);
void reorder_clear(ReorderBuffer *order);

// Takes what a member came to. Whoever brings the next one folds it and all that follow; the others
// leave theirs and go on.
Status reorder_put(ReorderBuffer *order, size_t member, StudyPart *part, Problem *problem);

// Members that are wanted and that there is room for, begun herewith: *from ... *to - 1, at most so
// many. None while half the window is on its way, or while others fold: those are to ask after
// that. False: all that is wanted is folded.
bool reorder_begin(ReorderBuffer *order, size_t most, size_t *from, size_t *to);

size_t reorder_expected(ReorderBuffer *order); // members, in all

#endif
