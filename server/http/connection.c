// request line -> head: validated, routed, authorized -> body: collected up to its limit ->
// answered -> sent
//
// What can be answered at once is answered on the event loop. Other requests go to the thread pool,
// their connection suspended meanwhile. A handler that asks to wait is called again where it was
// called first. A reply queued before the body is read closes the connection, and the client, still
// sending, may never see it: a refusal waits for the body, which is discarded, unless its end is
// uncertain, it is too long, or the client waits for permission to send it. What the library
// answers by itself (a head larger than its memory, a line that is no HTTP, a Content-Length above
// 2^64) is no problem document, and a NUL in a header's value is cut before we see it.
#include "server/http/connection.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/util/clock.h"

enum {
    IDLE_MS = 60000, // from the last reply to the next request line
    HEAD_MS = 10000, // from the connection to its first request line, from any to the head's end
    BODY_MS = 60000,
    DRAINED = 4,      // times the body's limit is read and discarded, so that a refusal is seen
    BODIES_HELD = 16, // times the body's limit may be in memory over all connections
    BODY_SMALL = 16 * 1024, // is taken in any case: large bodies keep no small one out
    LOOP_BYTES = 64 * 1024, // of a body that a handler may read on the event loop
};

typedef struct Exchange {
    WorkItem work; // in the pool
    EventLoop *loop;
    Server *server;
    struct MHD_Connection *connection;
    ConnectionTimer *timer;
    struct Exchange *next_reader, **reader_link; // in the loop's list while the body is read
    Request request;
    Bytes body;
    size_t received, checked_received;
    int stalled_checks;
    char *target;
    const char *head_at; // behind the value of the last header seen, in the library's buffer
    Reply reply;         // once it is answered in the pool or before its body was read
    void (*forget)(void *kept);
    bool is_begun, is_counted, is_busy;
    bool is_head;     // GET without the body
    bool is_in_pool;  // it is answered there, its connection suspended
    bool is_answered; // with `reply`
} Exchange;

// What a streamed body needs while it is sent.
typedef struct Sending {
    Exchange *exchange;
    int64_t admitted_ns; // when its client was last checked
    Stream stream;
    void (*release)(void *context);
    void *context;
} Sending;

void loop_wake(EventLoop *loop) {
    const uint64_t one = 1;
    if (!atomic_exchange(&loop->is_woken, true))
        (void)!write(loop->wakeup, &one, sizeof one);
}

// A body that takes long may outlive its client's token.
static bool sending_is_admitted(Sending *sending) {
    enum { CHECK_MS = 500 };
    const int64_t now_ns = clock_monotonic_ns();
    if (now_ns - sending->admitted_ns < CHECK_MS * 1000000LL)
        return true;
    sending->admitted_ns = now_ns;
    return router_still_admits(sending->exchange->server->settings.router,
                               &sending->exchange->request);
}

static ssize_t sending_next(void *context, uint64_t position, char *target, size_t size) {
    (void)position;
    Sending *sending = context;
    Exchange *exchange = sending->exchange;
    for (;;) {
        // Cut off, so that it does not look complete.
        if (!sending_is_admitted(sending))
            return MHD_CONTENT_READER_END_WITH_ERROR;
        // Before the stream is asked: a call of the callback from here on has it asked again.
        (void)timer_was_woken(exchange->timer);
        const ptrdiff_t count = sending->stream.next(sending->context, target, size);
        if (count == STREAM_END)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (count == STREAM_BROKEN)
            return MHD_CONTENT_READER_END_WITH_ERROR;
        if (count != STREAM_WAIT)
            return count;
        if (timer_list_is_closing(exchange->loop->timers))
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (timer_sleep(exchange->timer, exchange, sending->stream.wait_ms))
            return 0;
    }
}

static void sending_free(void *context) {
    Sending *sending = context;
    if (sending->release != NULL)
        sending->release(sending->context);
    free(sending);
}

