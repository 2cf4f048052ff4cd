// One request, from its first line to its last byte, as libmicrohttpd's callbacks. Knows no routes
// (dispatch.h) and opens no sockets (listener.h). Used by listener.c, which starts the event loops
// with them.
#ifndef SERVER_HTTP_EXCHANGE_H
#define SERVER_HTTP_EXCHANGE_H

#include <microhttpd.h>
#include <pthread.h>
#include <stdatomic.h>

#include "server/http/eventfd.h"
#include "server/http/response.h"
#include "server/http/server.h"
#include "server/http/timer.h"
#include "server/http/validate.h"
#include "server/util/bytes.h"
#include "server/util/thread_pool.h"

// What all exchanges of a listener share.
typedef struct ServerShared {
    ServerSettings settings;
    TimerWheel *wheel;
    ThreadPool *pool;
    const char *url;
    uint64_t first_id;
    atomic_uint_fast64_t requests;
    atomic_size_t exchanges; // under way
    atomic_size_t held;      // bytes of bodies
} ServerShared;

enum { EXCHANGES_KEPT = 32 };

// An event loop: its daemon and its thread alone, but for what is locked.
typedef struct EventLoop {
    ServerShared *shared;
    struct MHD_Daemon *daemon;
    pthread_t thread;
    EventFd wakeup; // there are arrivals, or connections to go on with, or it is to stop
    size_t turns;   // calls of exchange_go_on
    size_t reading; // exchanges whose body is still to come
    pthread_mutex_t lock;
    int *arrivals; // descriptors, locked
    size_t arrival_count, arrival_room;
    atomic_bool is_stopping;
    atomic_size_t connections; // with the arrivals
    SharedResponse shared_response[SENT_AGAIN];
    struct Exchange *free_list[EXCHANGES_KEPT];
    size_t spare_count;
} EventLoop;

typedef struct Exchange {
    WorkItem task; // in the pool
    EventLoop *loop;
    ServerShared *shared;
    struct MHD_Connection *connection;
    ConnectionTimer *timer;
    Request request;
    RequestValidator validator;
    Bytes body;
    size_t received;
    char *target;
    Reply reply; // once it is answered in the pool
    void (*forget)(void *kept);
    bool is_begun, is_reading, is_counted, is_busy;
    bool is_asleep;   // the handler asked to wait
    bool is_in_pool;  // it is answered there, its connection suspended
    bool is_answered; // there, or before its body was read, with `reply`
} Exchange;

// For timer_wheel_open.
extern const TimerCallbacks exchange_calls;

// The callbacks; `loop` is a EventLoop.
void exchange_connection(void *loop, struct MHD_Connection *connection, void **timer,
                         enum MHD_ConnectionNotificationCode code);
void *exchange_open(void *loop, const char *target, struct MHD_Connection *connection);
enum MHD_Result exchange_go_on(void *loop, struct MHD_Connection *connection, const char *url,
                               const char *method, const char *version, const char *data,
                               size_t *size, void **exchange);
void exchange_close(void *loop, struct MHD_Connection *connection, void **exchange,
                    enum MHD_RequestTerminationCode code);
// Frees what the loop kept for the next requests.
void exchange_forget(EventLoop *loop);

#endif
