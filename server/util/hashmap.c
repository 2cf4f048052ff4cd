#include "server/util/hashmap.h"

#include <stdlib.h>
#include <string.h>

enum { FIRST_CHAINS = 64 };

// Chains in an array that doubles when there are more entries than chains.
struct HashMap {
    HashMapEntry **chains;
    size_t chain_count; // a power of two
    size_t count;
};

HashMap *hashmap_new(void) {
    HashMap *map = calloc(1, sizeof *map);
    if (map == NULL)
        return NULL;
    map->chain_count = FIRST_CHAINS;
    map->chains = calloc(map->chain_count, sizeof(HashMapEntry *));
    if (map->chains == NULL) {
        free(map);
        return NULL;
    }
    return map;
}

void hashmap_free(HashMap *map) {
    if (map == NULL)
        return;
    free(map->chains);
    free(map);
}

static HashMapEntry **hashmap_chain(const HashMap *map, const char *key) {
    uint64_t hash = 14695981039346656037u; // FNV-1a
    for (const char *c = key; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    return &map->chains[(hash ^ hash >> 32) & (map->chain_count - 1)];
}

static void hashmap_grow(HashMap *map) {
    HashMap grown = {.chain_count = 2 * map->chain_count};
    grown.chains = calloc(grown.chain_count, sizeof(HashMapEntry *));
    if (grown.chains == NULL)
        return;
    for (size_t i = 0; i < map->chain_count; i++)
        while (map->chains[i] != NULL) {
            HashMapEntry *entry = map->chains[i];
            map->chains[i] = entry->next;
            hashmap_add(&grown, entry);
        }
    free(map->chains);
    *map = grown;
}

void hashmap_add(HashMap *map, HashMapEntry *entry) {
    if (map->count >= map->chain_count)
        hashmap_grow(map);
    HashMapEntry **chain = hashmap_chain(map, entry->key);
    entry->next = *chain;
    *chain = entry;
    map->count++;
}

void hashmap_remove(HashMap *map, HashMapEntry *entry) {
    if (entry->key == NULL)
        return;
    for (HashMapEntry **at = hashmap_chain(map, entry->key); *at != NULL; at = &(*at)->next)
        if (*at == entry) {
            *at = entry->next;
            map->count--;
            return;
        }
}

void *hashmap_any(const HashMap *map) {
    for (size_t i = 0; i < map->chain_count && map->count > 0; i++)
        if (map->chains[i] != NULL)
            return map->chains[i];
    return NULL;
}

void *hashmap_find(const HashMap *map, const char *key) {
    for (HashMapEntry *entry = *hashmap_chain(map, key); entry != NULL; entry = entry->next)
        if (strcmp(entry->key, key) == 0)
            return entry;
    return NULL;
}

// --- LRU cache ---

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