static struct MHD_Response *response_of_stream(Exchange *exchange, const Reply *reply) {
    enum { PIECE = 64 * 1024 };
    Sending *sending = malloc(sizeof *sending);
    if (sending == NULL)
        return NULL;
    *sending =
        (Sending){exchange, clock_monotonic_ns(), reply->stream, reply->release, reply->context};
    struct MHD_Response *response = MHD_create_response_from_callback(
        reply->stream.size == UINT64_MAX ? MHD_SIZE_UNKNOWN : reply->stream.size, PIECE,
        sending_next, sending, sending_free);
    if (response == NULL)
        free(sending);
    // After the head of a chunked answer to HEAD the library would send the last chunk.
    else if (exchange->is_head && reply->stream.size == UINT64_MAX)
        MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
    return response;
}

// Without memory for a header there is no response: a body without its encoding or its policy is
// another one.
static void response_add(struct MHD_Response **response, const char *name, const char *value) {
    if (*response == NULL || value == NULL || value[0] == '\0' ||
        MHD_add_response_header(*response, name, value) == MHD_YES)
        return;
    MHD_destroy_response(*response);
    *response = NULL;
}

static const char *response_vary(const Reply *reply, bool has_origins, char text[48]) {
    text[0] = '\0';
    if (reply->varies_by_accept)
        text_list(text, 48, "Accept");
    if (reply->varies_by_encoding)
        text_list(text, 48, "Accept-Encoding");
    if (has_origins)
        text_list(text, 48, "Origin");
    return text;
}

// All headers but those of one request alone.
static void response_add_all(struct MHD_Response **response, const Reply *reply,
                             const ServerSettings *settings) {
    char varies[48];
    const bool is_events =
        reply->content_type != NULL && strcmp(reply->content_type, "text/event-stream") == 0;
    char retry_after[16] = "";
    if (reply->retry_after >= 0)
        snprintf(retry_after, sizeof retry_after, "%d", reply->retry_after);
    response_add(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type);
    response_add(response, MHD_HTTP_HEADER_CONTENT_ENCODING, reply->content_encoding);
    response_add(response, MHD_HTTP_HEADER_LOCATION, reply->location);
    response_add(response, MHD_HTTP_HEADER_ETAG, reply->etag);
    response_add(response, MHD_HTTP_HEADER_CACHE_CONTROL,
                 reply->cache_control[0] != '\0' ? reply->cache_control : "no-store");
    response_add(response, MHD_HTTP_HEADER_LINK, reply->link);
    response_add(response, "Idempotency-Replayed", reply->is_replayed ? "true" : NULL);
    response_add(response, "Preference-Applied", reply->preference_applied);
    response_add(response, MHD_HTTP_HEADER_ALLOW, reply->allow);
    response_add(response, MHD_HTTP_HEADER_CONTENT_RANGE, reply->content_range);
    response_add(response, MHD_HTTP_HEADER_RETRY_AFTER, retry_after);
    // A proxy that buffers an answer would delay events.
    response_add(response, "X-Accel-Buffering", is_events ? "no" : NULL);
    response_add(response, MHD_HTTP_HEADER_ACCEPT_RANGES, reply->accepts_ranges ? "bytes" : NULL);
    response_add(response, MHD_HTTP_HEADER_VARY,
                 response_vary(reply, settings->hosts->origins != NULL, varies));
    response_add(response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, reply->authenticate);
    response_add(response, "Content-Security-Policy",
                 reply->policy != NULL ? reply->policy : reply_policy);
    response_add(response, "X-Content-Type-Options", "nosniff");
    response_add(response, "Referrer-Policy", "no-referrer");
    response_add(response, "Cross-Origin-Resource-Policy", "same-origin");
    response_add(response, "Strict-Transport-Security",
                 settings->certificate != NULL ? "max-age=31536000" : NULL);
}

// `methods`: the answer to a preflight; else NULL.
static void response_add_cors(struct MHD_Response **response, const char *origin,
                              const char *methods) {
    if (origin == NULL)
        return;
    response_add(response, "Access-Control-Allow-Origin", origin);
    if (methods == NULL) {
        response_add(response, "Access-Control-Expose-Headers",
                     "ETag, Location, Link, Retry-After");
        return;
    }
    response_add(response, "Access-Control-Allow-Methods", methods);
    response_add(response, "Access-Control-Allow-Headers",
                 "Authorization, Content-Type, Idempotency-Key, If-Match, If-None-Match, "
                 "Last-Event-ID, Prefer, Range, X-Request-Id");
    response_add(response, "Access-Control-Max-Age", "600");
}

