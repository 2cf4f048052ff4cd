#include "server/util/thread_pool.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

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

Status thread_start(pthread_t *thread, void *(*run)(void *), void *item, const char *name,
                    Problem *problem) {
    const int code = pthread_create(thread, NULL, run, item);
    if (code == 0)
        return STATUS_OK;
    return problem_set(problem, code == EAGAIN ? STATUS_NO_MEMORY : STATUS_INTERNAL,
                       "%s cannot be started: %s", name,
                       code == EAGAIN ? "too little memory or too many threads" : strerror(code));
}

// With the lock held, or before other threads know the pool.
static Status thread_pool_start_thread(ThreadPool *pool, Problem *problem) {
    TRY(thread_start(&pool->threads[pool->count], thread_pool_work, pool, "a thread of a pool",
                     problem));
    pool->count++;
    return STATUS_OK;
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
    // One is certain: nothing waits for ever.
    const Status status = thread_pool_start_thread(made, problem);
    if (status != STATUS_OK) {
        thread_pool_close(made);
        return status;
    }
    *pool = made;
    return STATUS_OK;
}

void thread_pool_add(ThreadPool *pool, WorkItem *item) {
    item->next = NULL;
    pthread_mutex_lock(&pool->lock);
    if (pool->unfinished >= pool->count && pool->count < pool->max_threads)
        (void)thread_pool_start_thread(pool, NULL);
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
