// A hash table of entries that live inside the caller's structs, found by a text. It is not locked
// and owns no entry.
#ifndef SERVER_UTIL_HASHMAP_H
#define SERVER_UTIL_HASHMAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct HashMap HashMap;

// The first member of an indexed struct.
typedef struct HashMapEntry {
    struct HashMapEntry *next;
    const char *key; // lives as long as the entry is in the map
} HashMapEntry;

HashMap *hashmap_new(void); // NULL without memory
void hashmap_free(HashMap *map);
// Never fails: without memory to grow, look-ups become slower.
void hashmap_add(HashMap *map, HashMapEntry *entry);
void hashmap_remove(HashMap *map, HashMapEntry *entry);  // an entry that is absent is no error
void *hashmap_any(const HashMap *map);                   // any entry; NULL if the map is empty
void *hashmap_find(const HashMap *map, const char *key); // NULL if absent

// A cache of entries found by a text, up to a budget of bytes: the least recently used entry is
// evicted first. The owner locks it, because it has state of its own (a generation, a version) that
// must change with the cache.
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
