// A timer:   free -> taken -> (waiting -> taken)* -> free
//
// The lock guards the waits, which other threads end; each change is a few stores. Limits are the
// loop's alone. `next_ns` is a lower bound of all times, so that setting a later one costs nothing.
// libmicrohttpd 0.9.75 overlooks the end of a stream that came together with a request: shortly
// after the answer the socket is asked for it.
#include "server/http/timer.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/socket.h>

#include "server/util/clock.h"

enum { END_CHECK_MS = 100 };

struct ConnectionTimer {
    TimerList *timers;
    ConnectionTimer *next; // of all
    ConnectionTimer *next_free;
    Callback callback;
    int descriptor; // -1: free
    void *waiting;  // the suspended connection, or NULL
    atomic_bool is_woken;
    int64_t wake_ns, limit_ns; // INT64_MAX: none
    int64_t checked_limit_ns;  // replaces limit_ns once the end of the stream was checked for
    int64_t idle_ns;           // since when it is between two requests; INT64_MAX: it is not
};

struct TimerList {
    TimerCallbacks calls;
    void *loop;
    pthread_mutex_t lock;
    ConnectionTimer *all, *free_list;
    _Atomic(int64_t) next_ns;
    atomic_bool is_closing;
};

static void timer_wake_locked(ConnectionTimer *timer) {
    if (timer->waiting == NULL)
        return;
    void *connection = timer->waiting;
    timer->waiting = NULL;
    timer->wake_ns = INT64_MAX;
    timer->timers->calls.resume(connection);
}

static void timer_wake(void *context) {
    ConnectionTimer *timer = context;
    pthread_mutex_lock(&timer->timers->lock);
    timer->is_woken = true;
    timer_wake_locked(timer);
    pthread_mutex_unlock(&timer->timers->lock);
}

// Whether `time_ns` is earlier than all others.
static bool timer_lower_next(TimerList *timers, int64_t time_ns) {
    int64_t next = atomic_load(&timers->next_ns);
    while (time_ns < next)
        if (atomic_compare_exchange_weak(&timers->next_ns, &next, time_ns))
            return true;
    return false;
}

