// Entries are counted: one reference is the cache's, one that of each reply being sent. The key is
// the target behind one byte that says whether the body is gzip.
#include "server/http/response_cache.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/reply.h"

enum { SHARE = 4 }; // no entry takes more than a SHAREth of the budget

typedef struct CachedResponse {
    LruEntry cached;
    atomic_size_t refcount;
    const Route *route; // lives as long as the program
    Reply reply;        // owns the body
    char key[];
} CachedResponse;

struct ResponseCache {
    pthread_mutex_t lock;
    Lru *lru;
    size_t max_bytes;
    uint64_t age;
};

static void cached_response_unref(void *context) {
    CachedResponse *entry = context;
    if (atomic_fetch_sub(&entry->refcount, 1) != 1)
        return;
    reply_clear(&entry->reply);
    free(entry);
}

static void cached_response_release(LruEntry *entry, void *cache, bool is_evicted) {
    (void)cache, (void)is_evicted;
    cached_response_unref(entry);
}

static void cached_response_lend(CachedResponse *entry, Reply *reply) {
    atomic_fetch_add(&entry->refcount, 1);
    *reply = entry->reply;
    reply->release = cached_response_unref;
    reply->context = entry;
}

static void cached_response_key(char *key, const char *target, size_t size, bool is_packed) {
    key[0] = is_packed ? 'z' : '-';
    memcpy(key + 1, target, size + 1);
}

ResponseCache *response_cache_new(size_t max_bytes) {
    ResponseCache *cache = calloc(1, sizeof *cache);
    if (cache == NULL)
        return NULL;
    cache->lru = lru_new(max_bytes, cached_response_release, NULL);
    if (cache->lru == NULL) {
        free(cache);
        return NULL;
    }
    cache->max_bytes = max_bytes;
    pthread_mutex_init(&cache->lock, NULL);
    return cache;
}

void response_cache_free(ResponseCache *cache) {
    if (cache == NULL)
        return;
    lru_free(cache->lru);
    pthread_mutex_destroy(&cache->lock);
    free(cache);
}

void response_cache_clear(ResponseCache *cache) {
    pthread_mutex_lock(&cache->lock);
    cache->age++;
    lru_clear(cache->lru);
    pthread_mutex_unlock(&cache->lock);
}

uint64_t response_cache_age(ResponseCache *cache) {
    pthread_mutex_lock(&cache->lock);
    const uint64_t age = cache->age;
    pthread_mutex_unlock(&cache->lock);
    return age;
}

void response_cache_put(ResponseCache *cache, uint64_t age, const char *target, bool is_packed,
                        const Route *route, Reply *reply) {
    const size_t size = strlen(target),
                 bytes = sizeof(CachedResponse) + size + 2 + reply->body_size;
    if (bytes > cache->max_bytes / SHARE || size > REQUEST_TARGET_MAX)
        return;
    CachedResponse *entry = malloc(sizeof *entry + size + 2);
    if (entry == NULL)
        return;
    *entry = (CachedResponse){.route = route, .reply = *reply};
    entry->cached.bytes = bytes;
    entry->cached.indexed.key = entry->key;
    cached_response_key(entry->key, target, size, is_packed);
    atomic_init(&entry->refcount, 1);
    cached_response_lend(entry, reply);
    pthread_mutex_lock(&cache->lock);
    const bool is_current = age == cache->age;
    if (is_current)
        lru_add(cache->lru, &entry->cached);
    pthread_mutex_unlock(&cache->lock);
    if (!is_current)
        cached_response_unref(entry); // the reply has it alone
}

bool response_cache_find(ResponseCache *cache, const char *target, bool is_packed, Reply *reply,
                         const Route **route) {
    char key[REQUEST_TARGET_MAX + 2];
    const size_t size = strlen(target);
    if (size > REQUEST_TARGET_MAX)
        return false;
    cached_response_key(key, target, size, is_packed);
    pthread_mutex_lock(&cache->lock);
    CachedResponse *entry = lru_find(cache->lru, key);
    if (entry != NULL) {
        cached_response_lend(entry, reply);
        *route = entry->route;
    }
    pthread_mutex_unlock(&cache->lock);
    return entry != NULL;
}

LruStats response_cache_stats(ResponseCache *cache) {
    pthread_mutex_lock(&cache->lock);
    const LruStats stats = lru_stats(cache->lru);
    pthread_mutex_unlock(&cache->lock);
    return stats;
}
