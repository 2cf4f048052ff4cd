#include "server/util/lru.h"

#include <stdlib.h>

struct Lru {
    HashMap *map;
    LruEntry *newest, *oldest;
    void (*release)(LruEntry *entry, void *owner, bool is_evicted);
    void *owner;
    LruStats stats;
};

Lru *lru_new(size_t max_bytes, void (*release)(LruEntry *entry, void *owner, bool is_evicted),
             void *owner) {
    Lru *lru = calloc(1, sizeof *lru);
    if (lru == NULL)
        return NULL;
    lru->map = hashmap_new();
    if (lru->map == NULL) {
        free(lru);
        return NULL;
    }
    lru->release = release;
    lru->owner = owner;
    lru->stats.max_bytes = max_bytes;
    return lru;
}

static void lru_unlink(Lru *lru, LruEntry *entry) {
    *(entry->newer != NULL ? &entry->newer->older : &lru->newest) = entry->older;
    *(entry->older != NULL ? &entry->older->newer : &lru->oldest) = entry->newer;
}

static void lru_link_newest(Lru *lru, LruEntry *entry) {
    entry->newer = NULL;
    entry->older = lru->newest;
    *(lru->newest != NULL ? &lru->newest->newer : &lru->oldest) = entry;
    lru->newest = entry;
}

static void lru_take_out(Lru *lru, LruEntry *entry, bool is_evicted) {
    lru_unlink(lru, entry);
    hashmap_remove(lru->map, &entry->indexed);
    lru->stats.bytes -= entry->bytes;
    lru->stats.count--;
    lru->stats.evictions += is_evicted;
    lru->release(entry, lru->owner, is_evicted);
}

void lru_remove(Lru *lru, LruEntry *entry) {
    lru_take_out(lru, entry, false);
}

void lru_clear(Lru *lru) {
    while (lru->oldest != NULL)
        lru_take_out(lru, lru->oldest, false);
}

void lru_free(Lru *lru) {
    if (lru == NULL)
        return;
    lru_clear(lru);
    hashmap_free(lru->map);
    free(lru);
}

void lru_add(Lru *lru, LruEntry *entry) {
    LruEntry *before = hashmap_find(lru->map, entry->indexed.key);
    if (before != NULL)
        lru_take_out(lru, before, false);
    hashmap_add(lru->map, &entry->indexed);
    lru_link_newest(lru, entry);
    lru->stats.bytes += entry->bytes;
    lru->stats.count++;
    while (lru->stats.bytes > lru->stats.max_bytes && lru->oldest != entry)
        lru_take_out(lru, lru->oldest, true);
}

void *lru_peek(const Lru *lru, const char *key) {
    return hashmap_find(lru->map, key);
}

void *lru_find(Lru *lru, const char *key) {
    LruEntry *entry = hashmap_find(lru->map, key);
    if (entry == NULL) {
        lru->stats.misses++;
        return NULL;
    }
    lru->stats.hits++;
    if (entry != lru->newest) {
        lru_unlink(lru, entry);
        lru_link_newest(lru, entry);
    }
    return entry;
}

LruStats lru_stats(const Lru *lru) {
    return lru->stats;
}
