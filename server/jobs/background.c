// All under one lock of the BackgroundTasks, which is never held for long.
#include "server/jobs/background.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct BackgroundTask {
    BackgroundTasks *all;
    BackgroundTask *next; // of those that run
    BackgroundWork work;
    Callback callback;
    atomic_bool is_stopped;
    bool is_done, is_dropped;
};

struct BackgroundTasks {
    pthread_mutex_t lock;
    pthread_cond_t idle;
    BackgroundTask *running;
    size_t count, most;
};

static void aside_free(BackgroundTask *background) {
    background->work.release(background->work.context);
    free(background);
}

static bool go_on(void *context, double fraction) {
    (void)fraction;
    return !atomic_load(&((BackgroundTask *)context)->is_stopped);
}

static void *aside_main(void *context) {
    BackgroundTask *background = context;
    BackgroundTasks *all = background->all;
    const Progress watch = {background, go_on};
    background->work.run(background->work.context, &watch);
    pthread_mutex_lock(&all->lock);
    BackgroundTask **at = &all->running;
    while (*at != background)
        at = &(*at)->next;
    *at = background->next;
    background->is_done = true;
    const bool is_dropped = background->is_dropped;
    // A reader that is there cannot go before the lock is free.
    if (!is_dropped)
        background->callback.wake(background->callback.context);
    pthread_mutex_unlock(&all->lock);
    if (is_dropped)
        aside_free(background);
    pthread_mutex_lock(&all->lock);
    all->count--;
    pthread_cond_signal(&all->idle);
    pthread_mutex_unlock(&all->lock);
    return NULL;
}

Status background_open(size_t most, BackgroundTasks **background_tasks, Problem *problem) {
    *background_tasks = calloc(1, sizeof **background_tasks);
    if (*background_tasks == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for readers' work");
    pthread_mutex_init(&(*background_tasks)->lock, NULL);
    pthread_cond_init(&(*background_tasks)->idle, NULL);
    (*background_tasks)->most = most;
    return STATUS_OK;
}

void background_close(BackgroundTasks *background_tasks) {
    if (background_tasks == NULL)
        return;
    pthread_mutex_lock(&background_tasks->lock);
    for (BackgroundTask *background = background_tasks->running; background != NULL;
         background = background->next)
        atomic_store(&background->is_stopped, true);
    while (background_tasks->count > 0)
        pthread_cond_wait(&background_tasks->idle, &background_tasks->lock);
    pthread_mutex_unlock(&background_tasks->lock);
    pthread_cond_destroy(&background_tasks->idle);
    pthread_mutex_destroy(&background_tasks->lock);
    free(background_tasks);
}

// With the lock held.
static Status start(BackgroundTasks *background_tasks, BackgroundTask *made, Problem *problem) {
    if (background_tasks->count >= background_tasks->most)
        return problem_set(problem, STATUS_BUSY,
                           "as much is being computed for readers as may be at once; ask again a "
                           "little later");
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    const int error = pthread_create(&thread, &attributes, aside_main, made);
    pthread_attr_destroy(&attributes);
    if (error != 0)
        return problem_set(problem, STATUS_BUSY, "no thread can be started now");
    made->next = background_tasks->running;
    background_tasks->running = made;
    background_tasks->count++;
    return STATUS_OK;
}

Status background_start(BackgroundTasks *background_tasks, const BackgroundWork *work,
                        const Callback *callback, BackgroundTask **background, Problem *problem) {
    *background = NULL;
    BackgroundTask *made = calloc(1, sizeof *made);
    if (made == NULL) {
        work->release(work->context);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader's work");
    }
    made->all = background_tasks;
    made->work = *work;
    made->callback = *callback;
    atomic_init(&made->is_stopped, false);
    pthread_mutex_lock(&background_tasks->lock);
    const Status status = start(background_tasks, made, problem);
    pthread_mutex_unlock(&background_tasks->lock);
    if (status == STATUS_OK)
        *background = made;
    else
        aside_free(made);
    return status;
}

bool background_is_done(BackgroundTask *background) {
    pthread_mutex_lock(&background->all->lock);
    const bool is_done = background->is_done;
    pthread_mutex_unlock(&background->all->lock);
    return is_done;
}

void *background_context(BackgroundTask *background) {
    return background->work.context;
}

void background_unref(BackgroundTask *background) {
    if (background == NULL)
        return;
    BackgroundTasks *all = background->all;
    pthread_mutex_lock(&all->lock);
    const bool is_done = background->is_done;
    background->is_dropped = true;
    atomic_store(&background->is_stopped, true);
    pthread_mutex_unlock(&all->lock);
    if (is_done)
        aside_free(background);
}
