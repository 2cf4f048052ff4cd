// Whole responses that never change, by their target, up to a budget of bytes. Locked.
#ifndef SERVER_HTTP_RESPONSE_CACHE_H
#define SERVER_HTTP_RESPONSE_CACHE_H

#include "server/http/request.h"
#include "server/util/hashmap.h"

typedef struct ResponseCache ResponseCache;

ResponseCache *response_cache_new(size_t max_bytes); // NULL without memory
void response_cache_free(ResponseCache *cache); // NULL is accepted; replies being sent stay valid

// Incremented by each response_cache_clear.
uint64_t response_cache_age(ResponseCache *cache);

// Stores a finished 200 whose body is whole in memory: the cache takes what `reply` owns, and
// `reply` borrows it. A response too large for the budget stays as it is. `target` is as sent,
// `is_packed`: the body is gzip. A response begun at another `age` is not stored: what it shows may
// have been deleted.
void response_cache_put(ResponseCache *cache, uint64_t age, const char *target, bool is_packed,
                        const Route *route, Reply *reply);

// Fills `reply`, which borrows, and *route. False if absent.
bool response_cache_find(ResponseCache *cache, const char *target, bool is_packed, Reply *reply,
                         const Route **route);

// Removes everything: something that never changes was deleted.
void response_cache_clear(ResponseCache *cache);

LruStats response_cache_stats(ResponseCache *cache);

#endif
