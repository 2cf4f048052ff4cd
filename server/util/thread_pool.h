// Threads that do what may take a while, so that event loops never wait. Not an order of
// importance: first come, first served. Used by exchange.c.
#ifndef SERVER_UTIL_THREAD_POOL_H
#define SERVER_UTIL_THREAD_POOL_H

#include <stddef.h>

#include "core/base/status.h"

typedef struct ThreadPool ThreadPool;

// First member of what is to be done; it lives until `run` is called, and is not touched after.
typedef struct WorkItem {
    struct WorkItem *next;
    void (*run)(struct WorkItem *task);
} WorkItem;

Status thread_pool_open(size_t threads, ThreadPool **pool, Problem *problem);
void thread_pool_add(ThreadPool *pool, WorkItem *task); // from any thread
// Does what was put, then ends the threads; nobody may put any more. NULL is fine.
void thread_pool_close(ThreadPool *pool);

#endif