// Takes what `reply` owns, also when it fails.
static struct MHD_Response *response_new(Exchange *exchange, Reply *reply) {
    struct MHD_Response *response =
        reply->stream.next != NULL ? response_of_stream(exchange, reply)
        : reply->release != NULL
            ? MHD_create_response_from_buffer_with_free_callback_cls(
                  reply->body_size, (void *)(uintptr_t)reply->body, reply->release, reply->context)
            : MHD_create_response_from_buffer(reply->body_size, (void *)(uintptr_t)reply->body,
                                              MHD_RESPMEM_PERSISTENT);
    if (response == NULL)
        reply_clear(reply);
    else
        response_add_all(&response, reply, &exchange->server->settings);
    return response;
}

// Takes what `reply` owns.
static enum MHD_Result response_queue(Exchange *exchange, Reply *reply, bool closes) {
    const Request *request = &exchange->request;
    const int code = reply->code;
    closes = closes || timer_list_is_closing(exchange->loop->timers);
    struct MHD_Response *response = response_new(exchange, reply);
    response_add(&response, "X-Request-Id", request->id);
    response_add_cors(&response, request->allow_origin, reply->is_preflight ? reply->allow : NULL);
    response_add(&response, MHD_HTTP_HEADER_CONNECTION, closes ? "close" : NULL);
    if (response == NULL)
        return MHD_NO;
    const enum MHD_Result result =
        MHD_queue_response(exchange->connection, (unsigned)code, response);
    MHD_destroy_response(response);
    return result;
}

static void exchange_problem(Exchange *exchange, int code, const Problem *problem, Reply *reply) {
    reply_default(reply);
    reply_problem(reply, problem, code, NULL, exchange->request.id);
    access_record(exchange->server->settings.router->access, &exchange->request, reply);
}

// The library parses a head where it was received, and says nothing of lines that it drops: headers
// continued on a second line, and what follows a header without a name. Something else than blanks
// and line ends between two headers is such a line.
static void exchange_check_gap(Exchange *exchange, const char *next) {
    const char *at = exchange->head_at;
    if (next < at || next - at > CONNECTION_MEMORY) {
        exchange->request.has_hidden_lines = true;
        return;
    }
    while (at < next && (*at == '\0' || *at == '\r' || *at == '\n' || *at == ' ' || *at == '\t'))
        at++;
    exchange->request.has_hidden_lines |= at < next;
}

static enum MHD_Result exchange_add_header(void *context, enum MHD_ValueKind kind, const char *name,
                                           size_t name_size, const char *value, size_t value_size) {
    (void)kind;
    Exchange *exchange = context;
    exchange_check_gap(exchange, name);
    exchange->head_at = value != NULL ? value + value_size : name + name_size;
    request_header(&exchange->request, name, name_size, value, value_size);
    return MHD_YES;
}

static void exchange_write_id(char id[REQUEST_ID_SIZE], uint64_t number) {
    memcpy(id, "q-", 2);
    for (size_t i = 13; i >= 2; i--, number >>= 4)
        id[i] = "0123456789abcdef"[number & 15];
    id[14] = '\0';
}

static void exchange_begin_body(Exchange *exchange, bool has_body) {
    timer_limit(exchange->timer, has_body ? BODY_MS : 0, false);
    if (!has_body)
        return;
    Exchange **first = &exchange->loop->readers;
    exchange->next_reader = *first;
    exchange->reader_link = first;
    if (*first != NULL)
        (*first)->reader_link = &exchange->next_reader;
    *first = exchange;
}

static void exchange_end_body(Exchange *exchange) {
    if (exchange->reader_link == NULL)
        return;
    *exchange->reader_link = exchange->next_reader;
    if (exchange->next_reader != NULL)
        exchange->next_reader->reader_link = exchange->reader_link;
    exchange->reader_link = NULL;
}

// Takes the refusal; sent now or, with `drains`, once the body has been discarded.
static enum MHD_Result exchange_refuse(Exchange *exchange, Reply *refusal, bool drains) {
    if (!drains)
        return response_queue(exchange, refusal, true);
    exchange->reply = *refusal;
    exchange->is_answered = true;
    exchange_begin_body(exchange, true);
    return MHD_YES;
}

