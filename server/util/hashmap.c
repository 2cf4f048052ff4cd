#include "server/util/hashmap.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Keys are random ids and digests, at most some hundred thousand of them: no growing is needed, and
// buckets that are not used take no memory.
enum { BUCKETS = 65536 };

struct HashMap {
    HashMapEntry *buckets[BUCKETS];
};

HashMap *hashmap_new(void) {
    return calloc(1, sizeof(HashMap));
}

void hashmap_free(HashMap *index) {
    free(index);
}

// FNV-1a.
static size_t bucket(const char *key) {
    uint64_t hash = 14695981039346656037u;
    for (const char *c = key; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    return (size_t)(hash % BUCKETS);
}

void hashmap_add(HashMap *index, HashMapEntry *entry) {
    HashMapEntry **head = &index->buckets[bucket(entry->key)];
    entry->next = *head;
    *head = entry;
}

void hashmap_remove(HashMap *index, HashMapEntry *entry) {
    if (entry->key == NULL)
        return;
    for (HashMapEntry **at = &index->buckets[bucket(entry->key)]; *at != NULL; at = &(*at)->next)
        if (*at == entry) {
            *at = entry->next;
            return;
        }
}

void *hashmap_any(const HashMap *index) {
    for (size_t i = 0; i < BUCKETS; i++)
        if (index->buckets[i] != NULL)
            return index->buckets[i];
    return NULL;
}

void *hashmap_find(const HashMap *index, const char *key) {
    for (HashMapEntry *at = index->buckets[bucket(key)]; at != NULL; at = at->next)
        if (strcmp(at->key, key) == 0)
            return at;
    return NULL;
}
