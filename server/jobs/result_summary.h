// What a job tells of its result: plan, summary, work and notes as JSON. Made once, counted, and
// shared by every job of that result. Not the result itself. Used by the jobs room.
#ifndef SERVER_JOBS_RESULT_SUMMARY_H
#define SERVER_JOBS_RESULT_SUMMARY_H

#include <stdatomic.h>
#include <stddef.h>

#include "server/db/db.h"

typedef struct Head {
    atomic_size_t holds;
    const char *plan, *summary, *work, *notes; // NULL: unknown
    size_t bytes;
} Head;

// Copies them out of `row`. One hold; NULL without memory.
Head *head_new(const ResultRow *row);
Head *head_hold(Head *head); // NULL is fine here and below
void head_drop(Head *head);

#endif
