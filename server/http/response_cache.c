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
    atomic_size_t holds;
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
    ResponseCacheStats tally;
    uint64_t age;
};

ResponseCache *response_cache_new(size_t most_bytes) {
    ResponseCache *hot = calloc(1, sizeof *hot);
    if (hot == NULL)
        return NULL;
    pthread_mutex_init(&hot->lock, NULL);
    hot->most_bytes = most_bytes;
    return hot;
}

static void entry_drop(void *context) {
    Entry *entry = context;
    if (atomic_fetch_sub(&entry->holds, 1) != 1)
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

static Entry **place(ResponseCache *hot, uint64_t hash, const char *target, bool is_packed) {
    Entry **at = &hot->buckets[hash % BUCKETS];
    while (*at != NULL && ((*at)->hash != hash || (*at)->is_packed != is_packed ||
                           strcmp((*at)->target, target) != 0))
        at = &(*at)->next;
    return at;
}

static void unlink_entry(ResponseCache *hot, Entry *entry) {
    *(entry->newer != NULL ? &entry->newer->older : &hot->newest) = entry->older;
    *(entry->older != NULL ? &entry->older->newer : &hot->oldest) = entry->newer;
}

static void link_newest(ResponseCache *hot, Entry *entry) {
    entry->newer = NULL;
    entry->older = hot->newest;
    *(hot->newest != NULL ? &hot->newest->newer : &hot->oldest) = entry;
    hot->newest = entry;
}

static void evict(ResponseCache *hot, Entry *entry) {
    *place(hot, entry->hash, entry->target, entry->is_packed) = entry->next;
    unlink_entry(hot, entry);
    hot->tally.bytes -= entry->bytes;
    hot->tally.count--;
    entry_drop(entry);
}

void response_cache_clear(ResponseCache *hot) {
    pthread_mutex_lock(&hot->lock);
    hot->age++;
    while (hot->oldest != NULL)
        evict(hot, hot->oldest);
    pthread_mutex_unlock(&hot->lock);
}

uint64_t response_cache_age(ResponseCache *hot) {
    pthread_mutex_lock(&hot->lock);
    const uint64_t age = hot->age;
    pthread_mutex_unlock(&hot->lock);
    return age;
}

void response_cache_free(ResponseCache *hot) {
    if (hot == NULL)
        return;
    response_cache_clear(hot);
    pthread_mutex_destroy(&hot->lock);
    free(hot);
}

static void lend(Entry *entry, Reply *reply) {
    atomic_fetch_add(&entry->holds, 1);
    *reply = entry->reply;
    reply->release = entry_drop;
    reply->context = entry;
    reply->shared = entry;
}

void response_cache_put(ResponseCache *hot, uint64_t age, const char *target, bool is_packed,
                        const struct Route *route, Reply *reply) {
    const size_t bytes = sizeof(Entry) + strlen(target) + 1 + reply->body_size;
    if (bytes > hot->most_bytes / SHARE)
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
    atomic_init(&entry->holds, 1);
    lend(entry, reply);
    pthread_mutex_lock(&hot->lock);
    if (age != hot->age) {
        pthread_mutex_unlock(&hot->lock);
        entry_drop(entry); // the reply has it alone
        return;
    }
    Entry **at = place(hot, entry->hash, target, is_packed);
    if (*at != NULL)
        evict(hot, *at);
    at = &hot->buckets[entry->hash % BUCKETS];
    entry->next = *at;
    *at = entry;
    link_newest(hot, entry);
    hot->tally.count++;
    hot->tally.bytes += bytes;
    while (hot->tally.bytes > hot->most_bytes) {
        hot->tally.evictions++;
        evict(hot, hot->oldest);
    }
    pthread_mutex_unlock(&hot->lock);
}

bool response_cache_find(ResponseCache *hot, const char *target, bool is_packed, Reply *reply,
                         const struct Route **route) {
    const uint64_t hash = hash_of(target, is_packed);
    pthread_mutex_lock(&hot->lock);
    Entry *entry = *place(hot, hash, target, is_packed);
    if (entry != NULL) {
        unlink_entry(hot, entry);
        link_newest(hot, entry);
        lend(entry, reply);
        *route = entry->route;
        hot->tally.hits++;
    } else {
        hot->tally.misses++;
    }
    pthread_mutex_unlock(&hot->lock);
    return entry != NULL;
}

ResponseCacheStats response_cache_tally(ResponseCache *hot) {
    pthread_mutex_lock(&hot->lock);
    const ResponseCacheStats tally = hot->tally;
    pthread_mutex_unlock(&hot->lock);
    return tally;
}
