// A cache of entries found by a text, up to a budget of bytes: the least recently used entry is
// evicted first. Entries live inside the owner's structs. The owner locks it, because it has state
// of its own (a generation, a version) that must change with the cache.
#ifndef SERVER_UTIL_LRU_H
#define SERVER_UTIL_LRU_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/util/hashmap.h"

typedef struct Lru Lru;

// The first member of a cached struct. `indexed.key` and `bytes` are set by the owner before
// lru_add and do not change while the entry is cached.
typedef struct LruEntry {
    HashMapEntry indexed;
    struct LruEntry *newer, *older;
    size_t bytes;
} LruEntry;

typedef struct LruStats {
    uint64_t hits, misses, evictions;
    size_t count, bytes, max_bytes;
} LruStats;

// `release` frees an entry that has left the cache; `is_evicted`: to make room for others. It must
// not call the cache. NULL without memory.
Lru *lru_new(size_t max_bytes, void (*release)(LruEntry *entry, void *owner, bool is_evicted),
             void *owner);
void lru_free(Lru *lru); // with all entries; NULL is accepted

// Takes ownership. An entry of the same key is replaced; others are evicted down to the budget, but
// never `entry` itself.
void lru_add(Lru *lru, LruEntry *entry);
void *lru_find(Lru *lru, const char *key);       // counts a hit or a miss and is a use; or NULL
void *lru_peek(const Lru *lru, const char *key); // neither; or NULL
void lru_remove(Lru *lru, LruEntry *entry);
void lru_clear(Lru *lru);
LruStats lru_stats(const Lru *lru);

#endif
