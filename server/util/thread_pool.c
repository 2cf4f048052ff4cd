#include "server/util/thread_pool.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

struct ThreadPool {
    pthread_mutex_t lock;
    pthread_cond_t some;
    WorkItem *first, **last;
    bool is_closing;
    size_t count; // of threads
    pthread_t threads[];
};

static void *work(void *context) {
    ThreadPool *pool = context;
    pthread_mutex_lock(&pool->lock);
    for (;;) {
        while (pool->first == NULL && !pool->is_closing)
            pthread_cond_wait(&pool->some, &pool->lock);
        WorkItem *task = pool->first;
        if (task == NULL)
            break;
        pool->first = task->next;
        if (pool->first == NULL)
            pool->last = &pool->first;
        pthread_mutex_unlock(&pool->lock);
        task->run(task);
        pthread_mutex_lock(&pool->lock);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

Status thread_pool_open(size_t threads, ThreadPool **pool, Problem *problem) {
    *pool = NULL;
    ThreadPool *made = calloc(1, sizeof *made + threads * sizeof *made->threads);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the threads that answer");
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->some, NULL);
    made->last = &made->first;
    while (made->count < threads &&
           pthread_create(&made->threads[made->count], NULL, work, made) == 0)
        made->count++;
    if (made->count < threads) {
        thread_pool_close(made);
        return problem_set(problem, STATUS_INTERNAL,
                           "the threads that answer requests cannot be started");
    }
    *pool = made;
    return STATUS_OK;
}

void thread_pool_add(ThreadPool *pool, WorkItem *task) {
    task->next = NULL;
    pthread_mutex_lock(&pool->lock);
    *pool->last = task;
    pool->last = &task->next;
    pthread_cond_signal(&pool->some);
    pthread_mutex_unlock(&pool->lock);
}

void thread_pool_close(ThreadPool *pool) {
    if (pool == NULL)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->is_closing = true;
    pthread_cond_broadcast(&pool->some);
    pthread_mutex_unlock(&pool->lock);
    for (size_t i = 0; i < pool->count; i++)
        pthread_join(pool->threads[i], NULL);
    pthread_cond_destroy(&pool->some);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}
