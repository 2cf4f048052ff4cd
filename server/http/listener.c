// One Exchange per request, from its first line to its last byte:
//
//   request line -> head: the gate -> body: collected up to its cap -> answer, which may sleep and
//   go on -> sent
//
// A pool thread is held while a job's row is made durable, so there are many, for commits to be
// shared. Each serves far fewer than 120 connections: libmicrohttpd 0.9.75 stalls when a multiple
// of 128 are ready at once. A reply queued before the body is read closes the connection, which is
// what refusals want. What the library answers by itself (a head over its memory, a line that is no
// HTTP, a Content-Length past 2^64) is no problem document, and a NUL in a header's value is cut
// before we see it.
#include "server/http/listener.h"

#include <errno.h>
#include <microhttpd.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>
#include <unistd.h>

#include "server/base/clock.h"
#include "server/codec/write.h"
#include "server/http/body.h"
#include "server/http/gate.h"
#include "server/http/reply.h"
#include "server/http/seat.h"

enum {
    THREADS = 32,
    CONNECTIONS = THREADS * 32,
    CONNECTION_MEMORY = 32 * 1024,
    IDLE_MS = 60000, // from the connection or the last reply to the next request line
    HEAD_MS = 10000, // from there to the end of the head
    BODY_MS = 60000,
    DRAINED = 4, // times the body's limit is read and thrown away, so that the client sees the 413
    BODIES_HELD = 16, // times the body's limit may be in memory over all connections
};

struct Listener {
    ListenerSettings settings;
    struct MHD_Daemon *daemon;
    Hall *hall;
    char url[96];
    uint64_t first_id;
    atomic_uint_fast64_t requests;
    atomic_size_t exchanges; // under way
    atomic_size_t held;      // bytes of bodies
};

typedef struct Exchange {
    Listener *listener;
    Seat *seat;
    Request request;
    Gate gate;
    Bytes body;
    size_t received;
    char *target;
    void (*forget)(void *kept);
    bool is_begun, is_counted, sleeps, is_busy;
} Exchange;

static void add_header(struct MHD_Response *response, const char *name, const char *value) {
    if (value != NULL && value[0] != '\0')
        MHD_add_response_header(response, name, value);
}

// What a streamed body needs while it is sent.
typedef struct Sending {
    Exchange *exchange;
    struct MHD_Connection *connection;
    Stream stream;
    void (*release)(void *context);
    void *context;
} Sending;

static ssize_t send_next(void *context, uint64_t position, char *target, size_t size) {
    (void)position;
    Sending *sending = context;
    for (;;) {
        // Forgotten before looking: whoever wakes it from here on has it look again.
        (void)seat_was_woken(sending->exchange->seat);
        const ptrdiff_t count = sending->stream.next(sending->context, target, size);
        if (count == STREAM_END)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (count != STREAM_WAIT)
            return count;
        if (hall_is_closing(sending->exchange->listener->hall))
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (seat_sleep(sending->exchange->seat, sending->connection, sending->stream.wait_ms))
            return 0;
    }
}

static void sending_free(void *context) {
    Sending *sending = context;
    if (sending->release != NULL)
        sending->release(sending->context);
    free(sending);
}

static struct MHD_Response *stream_response(Exchange *exchange, struct MHD_Connection *connection,
                                            const Reply *reply) {
    enum { PIECE = 64 * 1024 };
    Sending *sending = malloc(sizeof *sending);
    if (sending == NULL)
        return NULL;
    *sending = (Sending){exchange, connection, reply->stream, reply->release, reply->context};
    struct MHD_Response *response = MHD_create_response_from_callback(
        reply->stream.size == UINT64_MAX ? MHD_SIZE_UNKNOWN : reply->stream.size, PIECE, send_next,
        sending, sending_free);
    if (response == NULL)
        free(sending);
    return response;
}

