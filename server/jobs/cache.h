// What is known of results in memory, by their id, up to a budget of bytes: the documents that a
// job tells of them and, where they are kept, the series; the longest unused one goes first. Not
// locked: the intake's lock guards it. Used by the jobs room.
#ifndef SERVER_JOBS_CACHE_H
#define SERVER_JOBS_CACHE_H

#include <stdatomic.h>

#include "server/jobs/jobs.h"

// Plan, summary, work and notes of a result as JSON, shared by all of its jobs.
typedef struct ResultSummary {
    atomic_size_t refcount;
    const char *plan, *summary, *work, *notes; // NULL: unknown
    size_t bytes;
} ResultSummary;
// Copies them out of `row`. One reference; NULL without memory.
ResultSummary *result_summary_new(const ResultRow *row);
ResultSummary *result_summary_ref(ResultSummary *summary); // NULL is accepted here and below
void result_summary_unref(ResultSummary *summary);

typedef struct Cache Cache;

Cache *cache_new(size_t most_bytes); // NULL without memory
void cache_free(Cache *cache);

// Keeps holds of its own; of `outcome` and `head` what is not NULL takes the place of what was
// there. The newest one is kept even if it is larger than the budget, so that whoever asked for it
// finds it. Without memory nothing is kept.
void cache_put(Cache *cache, const char *id, Outcome *outcome, ResultSummary *head);
Outcome *cache_find(Cache *cache, const char *id);       // a hold for the caller, or NULL
ResultSummary *cache_head(Cache *cache, const char *id); // a hold for the caller, or NULL
bool cache_has(const Cache *cache, const char *id, bool with_series); // is not a use of it
void cache_forget(Cache *cache, const char *id);
// Of the series, and of the documents: how often asked for, and kept. Both share the budget.
void cache_tally(const Cache *cache, CacheStats *series, CacheStats *heads);

#endif
