#include "server/jobs/cache.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"
#include "server/jobs/index.h"

typedef struct Entry {
    IndexEntry indexed; // by id
    struct Entry *newer, *older;
    Outcome *outcome;
    size_t bytes;
    char id[72];
} Entry;

struct Cache {
    Index *index;
    Entry *newest, *oldest;
    size_t most_bytes, bytes, count;
};

Cache *cache_new(size_t most_bytes) {
    Cache *cache = calloc(1, sizeof *cache);
    if (cache == NULL)
        return NULL;
    cache->most_bytes = most_bytes;
    cache->index = index_new();
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
    index_remove(cache->index, &entry->indexed);
    cache->bytes -= entry->bytes;
    cache->count--;
    outcome_drop(entry->outcome);
    free(entry);
}

void cache_free(Cache *cache) {
    if (cache == NULL)
        return;
    while (cache->oldest != NULL)
        evict(cache, cache->oldest);
    index_free(cache->index);
    free(cache);
}

void cache_put(Cache *cache, const char *id, Outcome *outcome) {
    Entry *entry = index_find(cache->index, id);
    if (entry != NULL)
        evict(cache, entry);
    entry = calloc(1, sizeof *entry);
    if (entry == NULL)
        return;
    text_fit(entry->id, sizeof entry->id, id);
    entry->outcome = outcome_hold(outcome);
    entry->bytes = sizeof *entry + outcome_bytes(outcome);
    entry->indexed.key = entry->id;
    index_add(cache->index, &entry->indexed);
    link_newest(cache, entry);
    cache->bytes += entry->bytes;
    cache->count++;
    while (cache->bytes > cache->most_bytes && cache->oldest != entry)
        evict(cache, cache->oldest);
}

Outcome *cache_find(Cache *cache, const char *id) {
    Entry *entry = index_find(cache->index, id);
    if (entry == NULL)
        return NULL;
    unlink_entry(cache, entry);
    link_newest(cache, entry);
    return outcome_hold(entry->outcome);
}

void cache_forget(Cache *cache, const char *id) {
    Entry *entry = index_find(cache->index, id);
    if (entry != NULL)
        evict(cache, entry);
}

size_t cache_count(const Cache *cache) {
    return cache->count;
}

size_t cache_bytes(const Cache *cache) {
    return cache->bytes;
}
