// The event loops' side of libmicrohttpd: connections, and one exchange for each request from its
// first line to its last byte. Internal to http/: server.c starts the loops with these callbacks.
#ifndef SERVER_HTTP_CONNECTION_H
#define SERVER_HTTP_CONNECTION_H

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>

#include "server/http/server.h"
#include "server/jobs/job.h"
#include "server/util/thread_pool.h"

// The time limits and the waits of an event loop's connections. A waiting connection is resumed by
// its callback from any thread, or when its time is up; one that takes too long to send its request
// is shut down. The loop's thread serves the timers; functions without another note are its alone.
typedef struct TimerWheel TimerWheel;
typedef struct ConnectionTimer ConnectionTimer;

typedef struct TimerCallbacks {
    // Called under the wheel's lock; must not call back.
    void (*suspend)(void *connection);
    void (*resume)(void *connection);
    void (*changed)(void *loop); // another thread set a time earlier than all others
} TimerCallbacks;

TimerWheel *timer_wheel_new(const TimerCallbacks *calls, void *loop); // NULL without memory
// Frees all timers: no callback may be called any more. NULL is accepted.
void timer_wheel_free(TimerWheel *wheel);
// Does what is due; returns when to call it again, INT64_MAX: no time is set.
int64_t timer_wheel_run(TimerWheel *wheel, int64_t now_ns);
// Resumes all waiting connections; from now on none waits. From any thread.
void timer_wheel_wake_all(TimerWheel *wheel);
bool timer_wheel_is_closing(TimerWheel *wheel); // from any thread
// Shuts down the connection that has been between two requests for longest, if that is at least
// `min_ms`.
void timer_wheel_close_idle(TimerWheel *wheel, int64_t min_ms);

// A timer for the connection on `descriptor`; NULL without memory. Its memory lives as long as the
// wheel: a callback called too late resumes the timer's next connection, which waits on.
ConnectionTimer *timer_take(TimerWheel *wheel, int descriptor);
// Before the descriptor is closed: after this returns it will not be touched.
void timer_leave(ConnectionTimer *timer);

const Callback *timer_callback(const ConnectionTimer *timer);

// Shuts the socket down if the peer has not done its part within so long; 0: no limit. `is_idle`:
// the connection is between two requests.
void timer_limit(ConnectionTimer *timer, int64_t max_ms, bool is_idle);

// Suspends `connection` unless the callback was called since the last timer_was_woken or wait, or
// the wheel is closing: then false. From any thread.
bool timer_sleep(ConnectionTimer *timer, void *connection, int64_t max_ms);
// Whether the callback was called; forgets it. From any thread.
bool timer_was_woken(ConnectionTimer *timer);

// Belongs to its thread, except the atomic members and the wheel's waits.
typedef struct EventLoop {
    Server *server;
    size_t index;
    struct MHD_Daemon *daemon;
    pthread_t thread;
    int wakeup;           // an eventfd: connections were resumed, a time was set, or it is to stop
    atomic_bool is_woken; // since the loop last looked: another signal is not needed
    TimerWheel *wheel;
    size_t calls;             // of exchange_continue
    struct Exchange *readers; // exchanges whose body is being read
    int64_t readers_checked_ns;
    int64_t accept_ns; // not before
    atomic_bool is_stopping;
    atomic_size_t connections;
} EventLoop;

enum { LOOPS_MAX = 16 };

// What all loops share.
struct Server {
    ServerSettings settings;
    ThreadPool *pool;
    char url[96];
    int descriptor;         // the listening socket
    size_t connections_max; // over all loops
    EventLoop loops[LOOPS_MAX];
    size_t loop_count;
    atomic_size_t acceptor; // the loop that accepts new connections
    atomic_bool is_accepting;
    uint64_t first_id;
    atomic_uint_fast64_t requests;
    atomic_size_t exchanges;  // under way
    atomic_size_t body_bytes; // of bodies in memory
};

extern const TimerCallbacks connection_timer_calls;

// From any thread.
void loop_wake(EventLoop *loop);

// The callbacks; `loop` is an EventLoop.
void connection_notify(void *loop, struct MHD_Connection *connection, void **timer,
                       enum MHD_ConnectionNotificationCode code);
void *exchange_open(void *loop, const char *target, struct MHD_Connection *connection);
enum MHD_Result exchange_continue(void *loop, struct MHD_Connection *connection, const char *url,
                                  const char *method, const char *version, const char *data,
                                  size_t *size, void **exchange);
void exchange_close(void *loop, struct MHD_Connection *connection, void **exchange,
                    enum MHD_RequestTerminationCode code);

// Shuts down connections on which the library waits for ever; see connection.c. Cheap if called
// more often than needed.
void connection_close_stalled(EventLoop *loop, int64_t now_ns);

#endif
