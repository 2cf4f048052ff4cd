#include "server/jobs/background.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "server/util/thread_pool.h"

struct BackgroundTask {
    WorkItem item;
    BackgroundTasks *all;
    BackgroundTask *next; // of those that run
    BackgroundWork work;
    Callback callback;
    atomic_bool is_stopped;
    bool is_done, is_left;
};

// All under one lock, which is never held for long.
struct BackgroundTasks {
    pthread_mutex_t lock;
    ThreadPool *pool;
    BackgroundTask *running;
    size_t count, max_tasks;
};

static void background_free(BackgroundTask *task) {
    task->work.release(task->work.context);
    free(task);
}

static bool background_continues(void *context, double fraction) {
    (void)fraction;
    return !atomic_load(&((BackgroundTask *)context)->is_stopped);
}

static void background_run(WorkItem *item) {
    BackgroundTask *task = (BackgroundTask *)(void *)item;
    BackgroundTasks *tasks = task->all;
    const Progress watch = {task, background_continues};
    task->work.run(task->work.context, &watch);
    pthread_mutex_lock(&tasks->lock);
    BackgroundTask **at = &tasks->running;
    while (*at != task)
        at = &(*at)->next;
    *at = task->next;
    tasks->count--;
    task->is_done = true;
    const bool is_left = task->is_left;
    // A reader that is there cannot go before the lock is free.
    if (!is_left)
        task->callback.wake(task->callback.context);
    pthread_mutex_unlock(&tasks->lock);
    if (is_left)
        background_free(task);
}

Status background_open(size_t max_tasks, BackgroundTasks **opened, Problem *problem) {
    BackgroundTasks *tasks = calloc(1, sizeof *tasks);
    *opened = NULL;
    if (tasks == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for readers' work");
    pthread_mutex_init(&tasks->lock, NULL);
    tasks->max_tasks = max_tasks;
    const Status status = thread_pool_open(max_tasks, &tasks->pool, problem);
    if (status == STATUS_OK)
        *opened = tasks;
    else
        background_close(tasks);
    return status;
}

void background_close(BackgroundTasks *tasks) {
    if (tasks == NULL)
        return;
    pthread_mutex_lock(&tasks->lock);
    for (BackgroundTask *task = tasks->running; task != NULL; task = task->next)
        atomic_store(&task->is_stopped, true);
    pthread_mutex_unlock(&tasks->lock);
    thread_pool_close(tasks->pool);
    pthread_mutex_destroy(&tasks->lock);
    free(tasks);
}

Status background_start(BackgroundTasks *tasks, const BackgroundWork *work,
                        const Callback *callback, BackgroundTask **started, Problem *problem) {
    BackgroundTask *task = calloc(1, sizeof *task);
    *started = NULL;
    if (task == NULL) {
        work->release(work->context);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader's work");
    }
    task->item.run = background_run;
    task->all = tasks;
    task->work = *work;
    task->callback = *callback;
    pthread_mutex_lock(&tasks->lock);
    const bool has_room = tasks->count < tasks->max_tasks;
    if (has_room) {
        task->next = tasks->running;
        tasks->running = task;
        tasks->count++;
    }
    pthread_mutex_unlock(&tasks->lock);
    if (has_room) {
        *started = task;
        thread_pool_add(tasks->pool, &task->item);
        return STATUS_OK;
    }
    background_free(task);
    return problem_set(problem, STATUS_BUSY,
                       "as much is being computed for readers as may be at once; ask again a "
                       "little later");
}

bool background_is_done(BackgroundTask *task) {
    pthread_mutex_lock(&task->all->lock);
    const bool is_done = task->is_done;
    pthread_mutex_unlock(&task->all->lock);
    return is_done;
}

void *background_context(BackgroundTask *task) {
    return task->work.context;
}

void background_unref(BackgroundTask *task) {
    BackgroundTasks *tasks = task->all;
    pthread_mutex_lock(&tasks->lock);
    const bool is_done = task->is_done;
    task->is_left = true;
    atomic_store(&task->is_stopped, true);
    pthread_mutex_unlock(&tasks->lock);
    if (is_done)
        background_free(task);
}
