#include "server/util/hashmap.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

// Keys are random ids and digests, at most some hundred thousand of them: no growing is needed, and
// buckets that are not used take no memory.
enum { BUCKETS = 65536 };

struct Index {
    IndexEntry *buckets[BUCKETS];
};

Index *index_new(void) {
    return calloc(1, sizeof(Index));
}

void index_free(Index *index) {
    free(index);
}

// FNV-1a.
static size_t bucket(const char *key) {
    uint64_t hash = 14695981039346656037u;
    for (const char *c = key; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    return (size_t)(hash % BUCKETS);
}

void index_add(Index *index, IndexEntry *entry) {
    IndexEntry **head = &index->buckets[bucket(entry->key)];
    entry->next = *head;
    *head = entry;
}

void index_remove(Index *index, IndexEntry *entry) {
    if (entry->key == NULL)
        return;
    for (IndexEntry **at = &index->buckets[bucket(entry->key)]; *at != NULL; at = &(*at)->next)
        if (*at == entry) {
            *at = entry->next;
            return;
        }
}

void *index_any(const Index *index) {
    for (size_t i = 0; i < BUCKETS; i++)
        if (index->buckets[i] != NULL)
            return index->buckets[i];
    return NULL;
}

void *index_find(const Index *index, const char *key) {
    for (IndexEntry *at = index->buckets[bucket(key)]; at != NULL; at = at->next)
        if (strcmp(at->key, key) == 0)
            return at;
    return NULL;
}
