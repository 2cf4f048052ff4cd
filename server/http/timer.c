// A seat:   empty -> taken -> (asleep -> taken)* -> empty
//
// All state but the limits is under the TimerWheel's one lock: each change is a few stores. The
// clock thread sleeps until the earliest time any seat waits for, and is nudged only by an earlier
// one.
#include "server/http/timer.h"

#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>

#include "server/util/clock.h"

struct ConnectionTimer {
    TimerWheel *wheel;
    ConnectionTimer *next; // of all
    ConnectionTimer *next_empty;
    Callback callback;
    int descriptor; // -1: empty
    void *asleep;   // the suspended connection, or NULL
    atomic_bool is_woken;
    int64_t wake_ns;           // INT64_MAX: none
    _Atomic(int64_t) limit_ns; // the same; set without the lock, several times a request
};

struct TimerWheel {
    TimerCallbacks calls;
    pthread_mutex_t lock;
    pthread_cond_t nudge;
    pthread_t clock;
    ConnectionTimer *all, *empty;
    _Atomic(int64_t) next_ns; // when the clock thread wakes; lowered without the lock as well
    atomic_bool is_closing;
    bool is_closed;
};

static void wake_locked(ConnectionTimer *timer) {
    if (timer->asleep == NULL)
        return;
    void *connection = timer->asleep;
    timer->asleep = NULL;
    timer->wake_ns = INT64_MAX;
    timer->wheel->calls.resume(connection);
}

static void wake(void *context) {
    ConnectionTimer *timer = context;
    pthread_mutex_lock(&timer->wheel->lock);
    timer->is_woken = true;
    wake_locked(timer);
    pthread_mutex_unlock(&timer->wheel->lock);
}

// Does what is due and returns when the next thing is.
static int64_t serve_due(TimerWheel *wheel, int64_t now) {
    int64_t next = INT64_MAX;
    for (ConnectionTimer *timer = wheel->all; timer != NULL; timer = timer->next) {
        if (timer->wake_ns <= now)
            wake_locked(timer);
        int64_t limit = atomic_load(&timer->limit_ns);
        if (limit <= now) {
            // timer_leave, which comes before the descriptor is closed, takes the lock.
            shutdown(timer->descriptor, SHUT_RDWR);
            atomic_compare_exchange_strong(&timer->limit_ns, &limit, INT64_MAX);
            limit = INT64_MAX;
        }
        next = timer->wake_ns < next ? timer->wake_ns : next;
        next = limit < next ? limit : next;
    }
    return next;
}

static void *keep_time(void *context) {
    TimerWheel *wheel = context;
    pthread_mutex_lock(&wheel->lock);
    while (!wheel->is_closed) {
        // A limit set while the seats are looked at either is seen there or lowers this again.
        atomic_store(&wheel->next_ns, INT64_MAX);
        const int64_t due = serve_due(wheel, clock_monotonic_ns());
        int64_t next = atomic_load(&wheel->next_ns);
        while (due < next && !atomic_compare_exchange_weak(&wheel->next_ns, &next, due))
            ;
        next = due < next ? due : next;
        if (next == INT64_MAX) {
            pthread_cond_wait(&wheel->nudge, &wheel->lock);
            continue;
        }
        const struct timespec until = {.tv_sec = (time_t)(next / 1000000000),
                                       .tv_nsec = (long)(next % 1000000000)};
        pthread_cond_timedwait(&wheel->nudge, &wheel->lock, &until);
    }
    pthread_mutex_unlock(&wheel->lock);
    return NULL;
}

Status timer_wheel_open(const TimerCallbacks *calls, TimerWheel **wheel, Problem *problem) {
    *wheel = NULL;
    TimerWheel *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the listener");
    made->calls = *calls;
    atomic_init(&made->next_ns, INT64_MAX);
    pthread_condattr_t attributes;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->nudge, &attributes);
    pthread_condattr_destroy(&attributes);
    if (pthread_create(&made->clock, NULL, keep_time, made) != 0) {
        pthread_cond_destroy(&made->nudge);
        pthread_mutex_destroy(&made->lock);
        free(made);
        return problem_set(problem, STATUS_INTERNAL,
                           "the listener's clock thread cannot be started");
    }
    *wheel = made;
    return STATUS_OK;
}

