// request line -> head: the gate -> body: collected up to its cap -> answer -> sent
//
// What can be answered without waiting is answered on the event loop. Anything else goes to the
// pool, its connection suspended meanwhile; a handler that asks to wait sleeps in its seat and goes
// on where it began. A reply queued before the body is read closes the connection, and the client,
// still sending, may never see it: a refusal waits for the body, which is thrown away, unless its
// end is in doubt, it is too long, or the client waits for leave to send it. What the library
// answers by itself (a head over its memory, a line that is no HTTP, a Content-Length past 2^64) is
// no problem document, and a NUL in a header's value is cut before we see it.
#include "server/http/exchange.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/http/body.h"
#include "server/http/reply.h"
#include "server/http/response.h"
#include "server/json/encode.h"
#include "server/util/clock.h"

enum {
    IDLE_MS = 60000, // from the last reply to the next request line
    HEAD_MS =
        10000, // from the connection to its first request line, from any to the end of its head
    BODY_MS = 60000,
    DRAINED = 4,      // times the body's limit is read and thrown away, so that a refusal is seen
    BODIES_HELD = 16, // times the body's limit may be in memory over all connections
    BODY_SMALL = 16 * 1024, // is taken in any case: who holds large ones keeps no scene out
};

static void make_problem(Exchange *exchange, int code, const Problem *problem, Reply *reply) {
    reply_default(reply);
    body_problem(reply, problem, code, NULL, exchange->request.id);
    const ServerSettings *settings = &exchange->shared->settings;
    if (settings->note != NULL)
        settings->note(settings->context, &exchange->request, reply);
}

static enum MHD_Result take_header(void *context, enum MHD_ValueKind kind, const char *name,
                                   size_t name_size, const char *value, size_t value_size) {
    (void)kind;
    Exchange *exchange = context;
    validate_header(&exchange->validator, name, name_size, value, value_size);
    if (value != NULL)
        request_header(&exchange->request, name, value);
    return MHD_YES;
}

static void write_id(char id[REQUEST_ID_SIZE], uint64_t number) {
    memcpy(id, "q-", 2);
    for (size_t i = 13; i >= 2; i--, number >>= 4)
        id[i] = "0123456789abcdef"[number & 15];
    id[14] = '\0';
}

static void await_body(Exchange *exchange, bool has_body) {
    exchange->is_reading = has_body;
    exchange->loop->reading += has_body;
    timer_limit(exchange->timer, has_body ? BODY_MS : 0);
}

// Takes the refusal; sent now or, with `drains`, once the body has been thrown away.
static enum MHD_Result refuse(Exchange *exchange, Reply *refusal, bool drains) {
    if (!drains)
        return response_queue(exchange, refusal, true);
    exchange->reply = *refusal;
    exchange->is_answered = true;
    await_body(exchange, true);
    return MHD_YES;
}

// The head is complete: judge it, and refuse at once what cannot be read to its end.
static enum MHD_Result begin(Exchange *exchange, struct MHD_Connection *connection,
                             const char *method, const char *version) {
    ServerShared *shared = exchange->shared;
    Request *request = &exchange->request;
    exchange->is_begun = true;
    exchange->connection = connection;
    request->method = method;
    request->path = request->target = exchange->target;
    request->started_ns = clock_monotonic_ns();
    request->callback = timer_callback(exchange->timer);
    request->body_most = shared->settings.body_most;
    exchange->validator.names = shared->settings.hosts;
    MHD_get_connection_values_n(connection, MHD_HEADER_KIND, take_header, exchange);
    if (request->id[0] == '\0')
        write_id(request->id, shared->first_id + atomic_fetch_add(&shared->requests, 1));

    if (request->host == NULL)
        request->host = strstr(shared->url, "://") + 3;

    Problem problem;
    problem_clear(&problem);
    int code = validate_request(&exchange->validator, method, exchange->target, version, &problem);
    const bool is_framed = code == 0; // it is certain where the body ends
    if (code == 0 && request_open(request, exchange->target, &problem) != STATUS_OK)
        code = encode_problem_code(problem.status);
    const unsigned long long body_size = exchange->validator.length;
    const size_t most = request->body_most;
    const bool waits_for_leave =
        request->expect != NULL && strcasecmp(request->expect, "100-continue") == 0;
    if (code == 0 && request->expect != NULL && !waits_for_leave) {
        code = 417;
        problem_set(&problem, STATUS_USAGE, "the only expectation understood is 100-continue");
    }
    if (code == 0 && body_size > (waits_for_leave ? most : DRAINED * most)) {
        code = 413;
        body_error_large(most, &problem);
    }
    const bool has_body = body_size > 0 || exchange->validator.is_chunked;
    const bool drains =
        is_framed && has_body && request->expect == NULL && body_size <= DRAINED * most;
    Reply refusal;
    if (code != 0) {
        make_problem(exchange, code, &problem, &refusal);
        return refuse(exchange, &refusal, drains);
    }
    if (strcmp(method, "HEAD") == 0) {
        request->method = "GET";
        request->range = NULL;
    }
    const ServerSettings *settings = &shared->settings;
    if (has_body && settings->admits != NULL) {
        reply_default(&refusal);
        if (!settings->admits(settings->context, request, &refusal))
            return refuse(exchange, &refusal, drains);
    }
    exchange->body.most = most;
    await_body(exchange, has_body);
    return MHD_YES;
}

