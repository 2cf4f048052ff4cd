// Time limits and waits of connections.
#ifndef SERVER_HTTP_TIMER_H
#define SERVER_HTTP_TIMER_H

#include <stdbool.h>
#include <stdint.h>

#include "server/jobs/job.h"

// The time limits and the waits of an event loop's connections. A waiting connection is resumed by
// its callback from any thread, or when its time is up; one that takes too long to send its request
// is shut down. The loop's thread serves the timers; functions without another note are its alone.
typedef struct TimerList TimerList;
typedef struct ConnectionTimer ConnectionTimer;

typedef struct TimerCallbacks {
    // Called under the list's lock; must not call back.
    void (*suspend)(void *connection);
    void (*resume)(void *connection);
    void (*changed)(void *loop); // another thread set a time earlier than all others
} TimerCallbacks;

TimerList *timer_list_new(const TimerCallbacks *calls, void *loop); // NULL without memory
// Frees all timers: no callback may be called any more. NULL is accepted.
void timer_list_free(TimerList *timers);
// Does what is due; returns when to call it again, INT64_MAX: no time is set.
int64_t timer_list_run(TimerList *timers, int64_t now_ns);
// Resumes all waiting connections; from now on none waits. From any thread.
void timer_list_wake_all(TimerList *timers);
bool timer_list_is_closing(TimerList *timers); // from any thread
// Shuts down the connection that has been between two requests for longest, if that is at least
// `min_ms`.
void timer_list_close_idle(TimerList *timers, int64_t min_ms);

// A timer for the connection on `descriptor`; NULL without memory. Its memory lives as long as the
// list: a callback called too late resumes the timer's next connection, which waits on.
ConnectionTimer *timer_take(TimerList *timers, int descriptor);
// Before the descriptor is closed: after this returns it will not be touched.
void timer_leave(ConnectionTimer *timer);

const Callback *timer_callback(const ConnectionTimer *timer);

// Shuts the socket down if the peer has not done its part within so long; 0: no limit. `is_idle`:
// the connection is between two requests.
void timer_limit(ConnectionTimer *timer, int64_t max_ms, bool is_idle);

// Suspends `connection` unless the callback was called since the last timer_was_woken or wait, or
// the list is closing: then false. From any thread.
bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t max_ms);
// Whether the callback was called; forgets it. From any thread.
bool timer_was_woken(ConnectionTimer *timer);

#endif
