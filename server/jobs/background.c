// All under one lock of the BackgroundTasks, which nobody holds for long.
#include "server/jobs/background.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct BackgroundTask {
    BackgroundTasks *all;
    BackgroundTask *next; // of those that run
    BackgroundWork work;
    Callback waker;
    atomic_bool is_stopped;
    bool is_done, is_dropped;
};

struct BackgroundTasks {
    pthread_mutex_t lock;
    pthread_cond_t idle;
    BackgroundTask *running;
    size_t count, most;
};

static void aside_free(BackgroundTask *aside) {
    aside->work.release(aside->work.context);
    free(aside);
}

static bool go_on(void *context, double fraction) {
    (void)fraction;
    return !atomic_load(&((BackgroundTask *)context)->is_stopped);
}

static void *aside_main(void *context) {
    BackgroundTask *aside = context;
    BackgroundTasks *all = aside->all;
    const Progress watch = {aside, go_on};
    aside->work.run(aside->work.context, &watch);
    pthread_mutex_lock(&all->lock);
    BackgroundTask **at = &all->running;
    while (*at != aside)
        at = &(*at)->next;
    *at = aside->next;
    aside->is_done = true;
    const bool is_dropped = aside->is_dropped;
    // A reader that is there cannot go before the lock is free.
    if (!is_dropped)
        aside->waker.wake(aside->waker.context);
    pthread_mutex_unlock(&all->lock);
    if (is_dropped)
        aside_free(aside);
    pthread_mutex_lock(&all->lock);
    all->count--;
    pthread_cond_signal(&all->idle);
    pthread_mutex_unlock(&all->lock);
    return NULL;
}

Status background_open(size_t most, BackgroundTasks **asides, Problem *problem) {
    *asides = calloc(1, sizeof **asides);
    if (*asides == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for readers' work");
    pthread_mutex_init(&(*asides)->lock, NULL);
    pthread_cond_init(&(*asides)->idle, NULL);
    (*asides)->most = most;
    return STATUS_OK;
}

void background_close(BackgroundTasks *asides) {
    if (asides == NULL)
        return;
    pthread_mutex_lock(&asides->lock);
    for (BackgroundTask *aside = asides->running; aside != NULL; aside = aside->next)
        atomic_store(&aside->is_stopped, true);
    while (asides->count > 0)
        pthread_cond_wait(&asides->idle, &asides->lock);
    pthread_mutex_unlock(&asides->lock);
    pthread_cond_destroy(&asides->idle);
    pthread_mutex_destroy(&asides->lock);
    free(asides);
}

// With the lock held.
static Status start(BackgroundTasks *asides, BackgroundTask *made, Problem *problem) {
    if (asides->count >= asides->most)
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
    made->next = asides->running;
    asides->running = made;
    asides->count++;
    return STATUS_OK;
}

Status background_start(BackgroundTasks *asides, const BackgroundWork *work, const Callback *waker,
                        BackgroundTask **aside, Problem *problem) {
    *aside = NULL;
    BackgroundTask *made = calloc(1, sizeof *made);
    if (made == NULL) {
        work->release(work->context);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a reader's work");
    }
    made->all = asides;
    made->work = *work;
    made->waker = *waker;
    atomic_init(&made->is_stopped, false);
    pthread_mutex_lock(&asides->lock);
    const Status status = start(asides, made, problem);
    pthread_mutex_unlock(&asides->lock);
    if (status == STATUS_OK)
        *aside = made;
    else
        aside_free(made);
    return status;
}

bool background_is_done(BackgroundTask *aside) {
    pthread_mutex_lock(&aside->all->lock);
    const bool is_done = aside->is_done;
    pthread_mutex_unlock(&aside->all->lock);
    return is_done;
}

void *background_context(BackgroundTask *aside) {
    return aside->work.context;
}

void background_unref(BackgroundTask *aside) {
    if (aside == NULL)
        return;
    BackgroundTasks *all = aside->all;
    pthread_mutex_lock(&all->lock);
    const bool is_done = aside->is_done;
    aside->is_dropped = true;
    atomic_store(&aside->is_stopped, true);
    pthread_mutex_unlock(&all->lock);
    if (is_done)
        aside_free(aside);
}
