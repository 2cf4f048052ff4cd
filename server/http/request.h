// One HTTP request as plain values, and the reply to it. No libmicrohttpd here (listener.c has it alone).
// Used by http/ and api/.
#ifndef SERVER_HTTP_REQUEST_H
#define SERVER_HTTP_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "server/jobs/job.h"

enum { REQUEST_PARAMETERS = 4, REQUEST_QUERIES = 32 };

typedef struct RequestPair {
    const char *name, *value;  // decoded
} RequestPair;

typedef struct Request {
    const char *method;       // "GET"; HEAD is shown as GET, the listener drops the body
    const char *target;       // path and query as sent
    const char *path;         // as sent, without query
    const char *parameters[REQUEST_PARAMETERS];  // what {..} in the route's pattern matched, in order, decoded
    RequestPair queries[REQUEST_QUERIES];
    size_t query_count;
    const char *body;
    size_t body_size;
    const char *content_type, *accept, *prefer, *if_none_match, *range;  // NULL if absent
    int64_t started_ns;       // monotonic
    bool is_woken;            // the handler asked to wait and is called again
    bool is_expired;          // ... because the time was up
    Waker waker;              // wakes this request; see reply_wait
} Request;

const char *request_query(const Request *request, const char *name);  // NULL if absent

typedef struct Reply {
    int code;                  // HTTP status
    const char *content_type;
    const void *body;
    size_t body_size;
    void (*release)(void *context);  // called once when the body was sent or given up; may be NULL
    void *context;
    char location[128];        // "" for none
    char etag[96];             // with quotes, "" for none
    char cache_control[64];
    char link[160];
    char preference_applied[48];
    char allow[64];
    int retry_after;           // seconds, -1 for none
    bool accepts_ranges;
    int wait_ms;               // > 0: not a reply yet; call the handler again when woken or after so long
} Reply;

#endif
