// The event loops' side of libmicrohttpd: connections, and one exchange for each request from its
// first line to its last byte. Internal to http/: event_loop.c starts the loops with these
// callbacks.
#ifndef SERVER_HTTP_CONNECTION_H
#define SERVER_HTTP_CONNECTION_H

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>

#include "server/http/server.h"
#include "server/http/timer.h"
#include "server/util/thread_pool.h"

// Belongs to its thread, except the atomic members and the timers' waits.
typedef struct EventLoop {
    Server *server;
    size_t index;
    struct MHD_Daemon *daemon;
    pthread_t thread;
    int wakeup;           // an eventfd: connections were resumed, a time was set, or it is to stop
    atomic_bool is_woken; // since the loop last looked: another signal is not needed
    TimerList *timers;
    size_t calls;             // of exchange_continue
    struct Exchange *readers; // exchanges whose body is being read
    int64_t readers_checked_ns;
    int64_t accept_ns; // not before
    atomic_bool is_stopping;
    atomic_size_t connections;
} EventLoop;

enum {
    LOOPS_MAX = 16,
    CONNECTION_MEMORY = 16 * 1024, // bytes of the library for each connection: the longest head
};

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
