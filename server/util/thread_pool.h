// Threads that do what may take a while, so that event loops never wait. Not an order of
// importance: first come, first served. Used by exchange.c.
#ifndef SERVER_UTIL_THREAD_POOL_H
#define SERVER_UTIL_THREAD_POOL_H

#include <stddef.h>

#include "core/base/status.h"

typedef struct Pool Pool;

// First member of what is to be done; it lives until `run` is called, and is not touched after.
typedef struct Task {
    struct Task *next;
    void (*run)(struct Task *task);
} Task;

Status pool_open(size_t threads, Pool **pool, Problem *problem);
void pool_put(Pool *pool, Task *task); // from any thread
// Does what was put, then ends the threads; nobody may put any more. NULL is fine.
void pool_close(Pool *pool);

#endif
