// A cache of immutable objects that were read from the database: the last used ones up to
// `max_bytes`, and those that others refer to, which take no more memory for being here. (Not
// util/hashmap: an evicted record that jobs still have would be read, and kept, once more by the
// next job that names it.)
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "server/db/db_private.h"

typedef struct Entry {
    struct Entry *next;
    Refcount *object;
    size_t bytes;
    char key[SHARED_KEY_SIZE];
} Entry;

struct SharedCache {
    pthread_mutex_t lock;
    size_t max_bytes;
    uint64_t generation; // how often it was emptied
    Entry *first;        // the last used
};

SharedCache *shared_cache_new(size_t max_bytes) {
    SharedCache *cache = calloc(1, sizeof *cache);
    if (cache == NULL)
        return NULL;
    cache->max_bytes = max_bytes;
    pthread_mutex_init(&cache->lock, NULL);
    return cache;
}

static void entry_remove(Entry **at) {
    Entry *entry = *at;
    *at = entry->next;
    refcount_unref(entry->object);
    free(entry);
}

void shared_cache_clear(SharedCache *cache) {
    pthread_mutex_lock(&cache->lock);
    cache->generation++;
    while (cache->first != NULL)
        entry_remove(&cache->first);
    pthread_mutex_unlock(&cache->lock);
}

void shared_cache_free(SharedCache *cache) {
    if (cache == NULL)
        return;
    shared_cache_clear(cache);
    pthread_mutex_destroy(&cache->lock);
    free(cache);
}

// A reference to the object, which is then the last used, or NULL. With the lock held.
static Refcount *cache_find(SharedCache *cache, const char *key) {
    for (Entry **at = &cache->first; *at != NULL; at = &(*at)->next) {
        Entry *entry = *at;
        if (strcmp(entry->key, key) != 0)
            continue;
        *at = entry->next;
        entry->next = cache->first;
        cache->first = entry;
        return refcount_ref(entry->object);
    }
    return NULL;
}

// With the lock held, without which no other thread gets a reference.
static void cache_evict(SharedCache *cache) {
    size_t bytes = 0;
    for (Entry **at = &cache->first; *at != NULL;) {
        bytes += (*at)->bytes;
        if (atomic_load(&(*at)->object->count) > 1 || bytes <= cache->max_bytes)
            at = &(*at)->next;
        else
            entry_remove(at);
    }
}

Refcount *shared_cache_find(SharedCache *cache, const char *key, uint64_t *generation) {
    pthread_mutex_lock(&cache->lock);
    Refcount *object = cache_find(cache, key);
    *generation = cache->generation;
    pthread_mutex_unlock(&cache->lock);
    return object;
}

Refcount *shared_cache_add(SharedCache *cache, const char *key, uint64_t generation,
                           Refcount *object, size_t bytes) {
    Entry *entry = calloc(1, sizeof *entry);
    pthread_mutex_lock(&cache->lock);
    Refcount *there = generation == cache->generation ? cache_find(cache, key) : NULL;
    if (there == NULL && entry != NULL && generation == cache->generation) {
        *entry = (Entry){.next = cache->first, .object = refcount_ref(object), .bytes = bytes};
        text_fit(entry->key, sizeof entry->key, key);
        cache->first = entry;
        entry = NULL;
        cache_evict(cache);
    }
    pthread_mutex_unlock(&cache->lock);
    free(entry);
    if (there == NULL)
        return object;
    refcount_unref(object);
    return there;
}
