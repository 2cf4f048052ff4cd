// One connection's seat: it can be woken from any thread, waits no longer than asked, and is thrown
// out when it takes too long to send its request. A thread of the TimerWheel's keeps the time. Not
// HTTP: what a connection is, how it is put to sleep and resumed is the listener's. Used by
// listener.c.
#ifndef SERVER_HTTP_TIMER_H
#define SERVER_HTTP_TIMER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "server/jobs/job.h"

typedef struct TimerWheel TimerWheel;
typedef struct ConnectionTimer ConnectionTimer;

typedef struct TimerCallbacks {
    void (*suspend)(void *connection); // called under the TimerWheel's lock; must not call back
    void (*resume)(void *connection);
} TimerCallbacks;

Status timer_wheel_open(const TimerCallbacks *calls, TimerWheel **wheel, Problem *problem);
// Resumes all who sleep; from now on nobody falls asleep.
void timer_wheel_wake_all(TimerWheel *wheel);
// Ends the thread and frees all seats: nobody may hold a waker any more.
void timer_wheel_close(TimerWheel *wheel);

// A seat for the connection on `descriptor`; NULL without memory. Its memory lives as long as the
// TimerWheel, so that a waker called late wakes at worst the next one in the seat, who looks and
// sleeps on.
ConnectionTimer *timer_take(TimerWheel *wheel, int descriptor);
// Before the descriptor is closed: after this returns it will not be touched.
void timer_leave(ConnectionTimer *timer);

const Callback *timer_callback(const ConnectionTimer *timer);

// Shuts the socket down if the peer has not done its part within so long; 0 for no limit.
void timer_limit(ConnectionTimer *timer, int64_t most_ms);

// Forgets earlier calls of the waker: a new request begins.
void timer_begin(ConnectionTimer *timer);
// Suspends `connection` unless the waker was called since timer_begin or the last sleep, or the
// TimerWheel is closing: then false. In the end it is resumed, by the waker, by time or by
// timer_wheel_wake_all.
bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t most_ms);
// Whether the waker was called; forgets it.
bool timer_was_woken(ConnectionTimer *timer);
bool timer_wheel_is_closing(TimerWheel *wheel);

#endif
