// Finished outcomes in memory, by their result's id, up to a budget of bytes; the longest unused
// one goes first. Not locked: the intake's lock guards it. Used by intake.c.
#ifndef SERVER_JOBS_CACHE_H
#define SERVER_JOBS_CACHE_H

#include "core/simulation/simulation.h"

typedef struct Cache Cache;

Cache *cache_new(size_t most_bytes); // NULL without memory
void cache_free(Cache *cache);

// Keeps a hold of its own on `outcome`. The newest one is kept even if it is larger than the
// budget, so that whoever asked for it finds it. Without memory nothing is kept.
void cache_put(Cache *cache, const char *id, Outcome *outcome);
Outcome *cache_find(Cache *cache, const char *id); // a hold for the caller, or NULL
void cache_forget(Cache *cache, const char *id);
size_t cache_count(const Cache *cache);
size_t cache_bytes(const Cache *cache);

#endif