static void end_reading(Exchange *exchange) {
    exchange->loop->reading -= exchange->is_reading;
    exchange->is_reading = false;
}

static void drop_body(Exchange *exchange) {
    if (exchange->is_counted)
        atomic_fetch_sub(&exchange->shared->held, exchange->body.count);
    exchange->is_counted = false;
    bytes_clear(&exchange->body);
    exchange->request.body = NULL;
    exchange->request.body_size = 0;
}

static enum MHD_Result take_body(Exchange *exchange, const char *data, size_t size) {
    ServerShared *shared = exchange->shared;
    const size_t most = shared->settings.body_most;
    exchange->received += size;
    if (exchange->received > DRAINED * most)
        return MHD_NO;
    if (exchange->is_answered || exchange->request.is_too_large || exchange->is_busy ||
        strcmp(exchange->request.method, "GET") == 0)
        return MHD_YES;
    exchange->request.is_too_large = exchange->received > most;
    if (!exchange->request.is_too_large) {
        exchange->is_counted = true;
        exchange->is_busy = atomic_fetch_add(&shared->held, size) + size > BODIES_HELD * most &&
                            exchange->received > BODY_SMALL;
        bytes_put(&exchange->body, data, size);
        if (exchange->body.is_failed) {
            atomic_fetch_sub(&shared->held, exchange->received);
            exchange->is_counted = false;
            exchange->is_busy = true;
        }
    }
    if (exchange->request.is_too_large || exchange->is_busy)
        drop_body(exchange);
    return MHD_YES;
}

// The handler asked to wait.
static void note_wait(Exchange *exchange, const Reply *reply) {
    drop_body(exchange);
    exchange->request.kept = reply->keep;
    exchange->forget = reply->forget;
    exchange->is_asleep = true;
}

// What the last sleep ended by.
static void note_wake(Exchange *exchange) {
    exchange->request.is_woken = timer_was_woken(exchange->timer);
    exchange->request.is_expired = !exchange->request.is_woken;
}

// Another thread's word: the loop does not hear of it by itself. The exchange may be gone when this
// returns.
static void resume(Exchange *exchange) {
    EventFd *wakeup = &exchange->loop->wakeup;
    MHD_resume_connection(exchange->connection);
    eventfd_signal(wakeup);
}

// In the pool.
static void answer_in_pool(WorkItem *task) {
    Exchange *exchange = (Exchange *)(void *)task;
    const ServerSettings *settings = &exchange->shared->settings;
    if (exchange->is_asleep)
        note_wake(exchange);
    for (;;) {
        Reply *reply = &exchange->reply;
        reply_default(reply);
        settings->answer(settings->context, &exchange->request, reply);
        if (reply->wait_ms == 0)
            break;
        note_wait(exchange, reply);
        if (timer_sleep(exchange->timer, exchange, reply->wait_ms))
            return; // it may be in the pool again already
        note_wake(exchange);
    }
    exchange->request.kept = exchange->reply.keep;
    exchange->forget = exchange->reply.forget;
    exchange->is_in_pool = false;
    exchange->is_answered = true;
    resume(exchange);
}

static enum MHD_Result hand_over(Exchange *exchange) {
    exchange->is_in_pool = true;
    exchange->is_asleep = false;
    exchange->task.run = answer_in_pool;
    // The state first: the answer may be there before this returns.
    MHD_suspend_connection(exchange->connection);
    thread_pool_add(exchange->shared->pool, &exchange->task);
    return MHD_YES;
}

