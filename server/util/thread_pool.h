// Threads that run what may take a while, first come, first served. A thread is started when there
// is work and all others are busy, up to a limit.
#ifndef SERVER_UTIL_THREAD_POOL_H
#define SERVER_UTIL_THREAD_POOL_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

// pthread_create; its failure names the thread. STATUS_NO_MEMORY, also where there are too many.
Status thread_start(pthread_t *thread, void *(*run)(void *), void *item, const char *name,
                    Problem *problem);

typedef struct ThreadPool ThreadPool;

// The first member of what is run. It lives until `run` is called and is not touched after that.
typedef struct WorkItem {
    struct WorkItem *next;
    void (*run)(struct WorkItem *item);
} WorkItem;

Status thread_pool_open(size_t max_threads, ThreadPool **pool, Problem *problem);
void thread_pool_add(ThreadPool *pool, WorkItem *item); // from any thread
// Runs what was added, then ends the threads; nothing may be added any more. NULL is accepted.
void thread_pool_close(ThreadPool *pool);

#endif