static enum MHD_Result send_reply(Exchange *exchange, struct MHD_Connection *connection,
                                  Reply *reply, bool closes) {
    struct MHD_Response *response =
        reply->stream.next != NULL ? stream_response(exchange, connection, reply)
        : reply->release != NULL
            ? MHD_create_response_from_buffer_with_free_callback_cls(
                  reply->body_size, (void *)(uintptr_t)reply->body, reply->release, reply->context)
            : MHD_create_response_from_buffer(reply->body_size, (void *)(uintptr_t)reply->body,
                                              MHD_RESPMEM_PERSISTENT);
    if (response == NULL) {
        reply_clear(reply);
        return MHD_NO;
    }
    char retry_after[16] = "";
    if (reply->retry_after >= 0)
        snprintf(retry_after, sizeof retry_after, "%d", reply->retry_after);
    add_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type);
    add_header(response, MHD_HTTP_HEADER_LOCATION, reply->location);
    add_header(response, MHD_HTTP_HEADER_ETAG, reply->etag);
    add_header(response, MHD_HTTP_HEADER_CACHE_CONTROL,
               reply->cache_control[0] != '\0' ? reply->cache_control : "no-store");
    add_header(response, MHD_HTTP_HEADER_LINK, reply->link);
    add_header(response, "Idempotency-Replayed", reply->is_replayed ? "true" : NULL);
    add_header(response, "Preference-Applied", reply->preference_applied);
    add_header(response, MHD_HTTP_HEADER_ALLOW, reply->allow);
    add_header(response, MHD_HTTP_HEADER_CONTENT_RANGE, reply->content_range);
    add_header(response, MHD_HTTP_HEADER_RETRY_AFTER, retry_after);
    add_header(response, MHD_HTTP_HEADER_ACCEPT_RANGES, reply->accepts_ranges ? "bytes" : NULL);
    add_header(response, MHD_HTTP_HEADER_VARY, reply->varies_by_accept ? "Accept" : NULL);
    add_header(response, "X-Request-Id", exchange->request.id);
    add_header(response, "X-Content-Type-Options", "nosniff");
    add_header(response, "Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
    if (closes || hall_is_closing(exchange->listener->hall))
        add_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
    if (reply->code >= 500 && reply->code != 501 && reply->code != 503 && reply->code != 505)
        fprintf(stderr, "impactd: request %s answered %d: %s %.200s\n", exchange->request.id,
                reply->code, exchange->request.method, exchange->request.path);
    const enum MHD_Result result = MHD_queue_response(connection, (unsigned)reply->code, response);
    MHD_destroy_response(response);
    return result;
}

static enum MHD_Result send_problem(Exchange *exchange, struct MHD_Connection *connection, int code,
                                    const Problem *problem, bool closes) {
    Reply reply;
    reply_default(&reply);
    body_problem(&reply, problem, code, NULL);
    return send_reply(exchange, connection, &reply, closes);
}

static enum MHD_Result take_header(void *context, enum MHD_ValueKind kind, const char *name,
                                   size_t name_size, const char *value, size_t value_size) {
    (void)kind;
    Exchange *exchange = context;
    gate_header(&exchange->gate, name, name_size, value, value_size);
    if (value != NULL)
        request_header(&exchange->request, name, value);
    return MHD_YES;
}

// The head is complete: judge it, and refuse at once what cannot be read to its end.
static enum MHD_Result begin(Exchange *exchange, struct MHD_Connection *connection,
                             const char *method, const char *version) {
    Listener *listener = exchange->listener;
    Request *request = &exchange->request;
    exchange->is_begun = true;
    request->method = method;
    request->path = request->target = exchange->target;
    const uint64_t number = listener->first_id + atomic_fetch_add(&listener->requests, 1);
    snprintf(request->id, sizeof request->id, "q-%012llx",
             (unsigned long long)(number & 0xffffffffffff));
    request->started_ns = clock_monotonic_ns();
    request->waker = seat_waker(exchange->seat);
    request->body_most = listener->settings.body_most;
    MHD_get_connection_values_n(connection, MHD_HEADER_KIND, take_header, exchange);

    if (request->host == NULL)
        request->host = listener->url + strlen("http://");

    Problem problem;
    problem_clear(&problem);
    int code = gate_judge(&exchange->gate, method, exchange->target, version, &problem);
    if (code == 0 && request_open(request, exchange->target, &problem) != STATUS_OK)
        code = write_problem_code(problem.status);
    const char *length = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Content-Length");
    const unsigned long long body_size = length != NULL ? strtoull(length, NULL, 10) : 0;
    const size_t most = request->body_most;
    const bool waits_for_leave =
        request->expect != NULL && strcasecmp(request->expect, "100-continue") == 0;
    if (code == 0 && request->expect != NULL && !waits_for_leave) {
        code = 417;
        problem_set(&problem, STATUS_USAGE, "the only expectation understood is 100-continue");
    }
    if (code == 0 && body_size > (waits_for_leave ? most : DRAINED * most)) {
        code = 413;
        problem_set(&problem, STATUS_TOO_LARGE, "the body is larger than %zu bytes", most);
    }
    if (code != 0)
        return send_problem(exchange, connection, code, &problem, true);
    if (strcmp(method, "HEAD") == 0) {
        request->method = "GET";
        request->range = NULL;
    }
    exchange->body.most = most;
    seat_limit(exchange->seat, body_size > 0 || exchange->gate.is_chunked ? BODY_MS : 0);
    return MHD_YES;
}

