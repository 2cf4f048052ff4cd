#include "server/jobs/cache.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "server/util/hashmap.h"

// The texts stand behind the struct, in one block.
ResultSummary *result_summary_new(const ResultRow *row) {
    const char *const texts[] = {row->plan, row->summary, row->work, row->notes};
    size_t bytes = sizeof(ResultSummary);
    for (size_t i = 0; i < COUNT(texts); i++)
        bytes += texts[i] != NULL ? strlen(texts[i]) + 1 : 0;
    ResultSummary *summary = malloc(bytes);
    if (summary == NULL)
        return NULL;
    char *at = (char *)(summary + 1);
    const char *copies[COUNT(texts)] = {NULL};
    for (size_t i = 0; i < COUNT(texts); i++) {
        if (texts[i] == NULL)
            continue;
        const size_t size = strlen(texts[i]) + 1;
        copies[i] = memcpy(at, texts[i], size);
        at += size;
    }
    summary->plan = copies[0];
    summary->summary = copies[1];
    summary->work = copies[2];
    summary->notes = copies[3];
    summary->bytes = bytes;
    atomic_init(&summary->refcount, 1);
    return summary;
}

ResultSummary *result_summary_ref(ResultSummary *summary) {
    if (summary != NULL)
        atomic_fetch_add(&summary->refcount, 1);
    return summary;
}

void result_summary_unref(ResultSummary *summary) {
    if (summary != NULL && atomic_fetch_sub(&summary->refcount, 1) == 1)
        free(summary);
}

typedef struct CachedResult {
    LruEntry entry;         // by id
    Outcome *outcome;       // or NULL
    ResultSummary *summary; // or NULL
    size_t series_bytes, summary_bytes;
    char id[72];
} CachedResult;

struct Cache {
    Lru *lru;
    CacheStats series, summaries;
};

static void cache_release(LruEntry *entry, void *owner, bool is_evicted) {
    Cache *cache = owner;
    CachedResult *result = (CachedResult *)(void *)entry;
    cache->series.evictions += is_evicted && result->outcome != NULL;
    cache->summaries.evictions += is_evicted && result->summary != NULL;
    cache->series.count -= result->outcome != NULL;
    cache->summaries.count -= result->summary != NULL;
    cache->series.bytes -= result->series_bytes;
    cache->summaries.bytes -= result->summary_bytes;
    outcome_unref(result->outcome);
    result_summary_unref(result->summary);
    free(result);
}

Cache *cache_new(size_t max_bytes) {
    Cache *cache = calloc(1, sizeof *cache);
    if (cache == NULL)
        return NULL;
    cache->lru = lru_new(max_bytes, cache_release, cache);
    if (cache->lru == NULL) {
        free(cache);
        return NULL;
    }
    return cache;
}

void cache_free(Cache *cache) {
    if (cache == NULL)
        return;
    lru_free(cache->lru);
    free(cache);
}

void cache_put(Cache *cache, const char *id, Outcome *outcome, ResultSummary *summary) {
    const CachedResult *old = lru_peek(cache->lru, id);
    CachedResult *result = calloc(1, sizeof *result);
    if (result == NULL)
        return;
    text_fit(result->id, sizeof result->id, id);
    outcome = outcome != NULL ? outcome : old != NULL ? old->outcome : NULL;
    summary = summary != NULL ? summary : old != NULL ? old->summary : NULL;
    result->outcome = outcome != NULL ? outcome_ref(outcome) : NULL;
    result->summary = result_summary_ref(summary);
    result->series_bytes = outcome != NULL ? outcome_bytes(outcome) : 0;
    result->summary_bytes = sizeof *result + (summary != NULL ? summary->bytes : 0);
    result->entry.indexed.key = result->id;
    result->entry.bytes = result->series_bytes + result->summary_bytes;
    cache->series.bytes += result->series_bytes;
    cache->summaries.bytes += result->summary_bytes;
    cache->series.count += outcome != NULL;
    cache->summaries.count += summary != NULL;
    lru_add(cache->lru, &result->entry);
}

Outcome *cache_find(Cache *cache, const char *id) {
    const CachedResult *entry = lru_find(cache->lru, id);
    const bool is_hit = entry != NULL && entry->outcome != NULL;
    cache->series.hits += is_hit;
    cache->series.misses += !is_hit;
    return is_hit ? outcome_ref(entry->outcome) : NULL;
}

ResultSummary *cache_head(Cache *cache, const char *id) {
    const CachedResult *entry = lru_find(cache->lru, id);
    const bool is_hit = entry != NULL && entry->summary != NULL;
    cache->summaries.hits += is_hit;
    cache->summaries.misses += !is_hit;
    return is_hit ? result_summary_ref(entry->summary) : NULL;
}

bool cache_has(const Cache *cache, const char *id, bool with_series) {
    const CachedResult *entry = lru_peek(cache->lru, id);
    return entry != NULL && (with_series ? entry->outcome != NULL : entry->summary != NULL);
}

void cache_forget(Cache *cache, const char *id) {
    CachedResult *entry = lru_peek(cache->lru, id);
    if (entry != NULL)
        lru_remove(cache->lru, &entry->entry);
}

void cache_tally(const Cache *cache, CacheStats *series, CacheStats *summaries) {
    *series = cache->series;
    *summaries = cache->summaries;
    series->most_bytes = summaries->most_bytes = lru_stats(cache->lru).max_bytes;
}