// The head is complete: validate and route it, and refuse at once what cannot be read to its end.
static enum MHD_Result exchange_begin(Exchange *exchange, struct MHD_Connection *connection,
                                      const char *method, const char *version) {
    Server *server = exchange->server;
    Request *request = &exchange->request;
    exchange->is_begun = true;
    exchange->connection = connection;
    request->method = method;
    request->path = request->target = exchange->target;
    request->started_ns = clock_monotonic_ns();
    request->callback = timer_callback(exchange->timer);
    request->body_most = server->settings.body_most;
    const AcceptedHosts *hosts = server->settings.hosts;
    exchange->head_at = version + strlen(version);
    MHD_get_connection_values_n(connection, MHD_HEADER_KIND, exchange_add_header, exchange);
    const union MHD_ConnectionInfo *head =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    if (head != NULL) {
        exchange_check_gap(exchange, method + head->header_size);
        // A line ":" ends the head, and looks like two line ends with a blank before them.
        if (method + head->header_size - exchange->head_at > 4)
            request->has_hidden_lines = true;
    }
    request->allow_origin = request_allowed_origin(request, hosts);
    if (request->id[0] == '\0')
        exchange_write_id(request->id, server->first_id + atomic_fetch_add(&server->requests, 1));
    Problem problem;
    problem_clear(&problem);
    int code = request_validate(request, hosts, exchange->target, version, &problem);
    if (request->host == NULL)
        request->host = strstr(server->url, "://") + 3;
    const bool is_framed = code == 0; // it is certain where the body ends
    if (code == 0 && request_open(request, exchange->target, &problem) != STATUS_OK)
        code = encode_problem_code(problem.status);
    const uint64_t body_size = request->length;
    const size_t most = request->body_most;
    const bool waits_for_leave =
        request->expect != NULL && strcasecmp(request->expect, "100-continue") == 0;
    if (code == 0 && request->expect != NULL && !waits_for_leave) {
        code = 417;
        problem_set(&problem, STATUS_USAGE, "the only expectation understood is 100-continue");
    }
    if (code == 0 && body_size > (waits_for_leave ? most : DRAINED * most)) {
        code = 413;
        request_error_large(most, &problem);
    }
    const bool has_body = body_size > 0 || request->is_chunked;
    const bool drains =
        is_framed && has_body && request->expect == NULL && body_size <= DRAINED * most;
    Reply reply;
    if (code != 0) {
        exchange_problem(exchange, code, &problem, &reply);
        return exchange_refuse(exchange, &reply, drains);
    }
    exchange->is_head = strcmp(method, "HEAD") == 0;
    if (exchange->is_head) {
        request->method = "GET";
        request->range = NULL;
    }
    reply_default(&reply);
    exchange->is_answered = !router_admit(server->settings.router, request, &reply);
    if (exchange->is_answered && has_body)
        return exchange_refuse(exchange, &reply, drains);
    if (exchange->is_answered)
        exchange->reply = reply;
    exchange->body.most = most;
    exchange_begin_body(exchange, has_body);
    return MHD_YES;
}

static void exchange_drop_body(Exchange *exchange) {
    if (exchange->is_counted)
        atomic_fetch_sub(&exchange->server->body_bytes, exchange->body.count);
    exchange->is_counted = false;
    bytes_clear(&exchange->body);
    exchange->request.body = NULL;
    exchange->request.body_size = 0;
}

static enum MHD_Result exchange_add_body(Exchange *exchange, const char *data, size_t size) {
    Server *server = exchange->server;
    const size_t most = server->settings.body_most;
    exchange->received += size;
    if (exchange->received > DRAINED * most)
        return MHD_NO;
    if (exchange->is_answered || exchange->request.is_too_large || exchange->is_busy ||
        strcmp(exchange->request.method, "GET") == 0)
        return MHD_YES;
    exchange->request.is_too_large = exchange->received > most;
    if (!exchange->request.is_too_large) {
        exchange->is_counted = true;
        exchange->is_busy =
            atomic_fetch_add(&server->body_bytes, size) + size > BODIES_HELD * most &&
            exchange->received > BODY_SMALL;
        bytes_put(&exchange->body, data, size);
        if (exchange->body.is_failed) {
            atomic_fetch_sub(&server->body_bytes, exchange->received);
            exchange->is_counted = false;
            exchange->is_busy = true;
        }
    }
    if (exchange->request.is_too_large || exchange->is_busy)
        exchange_drop_body(exchange);
    return MHD_YES;
}