static enum MHD_Result answer(Exchange *exchange) {
    end_reading(exchange);
    const ServerSettings *settings = &exchange->shared->settings;
    Request *request = &exchange->request;
    if (exchange->is_answered) {
        Reply reply = exchange->reply;
        reply_default(&exchange->reply);
        return response_queue(exchange, &reply, false);
    }
    if (exchange->is_busy) {
        Problem problem;
        problem_clear(&problem);
        problem_set(&problem, STATUS_BUSY, "too many large bodies at once");
        Reply refusal;
        make_problem(exchange, 0, &problem, &refusal);
        return response_queue(exchange, &refusal, false);
    }
    if (exchange->is_asleep) {
        note_wake(exchange);
    } else {
        timer_limit(exchange->timer, 0);
        timer_begin(exchange->timer);
        request->body = exchange->body.at;
        request->body_size = exchange->body.count;
        request->received = exchange->received;
    }
    for (;;) {
        Reply reply;
        reply_default(&reply);
        if (!settings->answer_at_once(settings->context, request, &reply))
            return hand_over(exchange);
        if (reply.wait_ms == 0) {
            request->kept = reply.keep;
            exchange->forget = reply.forget;
            return response_queue(exchange, &reply, false);
        }
        note_wait(exchange, &reply);
        if (timer_sleep(exchange->timer, exchange, reply.wait_ms))
            return MHD_YES;
        note_wake(exchange);
    }
}

// In the pool a connection is suspended already, and its sleep ends with a place in the queue.
static void fall_asleep(void *context) {
    Exchange *exchange = context;
    if (!exchange->is_in_pool)
        MHD_suspend_connection(exchange->connection);
}

static void wake_up(void *context) {
    Exchange *exchange = context;
    if (exchange->is_in_pool)
        thread_pool_add(exchange->shared->pool, &exchange->task);
    else
        resume(exchange);
}

const TimerCallbacks exchange_calls = {fall_asleep, wake_up};

void exchange_connection(void *context, struct MHD_Connection *connection, void **timer,
                         enum MHD_ConnectionNotificationCode code) {
    EventLoop *loop = context;
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
        *timer = info != NULL ? timer_take(loop->shared->wheel, info->connect_fd) : NULL;
        if (*timer != NULL)
            timer_limit(*timer, HEAD_MS);
        return;
    }
    if (*timer != NULL)
        timer_leave(*timer);
    *timer = NULL;
    atomic_fetch_sub(&loop->connections, 1);
}

// A few are kept for the next requests: they are too large for the allocator's quick ways.
static Exchange *exchange_take(EventLoop *loop) {
    if (loop->spare_count == 0)
        return calloc(1, sizeof(Exchange));
    Exchange *exchange = loop->free_list[--loop->spare_count];
    memset(exchange, 0, sizeof *exchange);
    return exchange;
}

static void exchange_put(EventLoop *loop, Exchange *exchange) {
    if (loop->spare_count < EXCHANGES_KEPT)
        loop->free_list[loop->spare_count++] = exchange;
    else
        free(exchange);
}

void exchange_forget(EventLoop *loop) {
    while (loop->spare_count > 0)
        free(loop->free_list[--loop->spare_count]);
}

// The request line is in; `target` is as sent.
void *exchange_open(void *context, const char *target, struct MHD_Connection *connection) {
    EventLoop *loop = context;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    ConnectionTimer *timer = info != NULL ? info->socket_context : NULL;
    Exchange *exchange = timer != NULL ? exchange_take(loop) : NULL;
    if (exchange == NULL)
        return NULL;
    exchange->target = strdup(target);
    if (exchange->target == NULL) {
        exchange_put(loop, exchange);
        return NULL;
    }
    exchange->loop = loop;
    exchange->shared = loop->shared;
    exchange->timer = timer;
    atomic_fetch_add(&loop->shared->exchanges, 1);
    timer_limit(timer, HEAD_MS);
    return exchange;
}

enum MHD_Result exchange_go_on(void *loop, struct MHD_Connection *connection, const char *url,
                               const char *method, const char *version, const char *data,
                               size_t *size, void **state) {
    (void)url; // the url is decoded and cut at a NUL; the target is what counts
    Exchange *exchange = *state;
    ((EventLoop *)loop)->turns++;
    if (exchange == NULL)
        return MHD_NO;
    if (!exchange->is_begun)
        return begin(exchange, connection, method, version);
    if (*size > 0) {
        const size_t taken = *size;
        *size = 0;
        return take_body(exchange, data, taken);
    }
    return answer(exchange);
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
    if (exchange->is_answered) {
        // The client may have left before it was sent.
        exchange->reply.forget = NULL;
        reply_clear(&exchange->reply);
    }
    drop_body(exchange);
    end_reading(exchange);
    request_close(&exchange->request);
    // One that ended in an error the library closes only when its client is heard of again.
    timer_limit(exchange->timer, code == MHD_REQUEST_TERMINATED_COMPLETED_OK ? IDLE_MS : 1);
    free(exchange->target);
    exchange_put(loop, exchange);
    atomic_fetch_sub(&loop->shared->exchanges, 1);
}