static void drop_body(Exchange *exchange) {
    if (exchange->is_counted)
        atomic_fetch_sub(&exchange->listener->held, exchange->body.count);
    exchange->is_counted = false;
    bytes_clear(&exchange->body);
}

static enum MHD_Result take_body(Exchange *exchange, const char *data, size_t size) {
    Listener *listener = exchange->listener;
    const size_t most = listener->settings.body_most;
    exchange->received += size;
    if (exchange->received > DRAINED * most)
        return MHD_NO;
    if (exchange->request.is_too_large || exchange->is_busy ||
        strcmp(exchange->request.method, "POST") != 0)
        return MHD_YES;
    exchange->request.is_too_large = exchange->received > most;
    if (!exchange->request.is_too_large) {
        exchange->is_counted = true;
        exchange->is_busy = atomic_fetch_add(&listener->held, size) + size > BODIES_HELD * most;
        bytes_put(&exchange->body, data, size);
        if (exchange->body.is_failed) {
            atomic_fetch_sub(&listener->held, exchange->received);
            exchange->is_counted = false;
            exchange->is_busy = true;
        }
    }
    if (exchange->request.is_too_large || exchange->is_busy)
        drop_body(exchange);
    return MHD_YES;
}

static enum MHD_Result answer(Exchange *exchange, struct MHD_Connection *connection) {
    Listener *listener = exchange->listener;
    Request *request = &exchange->request;
    if (exchange->is_busy) {
        Problem problem;
        problem_clear(&problem);
        problem_set(&problem, STATUS_BUSY, "too many large bodies at once");
        return send_problem(exchange, connection, 0, &problem, false);
    }
    const bool is_again = exchange->sleeps;
    if (!is_again) {
        seat_limit(exchange->seat, 0);
        seat_begin(exchange->seat);
        request->body = exchange->body.at;
        request->body_size = exchange->body.count;
    }
    request->is_woken = is_again && seat_was_woken(exchange->seat);
    request->is_expired = is_again && !request->is_woken;
    for (;;) {
        Reply reply;
        reply_default(&reply);
        listener->settings.answer(listener->settings.context, request, &reply);
        drop_body(exchange);
        request->body = NULL;
        request->body_size = 0;
        request->kept = reply.keep;
        exchange->forget = reply.forget;
        exchange->sleeps = reply.wait_ms > 0;
        if (!exchange->sleeps)
            return send_reply(exchange, connection, &reply, false);
        if (seat_sleep(exchange->seat, connection, reply.wait_ms))
            return MHD_YES;
        request->is_woken = seat_was_woken(exchange->seat);
        request->is_expired = !request->is_woken;
    }
}

static Seat *seat_of(struct MHD_Connection *connection) {
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info != NULL ? info->socket_context : NULL;
}

static void on_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                          enum MHD_ConnectionNotificationCode code) {
    Listener *listener = context;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        Seat *seat = info != NULL ? seat_take(listener->hall, info->connect_fd) : NULL;
        *socket_context = seat;
        if (seat != NULL)
            seat_limit(seat, IDLE_MS);
    } else if (*socket_context != NULL) {
        seat_leave(*socket_context);
        *socket_context = NULL;
    }
}

