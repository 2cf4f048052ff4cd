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
    TimerWheel *hall;
    ConnectionTimer *next; // of all
    ConnectionTimer *next_empty;
    Callback waker;
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

static void wake_locked(ConnectionTimer *seat) {
    if (seat->asleep == NULL)
        return;
    void *connection = seat->asleep;
    seat->asleep = NULL;
    seat->wake_ns = INT64_MAX;
    seat->hall->calls.resume(connection);
}

static void wake(void *context) {
    ConnectionTimer *seat = context;
    pthread_mutex_lock(&seat->hall->lock);
    seat->is_woken = true;
    wake_locked(seat);
    pthread_mutex_unlock(&seat->hall->lock);
}

// Does what is due and returns when the next thing is.
static int64_t serve_due(TimerWheel *hall, int64_t now) {
    int64_t next = INT64_MAX;
    for (ConnectionTimer *seat = hall->all; seat != NULL; seat = seat->next) {
        if (seat->wake_ns <= now)
            wake_locked(seat);
        int64_t limit = atomic_load(&seat->limit_ns);
        if (limit <= now) {
            // timer_leave, which comes before the descriptor is closed, takes the lock.
            shutdown(seat->descriptor, SHUT_RDWR);
            atomic_compare_exchange_strong(&seat->limit_ns, &limit, INT64_MAX);
            limit = INT64_MAX;
        }
        next = seat->wake_ns < next ? seat->wake_ns : next;
        next = limit < next ? limit : next;
    }
    return next;
}

static void *keep_time(void *context) {
    TimerWheel *hall = context;
    pthread_mutex_lock(&hall->lock);
    while (!hall->is_closed) {
        // A limit set while the seats are looked at either is seen there or lowers this again.
        atomic_store(&hall->next_ns, INT64_MAX);
        const int64_t due = serve_due(hall, clock_monotonic_ns());
        int64_t next = atomic_load(&hall->next_ns);
        while (due < next && !atomic_compare_exchange_weak(&hall->next_ns, &next, due))
            ;
        next = due < next ? due : next;
        if (next == INT64_MAX) {
            pthread_cond_wait(&hall->nudge, &hall->lock);
            continue;
        }
        const struct timespec until = {.tv_sec = (time_t)(next / 1000000000),
                                       .tv_nsec = (long)(next % 1000000000)};
        pthread_cond_timedwait(&hall->nudge, &hall->lock, &until);
    }
    pthread_mutex_unlock(&hall->lock);
    return NULL;
}

Status timer_wheel_open(const TimerCallbacks *calls, TimerWheel **hall, Problem *problem) {
    *hall = NULL;
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
    *hall = made;
    return STATUS_OK;
}

void timer_wheel_wake_all(TimerWheel *hall) {
    pthread_mutex_lock(&hall->lock);
    hall->is_closing = true;
    for (ConnectionTimer *seat = hall->all; seat != NULL; seat = seat->next)
        wake_locked(seat);
    pthread_mutex_unlock(&hall->lock);
}

bool timer_wheel_is_closing(TimerWheel *hall) {
    return atomic_load(&hall->is_closing);
}

void timer_wheel_close(TimerWheel *hall) {
    if (hall == NULL)
        return;
    pthread_mutex_lock(&hall->lock);
    hall->is_closed = true;
    pthread_cond_signal(&hall->nudge);
    pthread_mutex_unlock(&hall->lock);
    pthread_join(hall->clock, NULL);
    while (hall->all != NULL) {
        ConnectionTimer *next = hall->all->next;
        free(hall->all);
        hall->all = next;
    }
    pthread_cond_destroy(&hall->nudge);
    pthread_mutex_destroy(&hall->lock);
    free(hall);
}

ConnectionTimer *timer_take(TimerWheel *hall, int descriptor) {
    pthread_mutex_lock(&hall->lock);
    ConnectionTimer *seat = hall->empty;
    if (seat != NULL) {
        hall->empty = seat->next_empty;
    } else if ((seat = malloc(sizeof *seat)) != NULL) {
        seat->hall = hall;
        seat->waker = (Callback){seat, wake};
        seat->next = hall->all;
        hall->all = seat;
    }
    if (seat != NULL) {
        seat->descriptor = descriptor;
        seat->asleep = NULL;
        seat->is_woken = false;
        seat->wake_ns = INT64_MAX;
        atomic_store(&seat->limit_ns, INT64_MAX);
    }
    pthread_mutex_unlock(&hall->lock);
    return seat;
}

void timer_leave(ConnectionTimer *seat) {
    TimerWheel *hall = seat->hall;
    pthread_mutex_lock(&hall->lock);
    seat->descriptor = -1;
    seat->asleep = NULL;
    seat->wake_ns = INT64_MAX;
    atomic_store(&seat->limit_ns, INT64_MAX);
    seat->next_empty = hall->empty;
    hall->empty = seat;
    pthread_mutex_unlock(&hall->lock);
}

const Callback *timer_callback(const ConnectionTimer *seat) {
    return &seat->waker;
}

// Whether the clock thread has to wake earlier than it means to.
static bool is_earlier(TimerWheel *hall, int64_t time_ns) {
    int64_t next = atomic_load(&hall->next_ns);
    while (time_ns < next)
        if (atomic_compare_exchange_weak(&hall->next_ns, &next, time_ns))
            return true;
    return false;
}

void timer_limit(ConnectionTimer *seat, int64_t most_ms) {
    const int64_t limit_ns = most_ms > 0 ? clock_monotonic_ns() + most_ms * 1000000 : INT64_MAX;
    atomic_store(&seat->limit_ns, limit_ns);
    if (!is_earlier(seat->hall, limit_ns))
        return;
    // With the lock, so that the signal does not come between the thread's look and its sleep.
    pthread_mutex_lock(&seat->hall->lock);
    pthread_cond_signal(&seat->hall->nudge);
    pthread_mutex_unlock(&seat->hall->lock);
}

void timer_begin(ConnectionTimer *seat) {
    atomic_store(&seat->is_woken, false);
}

bool timer_sleep(ConnectionTimer *seat, void *connection, int64_t most_ms) {
    TimerWheel *hall = seat->hall;
    const int64_t wake_ns = clock_monotonic_ns() + most_ms * 1000000;
    pthread_mutex_lock(&hall->lock);
    const bool sleeps = !seat->is_woken && !hall->is_closing;
    if (sleeps) {
        // The state first: the resume may come from another thread as soon as the lock is free.
        seat->asleep = connection;
        seat->wake_ns = wake_ns;
        hall->calls.suspend(connection);
        if (is_earlier(hall, wake_ns))
            pthread_cond_signal(&hall->nudge);
    }
    pthread_mutex_unlock(&hall->lock);
    return sleeps;
}

bool timer_was_woken(ConnectionTimer *seat) {
    return atomic_exchange(&seat->is_woken, false);
}
