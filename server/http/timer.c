// A timer:   free -> taken -> (waiting -> taken)* -> free
//
// The lock guards the waits, which other threads end; each change is a few stores. Limits are the
// loop's alone. `next_ns` is a lower bound of all times, so that setting a later one costs nothing.
#include "server/http/timer.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/socket.h>

#include "server/util/clock.h"

struct ConnectionTimer {
    TimerWheel *wheel;
    ConnectionTimer *next; // of all
    ConnectionTimer *next_free;
    Callback callback;
    int descriptor; // -1: free
    void *waiting;  // the suspended connection, or NULL
    atomic_bool is_woken;
    int64_t wake_ns, limit_ns; // INT64_MAX: none
    int64_t idle_ns;           // since when it is between two requests; INT64_MAX: it is not
};

struct TimerWheel {
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
    timer->wheel->calls.resume(connection);
}

static void timer_wake(void *context) {
    ConnectionTimer *timer = context;
    pthread_mutex_lock(&timer->wheel->lock);
    timer->is_woken = true;
    timer_wake_locked(timer);
    pthread_mutex_unlock(&timer->wheel->lock);
}

// Whether `time_ns` is earlier than all others.
static bool timer_lower_next(TimerWheel *wheel, int64_t time_ns) {
    int64_t next = atomic_load(&wheel->next_ns);
    while (time_ns < next)
        if (atomic_compare_exchange_weak(&wheel->next_ns, &next, time_ns))
            return true;
    return false;
}

int64_t timer_wheel_run(TimerWheel *wheel, int64_t now_ns) {
    if (atomic_load(&wheel->next_ns) > now_ns)
        return atomic_load(&wheel->next_ns);
    pthread_mutex_lock(&wheel->lock);
    int64_t next = INT64_MAX;
    for (ConnectionTimer *timer = wheel->all; timer != NULL; timer = timer->next) {
        if (timer->wake_ns <= now_ns)
            timer_wake_locked(timer);
        if (timer->limit_ns <= now_ns) {
            shutdown(timer->descriptor, SHUT_RDWR);
            timer->limit_ns = INT64_MAX;
        }
        next = timer->wake_ns < next ? timer->wake_ns : next;
        next = timer->limit_ns < next ? timer->limit_ns : next;
    }
    atomic_store(&wheel->next_ns, next); // others lower it with the lock
    pthread_mutex_unlock(&wheel->lock);
    return next;
}

TimerWheel *timer_wheel_new(const TimerCallbacks *calls, void *loop) {
    TimerWheel *wheel = calloc(1, sizeof *wheel);
    if (wheel == NULL)
        return NULL;
    wheel->calls = *calls;
    wheel->loop = loop;
    atomic_init(&wheel->next_ns, INT64_MAX);
    pthread_mutex_init(&wheel->lock, NULL);
    return wheel;
}

void timer_wheel_wake_all(TimerWheel *wheel) {
    pthread_mutex_lock(&wheel->lock);
    wheel->is_closing = true;
    for (ConnectionTimer *timer = wheel->all; timer != NULL; timer = timer->next)
        timer_wake_locked(timer);
    pthread_mutex_unlock(&wheel->lock);
}

bool timer_wheel_is_closing(TimerWheel *wheel) {
    return atomic_load(&wheel->is_closing);
}

void timer_wheel_close_idle(TimerWheel *wheel, int64_t min_ms) {
    ConnectionTimer *longest = NULL;
    for (ConnectionTimer *timer = wheel->all; timer != NULL; timer = timer->next)
        if (timer->idle_ns < (longest != NULL ? longest->idle_ns : INT64_MAX))
            longest = timer;
    if (longest == NULL || longest->idle_ns > clock_monotonic_ns() - min_ms * 1000000)
        return;
    shutdown(longest->descriptor, SHUT_RDWR);
    longest->idle_ns = INT64_MAX;
}

void timer_wheel_free(TimerWheel *wheel) {
    if (wheel == NULL)
        return;
    while (wheel->all != NULL) {
        ConnectionTimer *next = wheel->all->next;
        free(wheel->all);
        wheel->all = next;
    }
    pthread_mutex_destroy(&wheel->lock);
    free(wheel);
}

ConnectionTimer *timer_take(TimerWheel *wheel, int descriptor) {
    pthread_mutex_lock(&wheel->lock);
    ConnectionTimer *timer = wheel->free_list;
    if (timer != NULL) {
        wheel->free_list = timer->next_free;
    } else if ((timer = malloc(sizeof *timer)) != NULL) {
        timer->wheel = wheel;
        timer->callback = (Callback){timer, timer_wake};
        timer->next = wheel->all;
        wheel->all = timer;
    }
    if (timer != NULL) {
        timer->descriptor = descriptor;
        timer->waiting = NULL;
        timer->is_woken = false;
        timer->wake_ns = timer->limit_ns = timer->idle_ns = INT64_MAX;
    }
    pthread_mutex_unlock(&wheel->lock);
    return timer;
}

void timer_leave(ConnectionTimer *timer) {
    TimerWheel *wheel = timer->wheel;
    pthread_mutex_lock(&wheel->lock);
    timer->descriptor = -1;
    timer->waiting = NULL;
    timer->wake_ns = timer->limit_ns = timer->idle_ns = INT64_MAX;
    timer->next_free = wheel->free_list;
    wheel->free_list = timer;
    pthread_mutex_unlock(&wheel->lock);
}

const Callback *timer_callback(const ConnectionTimer *timer) {
    return &timer->callback;
}

void timer_limit(ConnectionTimer *timer, int64_t max_ms, bool is_idle) {
    const int64_t now_ns = max_ms > 0 ? clock_monotonic_ns() : 0;
    timer->limit_ns = max_ms > 0 ? now_ns + max_ms * 1000000 : INT64_MAX;
    timer->idle_ns = is_idle ? now_ns : INT64_MAX;
    (void)timer_lower_next(timer->wheel, timer->limit_ns);
}

bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t max_ms) {
    TimerWheel *wheel = timer->wheel;
    const int64_t wake_ns = clock_monotonic_ns() + max_ms * 1000000;
    pthread_mutex_lock(&wheel->lock);
    const bool waits = !timer->is_woken && !wheel->is_closing;
    if (waits) {
        // The state first: the resume may come from another thread as soon as the lock is free.
        timer->waiting = connection;
        timer->wake_ns = wake_ns;
        wheel->calls.suspend(connection);
        if (timer_lower_next(wheel, wake_ns))
            wheel->calls.changed(wheel->loop);
    }
    pthread_mutex_unlock(&wheel->lock);
    return waits;
}

bool timer_was_woken(ConnectionTimer *timer) {
    return atomic_exchange(&timer->is_woken, false);
}