// The request line is in; `target` is as sent.
static void *on_target(void *context, const char *target, struct MHD_Connection *connection) {
    Listener *listener = context;
    Seat *seat = seat_of(connection);
    Exchange *exchange = seat != NULL ? calloc(1, sizeof *exchange) : NULL;
    if (exchange == NULL)
        return NULL;
    exchange->target = strdup(target);
    if (exchange->target == NULL) {
        free(exchange);
        return NULL;
    }
    exchange->listener = listener;
    exchange->seat = seat;
    atomic_fetch_add(&listener->exchanges, 1);
    seat_limit(seat, HEAD_MS);
    return exchange;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *url,
                                  const char *method, const char *version, const char *data,
                                  size_t *size, void **state) {
    (void)context, (void)url; // the url is decoded and cut at a NUL; the target is what counts
    Exchange *exchange = *state;
    if (exchange == NULL)
        return MHD_NO;
    if (!exchange->is_begun)
        return begin(exchange, connection, method, version);
    if (*size > 0) {
        const size_t taken = *size;
        *size = 0;
        return take_body(exchange, data, taken);
    }
    return answer(exchange, connection);
}

static void on_completed(void *context, struct MHD_Connection *connection, void **state,
                         enum MHD_RequestTerminationCode code) {
    (void)connection, (void)code;
    Listener *listener = context;
    Exchange *exchange = *state;
    if (exchange == NULL)
        return;
    *state = NULL;
    if (exchange->forget != NULL)
        exchange->forget(exchange->request.kept);
    drop_body(exchange);
    request_close(&exchange->request);
    seat_limit(exchange->seat, IDLE_MS);
    free(exchange->target);
    free(exchange);
    atomic_fetch_sub(&listener->exchanges, 1);
}

static void suspend(void *connection) {
    MHD_suspend_connection(connection);
}

static void resume(void *connection) {
    MHD_resume_connection(connection);
}

Status listener_open(const ListenerSettings *settings, Listener **listener, Problem *problem) {
    *listener = NULL;
    Listener *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the listener");
    made->settings = *settings;
    made->first_id = (uint64_t)clock_unix_ms() << 16;
    int descriptor = -1;
    const HallCalls calls = {suspend, resume};
    Status status = hall_open(&calls, &made->hall, problem);
    if (status == STATUS_OK)
        status = address_open(&made->settings.address, &descriptor, problem);
    if (status == STATUS_OK) {
        address_url(&made->settings.address, made->url);
        made->daemon = MHD_start_daemon(
            MHD_USE_EPOLL_INTERNAL_THREAD | MHD_USE_TURBO | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ITC,
            0, NULL, NULL, on_request, made, MHD_OPTION_LISTEN_SOCKET, descriptor,
            MHD_OPTION_THREAD_POOL_SIZE, (unsigned)THREADS, MHD_OPTION_CONNECTION_LIMIT,
            (unsigned)CONNECTIONS, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY,
            MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)(IDLE_MS / 1000), MHD_OPTION_STRICT_FOR_CLIENT,
            0, MHD_OPTION_URI_LOG_CALLBACK, on_target, made, MHD_OPTION_NOTIFY_CONNECTION,
            on_connection, made, MHD_OPTION_NOTIFY_COMPLETED, on_completed, made, MHD_OPTION_END);
        if (made->daemon == NULL) {
            status = problem_set(problem, STATUS_INTERNAL, "the HTTP library cannot start: %s",
                                 strerror(errno));
            close(descriptor);
        }
    }
    if (status != STATUS_OK) {
        listener_free(made);
        return status;
    }
    *listener = made;
    return STATUS_OK;
}

const char *listener_url(const Listener *listener) {
    return listener->url;
}

void listener_stop(Listener *listener, int grace_ms) {
    if (listener == NULL || listener->daemon == NULL)
        return;
    const MHD_socket descriptor = MHD_quiesce_daemon(listener->daemon);
    hall_wake_all(listener->hall);
    const int64_t until = clock_monotonic_ns() + (int64_t)grace_ms * 1000000;
    const struct timespec pause = {.tv_nsec = 5000000};
    while (atomic_load(&listener->exchanges) > 0 && clock_monotonic_ns() < until)
        nanosleep(&pause, NULL);
    MHD_stop_daemon(listener->daemon);
    listener->daemon = NULL;
    close(descriptor); // MHD_INVALID_SOCKET is -1: no harm
}

void listener_free(Listener *listener) {
    if (listener == NULL)
        return;
    listener_stop(listener, 0);
    hall_close(listener->hall);
    free(listener);
}