static bool descriptor_has_ended(int descriptor) {
    char byte;
    return recv(descriptor, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

int64_t timer_list_run(TimerList *timers, int64_t now_ns) {
    if (atomic_load(&timers->next_ns) > now_ns)
        return atomic_load(&timers->next_ns);
    pthread_mutex_lock(&timers->lock);
    int64_t next = INT64_MAX;
    for (ConnectionTimer *timer = timers->all; timer != NULL; timer = timer->next) {
        if (timer->wake_ns <= now_ns)
            timer_wake_locked(timer);
        if (timer->limit_ns <= now_ns && now_ns < timer->checked_limit_ns &&
            !descriptor_has_ended(timer->descriptor))
            timer->limit_ns = timer->checked_limit_ns;
        if (timer->limit_ns <= now_ns) {
            shutdown(timer->descriptor, SHUT_RDWR);
            timer->limit_ns = INT64_MAX;
        }
        next = timer->wake_ns < next ? timer->wake_ns : next;
        next = timer->limit_ns < next ? timer->limit_ns : next;
    }
    atomic_store(&timers->next_ns, next); // others lower it with the lock
    pthread_mutex_unlock(&timers->lock);
    return next;
}

TimerList *timer_list_new(const TimerCallbacks *calls, void *loop) {
    TimerList *timers = calloc(1, sizeof *timers);
    if (timers == NULL)
        return NULL;
    timers->calls = *calls;
    timers->loop = loop;
    atomic_init(&timers->next_ns, INT64_MAX);
    pthread_mutex_init(&timers->lock, NULL);
    return timers;
}

void timer_list_wake_all(TimerList *timers) {
    pthread_mutex_lock(&timers->lock);
    timers->is_closing = true;
    for (ConnectionTimer *timer = timers->all; timer != NULL; timer = timer->next)
        timer_wake_locked(timer);
    pthread_mutex_unlock(&timers->lock);
}

bool timer_list_is_closing(TimerList *timers) {
    return atomic_load(&timers->is_closing);
}

void timer_list_close_idle(TimerList *timers, int64_t min_ms) {
    ConnectionTimer *longest = NULL;
    for (ConnectionTimer *timer = timers->all; timer != NULL; timer = timer->next)
        if (timer->idle_ns < (longest != NULL ? longest->idle_ns : INT64_MAX))
            longest = timer;
    if (longest == NULL || longest->idle_ns > clock_monotonic_ns() - min_ms * 1000000)
        return;
    shutdown(longest->descriptor, SHUT_RDWR);
    longest->idle_ns = INT64_MAX;
}

void timer_list_free(TimerList *timers) {
    if (timers == NULL)
        return;
    while (timers->all != NULL) {
        ConnectionTimer *next = timers->all->next;
        free(timers->all);
        timers->all = next;
    }
    pthread_mutex_destroy(&timers->lock);
    free(timers);
}

ConnectionTimer *timer_take(TimerList *timers, int descriptor) {
    pthread_mutex_lock(&timers->lock);
    ConnectionTimer *timer = timers->free_list;
    if (timer != NULL) {
        timers->free_list = timer->next_free;
    } else if ((timer = malloc(sizeof *timer)) != NULL) {
        timer->timers = timers;
        timer->callback = (Callback){timer, timer_wake};
        timer->next = timers->all;
        timers->all = timer;
    }
    if (timer != NULL) {
        timer->descriptor = descriptor;
        timer->waiting = NULL;
        timer->is_woken = false;
        timer->wake_ns = timer->limit_ns = timer->idle_ns = INT64_MAX;
    }
    pthread_mutex_unlock(&timers->lock);
    return timer;
}

void timer_leave(ConnectionTimer *timer) {
    TimerList *timers = timer->timers;
    pthread_mutex_lock(&timers->lock);
    timer->descriptor = -1;
    timer->waiting = NULL;
    timer->wake_ns = timer->limit_ns = timer->idle_ns = INT64_MAX;
    timer->next_free = timers->free_list;
    timers->free_list = timer;
    pthread_mutex_unlock(&timers->lock);
}

const Callback *timer_callback(const ConnectionTimer *timer) {
    return &timer->callback;
}

void timer_limit(ConnectionTimer *timer, int64_t max_ms, bool is_idle) {
    const int64_t now_ns = max_ms > 0 ? clock_monotonic_ns() : 0;
    const int64_t first_ms = is_idle && max_ms > END_CHECK_MS ? END_CHECK_MS : max_ms;
    timer->limit_ns = max_ms > 0 ? now_ns + first_ms * 1000000 : INT64_MAX;
    timer->checked_limit_ns = max_ms > 0 ? now_ns + max_ms * 1000000 : 0;
    timer->idle_ns = is_idle ? now_ns : INT64_MAX;
    (void)timer_lower_next(timer->timers, timer->limit_ns);
}

bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t max_ms) {
    TimerList *timers = timer->timers;
    const int64_t wake_ns = clock_monotonic_ns() + max_ms * 1000000;
    pthread_mutex_lock(&timers->lock);
    const bool waits = !timer->is_woken && !timers->is_closing;
    if (waits) {
        // The state first: the resume may come from another thread as soon as the lock is free.
        timer->waiting = connection;
        timer->wake_ns = wake_ns;
        timers->calls.suspend(connection);
        if (timer_lower_next(timers, wake_ns))
            timers->calls.changed(timers->loop);
    }
    pthread_mutex_unlock(&timers->lock);
    return waits;
}

bool timer_was_woken(ConnectionTimer *timer) {
    return atomic_exchange(&timer->is_woken, false);
}
