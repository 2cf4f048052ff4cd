// What a job tells of its result: plan, summary, work and notes as JSON. Made once, counted, and
// shared by every job of that result. Not the result itself. Used by the jobs room.
#ifndef SERVER_JOBS_RESULT_SUMMARY_H
#define SERVER_JOBS_RESULT_SUMMARY_H

#include <stdatomic.h>
#include <stddef.h>

#include "server/db/db.h"

typedef struct ResultSummary {
    atomic_size_t refcount;
    const char *plan, *summary, *work, *notes; // NULL: unknown
    size_t bytes;
} ResultSummary;

// Copies them out of `row`. One hold; NULL without memory.
ResultSummary *result_summary_new(const ResultRow *row);
ResultSummary *result_summary_ref(ResultSummary *head); // NULL is fine here and below
void result_summary_unref(ResultSummary *head);

#endif