void timer_wheel_wake_all(TimerWheel *wheel) {
    pthread_mutex_lock(&wheel->lock);
    wheel->is_closing = true;
    for (ConnectionTimer *timer = wheel->all; timer != NULL; timer = timer->next)
        wake_locked(timer);
    pthread_mutex_unlock(&wheel->lock);
}

bool timer_wheel_is_closing(TimerWheel *wheel) {
    return atomic_load(&wheel->is_closing);
}

void timer_wheel_close(TimerWheel *wheel) {
    if (wheel == NULL)
        return;
    pthread_mutex_lock(&wheel->lock);
    wheel->is_closed = true;
    pthread_cond_signal(&wheel->nudge);
    pthread_mutex_unlock(&wheel->lock);
    pthread_join(wheel->clock, NULL);
    while (wheel->all != NULL) {
        ConnectionTimer *next = wheel->all->next;
        free(wheel->all);
        wheel->all = next;
    }
    pthread_cond_destroy(&wheel->nudge);
    pthread_mutex_destroy(&wheel->lock);
    free(wheel);
}

ConnectionTimer *timer_take(TimerWheel *wheel, int descriptor) {
    pthread_mutex_lock(&wheel->lock);
    ConnectionTimer *timer = wheel->empty;
    if (timer != NULL) {
        wheel->empty = timer->next_empty;
    } else if ((timer = malloc(sizeof *timer)) != NULL) {
        timer->wheel = wheel;
        timer->callback = (Callback){timer, wake};
        timer->next = wheel->all;
        wheel->all = timer;
    }
    if (timer != NULL) {
        timer->descriptor = descriptor;
        timer->asleep = NULL;
        timer->is_woken = false;
        timer->wake_ns = INT64_MAX;
        atomic_store(&timer->limit_ns, INT64_MAX);
    }
    pthread_mutex_unlock(&wheel->lock);
    return timer;
}

void timer_leave(ConnectionTimer *timer) {
    TimerWheel *wheel = timer->wheel;
    pthread_mutex_lock(&wheel->lock);
    timer->descriptor = -1;
    timer->asleep = NULL;
    timer->wake_ns = INT64_MAX;
    atomic_store(&timer->limit_ns, INT64_MAX);
    timer->next_empty = wheel->empty;
    wheel->empty = timer;
    pthread_mutex_unlock(&wheel->lock);
}

const Callback *timer_callback(const ConnectionTimer *timer) {
    return &timer->callback;
}

// Whether the clock thread has to wake earlier than it means to.
static bool is_earlier(TimerWheel *wheel, int64_t time_ns) {
    int64_t next = atomic_load(&wheel->next_ns);
    while (time_ns < next)
        if (atomic_compare_exchange_weak(&wheel->next_ns, &next, time_ns))
            return true;
    return false;
}

void timer_limit(ConnectionTimer *timer, int64_t most_ms) {
    const int64_t limit_ns = most_ms > 0 ? clock_monotonic_ns() + most_ms * 1000000 : INT64_MAX;
    atomic_store(&timer->limit_ns, limit_ns);
    if (!is_earlier(timer->wheel, limit_ns))
        return;
    // With the lock, so that the signal does not come between the thread's look and its sleep.
    pthread_mutex_lock(&timer->wheel->lock);
    pthread_cond_signal(&timer->wheel->nudge);
    pthread_mutex_unlock(&timer->wheel->lock);
}

void timer_begin(ConnectionTimer *timer) {
    atomic_store(&timer->is_woken, false);
}

bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t most_ms) {
    TimerWheel *wheel = timer->wheel;
    const int64_t wake_ns = clock_monotonic_ns() + most_ms * 1000000;
    pthread_mutex_lock(&wheel->lock);
    const bool sleeps = !timer->is_woken && !wheel->is_closing;
    if (sleeps) {
        // The state first: the resume may come from another thread as soon as the lock is free.
        timer->asleep = connection;
        timer->wake_ns = wake_ns;
        wheel->calls.suspend(connection);
        if (is_earlier(wheel, wake_ns))
            pthread_cond_signal(&wheel->nudge);
    }
    pthread_mutex_unlock(&wheel->lock);
    return sleeps;
}

bool timer_was_woken(ConnectionTimer *timer) {
    return atomic_exchange(&timer->is_woken, false);
}