// From another thread; the library does not wake the loop by itself. The exchange may be gone when
// this returns.
static void exchange_resume(Exchange *exchange) {
    EventLoop *loop = exchange->loop;
    MHD_resume_connection(exchange->connection);
    loop_wake(loop);
}

// Calls the handler until it answers. False: it waits, and the exchange may be in the pool again
// already.
static bool exchange_handle(Exchange *exchange, Reply *reply) {
    Request *request = &exchange->request;
    for (;;) {
        reply_default(reply);
        if (!router_answer(exchange->server->settings.router, request, reply) &&
            exchange->forget != NULL)
            exchange->forget(request->kept);
        request->kept = reply->keep;
        exchange->forget = reply->forget;
        if (reply->wait_ms == 0)
            return true;
        exchange_drop_body(exchange);
        request->is_resumed = true;
        if (timer_sleep(exchange->timer, exchange, reply->wait_ms))
            return false;
        request->is_expired = !timer_was_woken(exchange->timer);
    }
}

static void exchange_work(WorkItem *work) {
    Exchange *exchange = (Exchange *)(void *)work;
    if (exchange->request.is_resumed)
        exchange->request.is_expired = !timer_was_woken(exchange->timer);
    if (!exchange_handle(exchange, &exchange->reply))
        return;
    exchange->is_in_pool = false;
    exchange->is_answered = true;
    exchange_resume(exchange);
}

static enum MHD_Result exchange_answer(Exchange *exchange) {
    exchange_end_body(exchange);
    Request *request = &exchange->request;
    Reply reply;
    if (exchange->is_answered) {
        reply = exchange->reply;
        reply_default(&exchange->reply);
        return response_queue(exchange, &reply, false);
    }
    if (exchange->is_busy) {
        Problem problem;
        problem_clear(&problem);
        problem_set(&problem, STATUS_BUSY, "too many large bodies at once");
        exchange_problem(exchange, 0, &problem, &reply);
        return response_queue(exchange, &reply, false);
    }
    if (request->is_resumed) {
        request->is_expired = !timer_was_woken(exchange->timer);
    } else {
        timer_limit(exchange->timer, 0, false);
        (void)timer_was_woken(exchange->timer);
        request->body = exchange->body.at;
        request->body_size = exchange->body.count;
        request->received = exchange->received;
        const Route *route = request->route;
        if (route->runs_on_loop == NULL || request->body_size > LOOP_BYTES ||
            !route->runs_on_loop(request)) {
            exchange->is_in_pool = true;
            exchange->work.run = exchange_work;
            // Suspended first: the answer may be there before thread_pool_add returns.
            MHD_suspend_connection(exchange->connection);
            thread_pool_add(exchange->server->pool, &exchange->work);
            return MHD_YES;
        }
    }
    return exchange_handle(exchange, &reply) ? response_queue(exchange, &reply, false) : MHD_YES;
}

// In the pool a connection is suspended already.
static void exchange_suspend(void *context) {
    Exchange *exchange = context;
    if (!exchange->is_in_pool)
        MHD_suspend_connection(exchange->connection);
}

static void exchange_wake(void *context) {
    Exchange *exchange = context;
    if (exchange->is_in_pool)
        thread_pool_add(exchange->server->pool, &exchange->work);
    else
        exchange_resume(exchange);
}

static void connection_timer_changed(void *loop) {
    loop_wake(loop);
}

const TimerCallbacks connection_timer_calls = {exchange_suspend, exchange_wake,
                                               connection_timer_changed};

void connection_notify(void *context, struct MHD_Connection *connection, void **timer,
                       enum MHD_ConnectionNotificationCode code) {
    EventLoop *loop = context;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        *timer = info != NULL ? timer_take(loop->timers, info->connect_fd) : NULL;
        if (*timer != NULL)
            timer_limit(*timer, HEAD_MS, true);
        return;
    }
    if (*timer != NULL)
        timer_leave(*timer);
    *timer = NULL;
    atomic_fetch_sub(&loop->connections, 1);
}

