// Results in memory by their id, up to a budget of bytes: their summaries and, where kept, their
// series. The lock of the job manager guards it.
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

Cache *cache_new(size_t max_bytes); // NULL without memory
void cache_free(Cache *cache);

// Takes references of its own; NULL for `outcome` or `summary` keeps what is cached of it. The
// newest result is kept even if it is larger than the budget. Without memory nothing is cached.
void cache_put(Cache *cache, const char *id, Outcome *outcome, ResultSummary *summary);
Outcome *cache_find(Cache *cache, const char *id);                    // a reference, or NULL
ResultSummary *cache_head(Cache *cache, const char *id);              // a reference, or NULL
bool cache_has(const Cache *cache, const char *id, bool with_series); // not a use
void cache_forget(Cache *cache, const char *id);
// Of the series and of the summaries, which share the budget.
void cache_tally(const Cache *cache, CacheStats *series, CacheStats *summaries);

#endif
