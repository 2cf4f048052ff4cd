#include "server/http/response.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/exchange.h"
#include "server/http/reply.h"
#include "server/http/security_headers.h"
#include "server/util/clock.h"

// What a streamed body needs while it is sent.
typedef struct Sending {
    Exchange *exchange;
    int64_t admitted_ns; // when its client was last looked at
    Stream stream;
    void (*release)(void *context);
    void *context;
} Sending;

// A body that takes long outlives what its client may do.
static bool is_still_admitted(Sending *sending) {
    enum { LOOK_MS = 500 };
    const ServerSettings *settings = &sending->exchange->shared->settings;
    const int64_t now_ns = clock_monotonic_ns();
    if (settings->still_admits == NULL || now_ns - sending->admitted_ns < LOOK_MS * 1000000LL)
        return true;
    sending->admitted_ns = now_ns;
    return settings->still_admits(settings->context, &sending->exchange->request);
}

static ssize_t send_next(void *context, uint64_t position, char *target, size_t size) {
    (void)position;
    Sending *sending = context;
    Exchange *exchange = sending->exchange;
    for (;;) {
        // Cut off, so that nobody takes it for whole.
        if (!is_still_admitted(sending))
            return MHD_CONTENT_READER_END_WITH_ERROR;
        // Forgotten before looking: whoever wakes it from here on has it look again.
        (void)timer_was_woken(exchange->timer);
        const ptrdiff_t count = sending->stream.next(sending->context, target, size);
        if (count == STREAM_END)
            return MHD_CONTENT_READER_END_OF_STREAM;
        if (count == STREAM_BROKEN)
            return MHD_CONTENT_READER_END_WITH_ERROR;
        if (count != STREAM_WAIT)
            return count;
        if (timer_wheel_is_closing(exchange->shared->wheel))
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

static struct MHD_Response *stream_response(Exchange *exchange, const Reply *reply) {
    enum { PIECE = 64 * 1024 };
    Sending *sending = malloc(sizeof *sending);
    if (sending == NULL)
        return NULL;
    *sending =
        (Sending){exchange, clock_monotonic_ns(), reply->stream, reply->release, reply->context};
    struct MHD_Response *response = MHD_create_response_from_callback(
        reply->stream.size == UINT64_MAX ? MHD_SIZE_UNKNOWN : reply->stream.size, PIECE, send_next,
        sending, sending_free);
    if (response == NULL)
        free(sending);
    return response;
}

static void add_header(struct MHD_Response *response, const char *name, const char *value) {
    if (value != NULL && value[0] != '\0')
        MHD_add_response_header(response, name, value);
}

static const char *vary(const Reply *reply) {
    if (reply->varies_by_encoding)
        return reply->varies_by_accept ? "Accept, Accept-Encoding" : "Accept-Encoding";
    return reply->varies_by_accept ? "Accept" : NULL;
}

// All headers but those of one request alone.
static void add_headers(struct MHD_Response *response, const Reply *reply, bool has_tls) {
    const bool is_events =
        reply->content_type != NULL && strcmp(reply->content_type, "text/event-stream") == 0;
    char retry_after[16] = "";
    if (reply->retry_after >= 0)
        snprintf(retry_after, sizeof retry_after, "%d", reply->retry_after);
    add_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type);
    add_header(response, MHD_HTTP_HEADER_CONTENT_ENCODING, reply->content_encoding);
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
    // A proxy that gathers an answer would hold events back.
    add_header(response, "X-Accel-Buffering", is_events ? "no" : NULL);
    add_header(response, MHD_HTTP_HEADER_ACCEPT_RANGES, reply->accepts_ranges ? "bytes" : NULL);
    add_header(response, MHD_HTTP_HEADER_VARY, vary(reply));
    add_header(response, MHD_HTTP_HEADER_WWW_AUTHENTICATE, reply->authenticate);
    add_header(response, "Content-Security-Policy",
               reply->policy != NULL ? reply->policy : shield_policy);
    for (const SecurityHeader *header = shield_headers; header->name != NULL; header++)
        add_header(response, header->name, header->value);
    if (has_tls)
        add_header(response, shield_tls.name, shield_tls.value);
}

// Takes what `reply` owns, also when it fails.
static struct MHD_Response *make(Exchange *exchange, Reply *reply) {
    struct MHD_Response *response =
        reply->stream.next != NULL ? stream_response(exchange, reply)
        : reply->release != NULL
            ? MHD_create_response_from_buffer_with_free_callback_cls(
                  reply->body_size, (void *)(uintptr_t)reply->body, reply->release, reply->context)
            : MHD_create_response_from_buffer(reply->body_size, (void *)(uintptr_t)reply->body,
                                              MHD_RESPMEM_PERSISTENT);
    if (response == NULL)
        reply_clear(reply);
    else
        add_headers(response, reply, exchange->shared->settings.certificate != NULL);
    return response;
}

// The same for a small whole answer out of the cache; the response stays the loop's.
static struct MHD_Response *make_again(Exchange *exchange, Reply *reply) {
    const size_t place = (uintptr_t)reply->shared / 64 % SENT_AGAIN;
    SharedResponse *one = &exchange->loop->shared_response[place];
    if (one->shared == reply->shared) {
        // The response has a hold of its own on the shared body.
        reply->release(reply->context);
        MHD_del_response_header(one->response, "X-Request-Id",
                                MHD_get_response_header(one->response, "X-Request-Id"));
        return one->response;
    }
    struct MHD_Response *response = make(exchange, reply);
    if (response == NULL)
        return NULL;
    if (one->response != NULL)
        MHD_destroy_response(one->response);
    *one = (SharedResponse){reply->shared, response};
    return response;
}

void response_forget(SharedResponse shared_response[SENT_AGAIN]) {
    for (size_t i = 0; i < SENT_AGAIN; i++) {
        if (shared_response[i].response != NULL)
            MHD_destroy_response(shared_response[i].response);
        shared_response[i] = (SharedResponse){NULL, NULL};
    }
}

enum { SMALL = 64 * 1024 };

enum MHD_Result response_queue(Exchange *exchange, Reply *reply, bool closes) {
    const int code = reply->code;
    closes = closes || timer_wheel_is_closing(exchange->shared->wheel);
    const bool is_kept =
        reply->shared != NULL && code == 200 && reply->body_size <= SMALL && !closes;
    struct MHD_Response *response = is_kept ? make_again(exchange, reply) : make(exchange, reply);
    if (response == NULL)
        return MHD_NO;
    add_header(response, "X-Request-Id", exchange->request.id);
    if (closes)
        add_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
    const enum MHD_Result result =
        MHD_queue_response(exchange->connection, (unsigned)code, response);
    if (!is_kept)
        MHD_destroy_response(response);
    return result;
}