// The request line is complete; `target` is as sent.
void *exchange_open(void *context, const char *target, struct MHD_Connection *connection) {
    EventLoop *loop = context;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    ConnectionTimer *timer = info != NULL ? info->socket_context : NULL;
    Exchange *exchange = timer != NULL ? calloc(1, sizeof *exchange) : NULL;
    if (exchange == NULL)
        return NULL;
    exchange->target = strdup(target);
    if (exchange->target == NULL) {
        free(exchange);
        return NULL;
    }
    // libmicrohttpd would list the parameters in the connection's memory, and close the connection
    // without a word where they do not fit: they are cut off in its buffer, which it reads next.
    char *query = strchr((char *)(uintptr_t)target, '?');
    if (query != NULL)
        query[1] = '\0';
    exchange->loop = loop;
    exchange->server = loop->server;
    exchange->timer = timer;
    atomic_fetch_add(&loop->server->exchanges, 1);
    timer_limit(timer, HEAD_MS, false);
    return exchange;
}

enum MHD_Result exchange_continue(void *loop, struct MHD_Connection *connection, const char *url,
                                  const char *method, const char *version, const char *data,
                                  size_t *size, void **state) {
    (void)url; // decoded, and cut at a NUL: the target is used instead
    Exchange *exchange = *state;
    ((EventLoop *)loop)->calls++;
    if (exchange == NULL)
        return MHD_NO;
    if (!exchange->is_begun)
        return exchange_begin(exchange, connection, method, version);
    if (*size > 0) {
        const size_t added = *size;
        *size = 0;
        return exchange_add_body(exchange, data, added);
    }
    return exchange_answer(exchange);
}

void exchange_close(void *context, struct MHD_Connection *connection, void **state,
                    enum MHD_RequestTerminationCode code) {
    (void)connection;
    EventLoop *loop = context;
    Exchange *exchange = *state;
    if (exchange == NULL)
        return;
    *state = NULL;
    if (exchange->forget != NULL)
        exchange->forget(exchange->request.kept);
    if (exchange->is_answered) // its client may have left before it was sent
        reply_clear(&exchange->reply);
    exchange_drop_body(exchange);
    exchange_end_body(exchange);
    request_close(&exchange->request);
    // After an error the library closes the connection only at its client's next event.
    const bool is_complete = code == MHD_REQUEST_TERMINATED_COMPLETED_OK;
    timer_limit(exchange->timer, is_complete ? IDLE_MS : 1, is_complete);
    free(exchange->target);
    free(exchange);
    atomic_fetch_sub(&loop->server->exchanges, 1);
}

// Whether the library could read more of the request than it does.
static bool exchange_has_unread(const Exchange *exchange, int descriptor) {
    int unread = 0;
    const union MHD_ConnectionInfo *session =
        MHD_get_connection_info(exchange->connection, MHD_CONNECTION_INFO_GNUTLS_SESSION);
    if (exchange->server->settings.certificate != NULL && session != NULL &&
        tls_has_pending(session->tls_session))
        return true;
    return ioctl(descriptor, FIONREAD, &unread) == 0 && unread > 0;
}

// Where a chunk's header fills the connection's memory, 0.9.75 reads no further, keeps the loop
// busy and does not see that its client leaves. Such a header never fits: the connection is shut
// down when bytes were waiting and none was read at several checks.
void connection_close_stalled(EventLoop *loop, int64_t now_ns) {
    enum { CHECK_MS = 100, CHECKS = 3 };
    if (loop->readers == NULL || now_ns - loop->readers_checked_ns < CHECK_MS * 1000000LL)
        return;
    loop->readers_checked_ns = now_ns;
    for (Exchange *exchange = loop->readers; exchange != NULL; exchange = exchange->next_reader) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(exchange->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        if (!exchange->request.is_chunked || info == NULL)
            continue;
        const bool is_stalled = exchange->received == exchange->checked_received &&
                                exchange_has_unread(exchange, info->connect_fd);
        exchange->stalled_checks = is_stalled ? exchange->stalled_checks + 1 : 0;
        exchange->checked_received = exchange->received;
        if (exchange->stalled_checks == CHECKS) {
            shutdown(info->connect_fd, SHUT_RDWR);
            MHD_set_connection_option(exchange->connection, MHD_CONNECTION_OPTION_TIMEOUT, 1u);
        }
    }
}
