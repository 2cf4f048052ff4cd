// Entries are counted: one hold is the cache's, one of each reply that is being sent. The list and
// the table are under one lock, which is held for a few stores.
#include "server/http/response_cache.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/reply.h"

enum { BUCKETS = 1024, SHARE = 4 }; // no entry takes more than a SHAREth of the budget

typedef struct Entry {
    struct Entry *next; // in its bucket
    struct Entry *newer, *older;
    atomic_size_t refcount;
    uint64_t hash;
    size_t bytes;
    bool is_packed;
    const struct Route *route; // lives as long as the program
    Reply reply;               // owns the body
    char target[];
} Entry;

struct ResponseCache {
    pthread_mutex_t lock;
    Entry *buckets[BUCKETS];
    Entry *newest, *oldest;
    size_t most_bytes;
    ResponseCacheStats metrics;
    uint64_t age;
};

ResponseCache *response_cache_new(size_t most_bytes) {
    ResponseCache *response_cache = calloc(1, sizeof *response_cache);
    if (response_cache == NULL)
        return NULL;
    pthread_mutex_init(&response_cache->lock, NULL);
    response_cache->most_bytes = most_bytes;
    return response_cache;
}

static void entry_drop(void *context) {
    Entry *entry = context;
    if (atomic_fetch_sub(&entry->refcount, 1) != 1)
        return;
    reply_clear(&entry->reply);
    free(entry);
}

// FNV-1a.
static uint64_t hash_of(const char *target, bool is_packed) {
    uint64_t hash = is_packed ? 0x9e3779b97f4a7c15u : 14695981039346656037u;
    for (const char *c = target; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    return hash;
}

static Entry **place(ResponseCache *response_cache, uint64_t hash, const char *target,
                     bool is_packed) {
    Entry **at = &response_cache->buckets[hash % BUCKETS];
    while (*at != NULL && ((*at)->hash != hash || (*at)->is_packed != is_packed ||
                           strcmp((*at)->target, target) != 0))
        at = &(*at)->next;
    return at;
}

static void unlink_entry(ResponseCache *response_cache, Entry *entry) {
    *(entry->newer != NULL ? &entry->newer->older : &response_cache->newest) = entry->older;
    *(entry->older != NULL ? &entry->older->newer : &response_cache->oldest) = entry->newer;
}

static void link_newest(ResponseCache *response_cache, Entry *entry) {
    entry->newer = NULL;
    entry->older = response_cache->newest;
    *(response_cache->newest != NULL ? &response_cache->newest->newer : &response_cache->oldest) =
        entry;
    response_cache->newest = entry;
}

static void evict(ResponseCache *response_cache, Entry *entry) {
    *place(response_cache, entry->hash, entry->target, entry->is_packed) = entry->next;
    unlink_entry(response_cache, entry);
    response_cache->metrics.bytes -= entry->bytes;
    response_cache->metrics.count--;
    entry_drop(entry);
}

void response_cache_clear(ResponseCache *response_cache) {
    pthread_mutex_lock(&response_cache->lock);
    response_cache->age++;
    while (response_cache->oldest != NULL)
        evict(response_cache, response_cache->oldest);
    pthread_mutex_unlock(&response_cache->lock);
}

uint64_t response_cache_age(ResponseCache *response_cache) {
    pthread_mutex_lock(&response_cache->lock);
    const uint64_t age = response_cache->age;
    pthread_mutex_unlock(&response_cache->lock);
    return age;
}

void response_cache_free(ResponseCache *response_cache) {
    if (response_cache == NULL)
        return;
    response_cache_clear(response_cache);
    pthread_mutex_destroy(&response_cache->lock);
    free(response_cache);
}

static void lend(Entry *entry, Reply *reply) {
    atomic_fetch_add(&entry->refcount, 1);
    *reply = entry->reply;
    reply->release = entry_drop;
    reply->context = entry;
    reply->shared = entry;
}

void response_cache_put(ResponseCache *response_cache, uint64_t age, const char *target,
                        bool is_packed, const struct Route *route, Reply *reply) {
    const size_t bytes = sizeof(Entry) + strlen(target) + 1 + reply->body_size;
    if (bytes > response_cache->most_bytes / SHARE)
        return;
    Entry *entry = calloc(1, sizeof *entry + strlen(target) + 1);
    if (entry == NULL)
        return;
    memcpy(entry->target, target, strlen(target) + 1);
    entry->is_packed = is_packed;
    entry->hash = hash_of(target, is_packed);
    entry->route = route;
    entry->bytes = bytes;
    entry->reply = *reply;
    atomic_init(&entry->refcount, 1);
    lend(entry, reply);
    pthread_mutex_lock(&response_cache->lock);
    if (age != response_cache->age) {
        pthread_mutex_unlock(&response_cache->lock);
        entry_drop(entry); // the reply has it alone
        return;
    }
    Entry **at = place(response_cache, entry->hash, target, is_packed);
    if (*at != NULL)
        evict(response_cache, *at);
    at = &response_cache->buckets[entry->hash % BUCKETS];
    entry->next = *at;
    *at = entry;
    link_newest(response_cache, entry);
    response_cache->metrics.count++;
    response_cache->metrics.bytes += bytes;
    while (response_cache->metrics.bytes > response_cache->most_bytes) {
        response_cache->metrics.evictions++;
        evict(response_cache, response_cache->oldest);
    }
    pthread_mutex_unlock(&response_cache->lock);
}

bool response_cache_find(ResponseCache *response_cache, const char *target, bool is_packed,
                         Reply *reply, const struct Route **route) {
    const uint64_t hash = hash_of(target, is_packed);
    pthread_mutex_lock(&response_cache->lock);
    Entry *entry = *place(response_cache, hash, target, is_packed);
    if (entry != NULL) {
        unlink_entry(response_cache, entry);
        link_newest(response_cache, entry);
        lend(entry, reply);
        *route = entry->route;
        response_cache->metrics.hits++;
    } else {
        response_cache->metrics.misses++;
    }
    pthread_mutex_unlock(&response_cache->lock);
    return entry != NULL;
}

ResponseCacheStats response_cache_tally(ResponseCache *response_cache) {
    pthread_mutex_lock(&response_cache->lock);
    const ResponseCacheStats metrics = response_cache->metrics;
    pthread_mutex_unlock(&response_cache->lock);
    return metrics;
}
