// Whole answers that never change, by their target, up to a budget of bytes; the longest unused one
// goes first. Not the outcomes they were made of (jobs/cache.h). Used by dispatch.c, from all
// threads.
#ifndef SERVER_HTTP_RESPONSE_CACHE_H
#define SERVER_HTTP_RESPONSE_CACHE_H

#include "server/http/request.h"

typedef struct ResponseCache ResponseCache;

ResponseCache *response_cache_new(size_t most_bytes);    // NULL without memory
void response_cache_free(ResponseCache *response_cache); // NULL is fine; answers still held live on

// Grows with each response_cache_clear.
uint64_t response_cache_age(ResponseCache *response_cache);

// Keeps a finished 200 of a body that is whole in memory: what `reply` owns moves into the cache,
// and `reply` becomes a borrower of it. One that is too large for the budget stays as it is.
// `target` is as sent, `is_packed` says that the body is gzip, `route` whose it is.
// Nothing is kept that was begun at another `age`: it may have been deleted since.
void response_cache_put(ResponseCache *response_cache, uint64_t age, const char *target,
                        bool is_packed, const struct Route *route, Reply *reply);

// Fills `reply`, a borrower, and *route. False if it is not there.
bool response_cache_find(ResponseCache *response_cache, const char *target, bool is_packed,
                         Reply *reply, const struct Route **route);

// Forgets all: something that never changes was deleted.
void response_cache_clear(ResponseCache *response_cache);

typedef struct ResponseCacheStats {
    size_t count, bytes;
    uint64_t hits, misses, evictions;
} ResponseCacheStats;
ResponseCacheStats response_cache_tally(ResponseCache *response_cache);

#endif
