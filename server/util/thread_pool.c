#include "server/util/thread_pool.h"

#include <pthread.h>
#include <stdlib.h>

struct ThreadPool {
    pthread_mutex_t lock;
    pthread_cond_t has_work;
    WorkItem *first, **last;
    bool is_closing;
    size_t unfinished;         // items that wait or run
    size_t count, max_threads; // of threads
    pthread_t threads[];
};

static void *thread_pool_work(void *context) {
    ThreadPool *pool = context;
    pthread_mutex_lock(&pool->lock);
    for (;;) {
        while (pool->first == NULL && !pool->is_closing)
            pthread_cond_wait(&pool->has_work, &pool->lock);
        WorkItem *item = pool->first;
        if (item == NULL)
            break;
        pool->first = item->next;
        if (pool->first == NULL)
            pool->last = &pool->first;
        pthread_mutex_unlock(&pool->lock);
        item->run(item);
        pthread_mutex_lock(&pool->lock);
        pool->unfinished--;
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

// With the lock held, or before other threads know the pool.
static void thread_pool_start_thread(ThreadPool *pool) {
    if (pthread_create(&pool->threads[pool->count], NULL, thread_pool_work, pool) == 0)
        pool->count++;
}

Status thread_pool_open(size_t max_threads, ThreadPool **pool, Problem *problem) {
    *pool = NULL;
    ThreadPool *made = calloc(1, sizeof *made + max_threads * sizeof *made->threads);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a pool of threads");
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->has_work, NULL);
    made->last = &made->first;
    made->max_threads = max_threads;
    thread_pool_start_thread(made); // one is certain: nothing waits for ever
    if (made->count == 0) {
        thread_pool_close(made);
        return problem_set(problem, STATUS_INTERNAL,
                           "the first thread of a pool cannot be "
                           "started");
    }
    *pool = made;
    return STATUS_OK;
}

void thread_pool_add(ThreadPool *pool, WorkItem *item) {
    item->next = NULL;
    pthread_mutex_lock(&pool->lock);
    if (pool->unfinished >= pool->count && pool->count < pool->max_threads)
        thread_pool_start_thread(pool);
    *pool->last = item;
    pool->last = &item->next;
    pool->unfinished++;
    pthread_cond_signal(&pool->has_work);
    pthread_mutex_unlock(&pool->lock);
}

void thread_pool_close(ThreadPool *pool) {
    if (pool == NULL)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->is_closing = true;
    pthread_cond_broadcast(&pool->has_work);
    pthread_mutex_unlock(&pool->lock);
    for (size_t i = 0; i < pool->count; i++)
        pthread_join(pool->threads[i], NULL);
    pthread_cond_destroy(&pool->has_work);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}
