// One connection's seat: it can be woken from any thread, waits no longer than asked, and is thrown
// out when it takes too long to send its request. A thread of the Hall's keeps the time. Not HTTP:
// what a connection is, how it is put to sleep and resumed is the listener's. Used by listener.c.
#ifndef SERVER_HTTP_TIMER_H
#define SERVER_HTTP_TIMER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "server/jobs/job.h"

typedef struct Hall Hall;
typedef struct Seat Seat;

typedef struct HallCalls {
    void (*suspend)(void *connection); // called under the Hall's lock; must not call back
    void (*resume)(void *connection);
} HallCalls;

Status hall_open(const HallCalls *calls, Hall **hall, Problem *problem);
// Resumes all who sleep; from now on nobody falls asleep.
void hall_wake_all(Hall *hall);
// Ends the thread and frees all seats: nobody may hold a waker any more.
void hall_close(Hall *hall);

// A seat for the connection on `descriptor`; NULL without memory. Its memory lives as long as the
// Hall, so that a waker called late wakes at worst the next one in the seat, who looks and sleeps
// on.
Seat *seat_take(Hall *hall, int descriptor);
// Before the descriptor is closed: after this returns it will not be touched.
void seat_leave(Seat *seat);

const Waker *seat_waker(const Seat *seat);

// Shuts the socket down if the peer has not done its part within so long; 0 for no limit.
void seat_limit(Seat *seat, int64_t most_ms);

// Forgets earlier calls of the waker: a new request begins.
void seat_begin(Seat *seat);
// Suspends `connection` unless the waker was called since seat_begin or the last sleep, or the Hall
// is closing: then false. In the end it is resumed, by the waker, by time or by hall_wake_all.
bool seat_sleep(Seat *seat, void *connection, int64_t most_ms);
// Whether the waker was called; forgets it.
bool seat_was_woken(Seat *seat);
bool hall_is_closing(Hall *hall);

#endif
