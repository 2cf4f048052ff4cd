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

typedef struct Entry {
    HashMapEntry indexed; // by id
    struct Entry *newer, *older;
    Outcome *outcome;    // or NULL
    ResultSummary *head; // or NULL
    size_t series_bytes, head_bytes;
    char id[72];
} Entry;

struct Cache {
    HashMap *index;
    Entry *newest, *oldest;
    size_t most_bytes;
    CacheStats series, heads;
};

Cache *cache_new(size_t most_bytes) {
    Cache *cache = calloc(1, sizeof *cache);
    if (cache == NULL)
        return NULL;
    cache->most_bytes = most_bytes;
    cache->index = hashmap_new();
    if (cache->index == NULL) {
        free(cache);
        return NULL;
    }
    return cache;
}

static void unlink_entry(Cache *cache, Entry *entry) {
    *(entry->newer != NULL ? &entry->newer->older : &cache->newest) = entry->older;
    *(entry->older != NULL ? &entry->older->newer : &cache->oldest) = entry->newer;
}

static void link_newest(Cache *cache, Entry *entry) {
    entry->newer = NULL;
    entry->older = cache->newest;
    *(cache->newest != NULL ? &cache->newest->newer : &cache->oldest) = entry;
    cache->newest = entry;
}

static void evict(Cache *cache, Entry *entry) {
    unlink_entry(cache, entry);
    hashmap_remove(cache->index, &entry->indexed);
    cache->series.bytes -= entry->series_bytes;
    cache->heads.bytes -= entry->head_bytes;
    cache->series.count -= entry->outcome != NULL;
    cache->heads.count -= entry->head != NULL;
    outcome_unref(entry->outcome);
    result_summary_unref(entry->head);
    free(entry);
}

void cache_free(Cache *cache) {
    if (cache == NULL)
        return;
    while (cache->oldest != NULL)
        evict(cache, cache->oldest);
    hashmap_free(cache->index);
    free(cache);
}

void cache_put(Cache *cache, const char *id, Outcome *outcome, ResultSummary *head) {
    Entry *old = hashmap_find(cache->index, id), *entry = calloc(1, sizeof *entry);
    if (entry == NULL)
        return;
    text_fit(entry->id, sizeof entry->id, id);
    Outcome *kept = outcome != NULL ? outcome : old != NULL ? old->outcome : NULL;
    if (kept != NULL)
        entry->outcome = outcome_ref(kept);
    entry->head = result_summary_ref(head != NULL ? head : old != NULL ? old->head : NULL);
    if (old != NULL)
        evict(cache, old);
    entry->series_bytes = kept != NULL ? outcome_bytes(kept) : 0;
    entry->head_bytes = sizeof *entry + (entry->head != NULL ? entry->head->bytes : 0);
    entry->indexed.key = entry->id;
    hashmap_add(cache->index, &entry->indexed);
    link_newest(cache, entry);
    cache->series.bytes += entry->series_bytes;
    cache->heads.bytes += entry->head_bytes;
    cache->series.count += entry->outcome != NULL;
    cache->heads.count += entry->head != NULL;
    while (cache->series.bytes + cache->heads.bytes > cache->most_bytes && cache->oldest != entry) {
        cache->series.evictions += cache->oldest->outcome != NULL;
        cache->heads.evictions += cache->oldest->head != NULL;
        evict(cache, cache->oldest);
    }
}

static Entry *use(Cache *cache, const char *id) {
    Entry *entry = hashmap_find(cache->index, id);
    if (entry != NULL) {
        unlink_entry(cache, entry);
        link_newest(cache, entry);
    }
    return entry;
}

Outcome *cache_find(Cache *cache, const char *id) {
    Entry *entry = use(cache, id);
    const bool is_hit = entry != NULL && entry->outcome != NULL;
    cache->series.hits += is_hit;
    cache->series.misses += !is_hit;
    return is_hit ? outcome_ref(entry->outcome) : NULL;
}

ResultSummary *cache_head(Cache *cache, const char *id) {
    Entry *entry = use(cache, id);
    const bool is_hit = entry != NULL && entry->head != NULL;
    cache->heads.hits += is_hit;
    cache->heads.misses += !is_hit;
    return is_hit ? result_summary_ref(entry->head) : NULL;
}

bool cache_has(const Cache *cache, const char *id, bool with_series) {
    const Entry *entry = hashmap_find(cache->index, id);
    return entry != NULL && (with_series ? entry->outcome != NULL : entry->head != NULL);
}

void cache_forget(Cache *cache, const char *id) {
    Entry *entry = hashmap_find(cache->index, id);
    if (entry != NULL)
        evict(cache, entry);
}

void cache_tally(const Cache *cache, CacheStats *series, CacheStats *heads) {
    *series = cache->series;
    *heads = cache->heads;
    series->most_bytes = heads->most_bytes = cache->most_bytes;
}
