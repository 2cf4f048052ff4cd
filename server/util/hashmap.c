// Chains in an array that doubles when there are more entries than chains.
#include "server/util/hashmap.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_CHAINS = 64 };

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
