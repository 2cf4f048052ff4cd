// One HTTP request, its route and its reply as plain values; the validation of its head; what every
// handler requires of a request.
#ifndef SERVER_HTTP_REQUEST_H
#define SERVER_HTTP_REQUEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/field.h"
#include "server/auth/tokens.h"
#include "server/jobs/job.h"

enum {
    REQUEST_PARAMETERS = 4,
    REQUEST_QUERIES = 32,
    REQUEST_TARGET_MAX = 4096,
    REQUEST_ID_SIZE = 65,
    REQUEST_TEXT_MAX = 200,
};

typedef struct RequestPair {
    const char *name, *value; // decoded
} RequestPair;

typedef struct App App; // api/app.h
typedef struct Request Request;
typedef struct Reply Reply;

typedef Status Handler(App *app, const Request *request, Reply *reply, Problem *problem);

// One endpoint.
extern const char *const any_query[];

typedef struct Route {
    const char *method; // "GET"
    // "/v1/results/{id}/series.{format}": {x} matches one segment or the rest of one
    const char *pattern;
    const char *scope;          // "read", "submit", "materials", "admin"; "open": needs no token
    const char *const *queries; // names allowed in the query, NULL-terminated; NULL for none
                                // any_query: all, which pages for people ignore
    const char *doc;
    Handler *handle;
    // Whether the handler is so quick that it may run on the event loop; NULL: never.
    bool (*runs_on_loop)(const Request *request);
} Route;

struct Request {
    const char *method;                         // "GET"; HEAD is shown as GET, its body is not sent
    const char *target;                         // path and query as sent
    const char *path;                           // as sent, without query and base path
    const char *parameters[REQUEST_PARAMETERS]; // what {..} in the route's pattern matched, in
                                                // order, decoded
    RequestPair queries[REQUEST_QUERIES];
    size_t query_count;
    const char *body; // NUL-terminated behind body_size bytes; NULL if there is none
    size_t body_size;
    bool is_too_large; // the body was over its limit and is not here
    size_t body_most;  // that limit
    uint64_t received; // bytes of the body, also of one that is not here
    const char *host;  // as the client names us, else our address
    const char *content_type, *accept, *prefer, *if_none_match, *if_range,
        *range; // NULL if absent
    const char *expect, *authorization, *accept_encoding, *content_encoding, *if_match,
        *idempotency_key, *last_event_id, *content_length, *transfer_encoding, *origin, *fetch_site;
    const char *repeated;     // the name of a header that may be there only once, or NULL
    bool has_hidden_lines;    // the head has lines that belong to no header
    char faulty[40];          // the name of a header with a character that is not allowed, or ""
    uint64_t length;          // of the body, from Content-Length
    bool is_chunked;          // the body has no Content-Length
    char prefers[128];        // all Prefer headers in one: `prefer` points here
    const char *client;       // the name of the token it came with; NULL: none was asked for
    Holder holder;            // `client` points here
    bool is_sender_only;      // the token may read its own jobs only
    char id[REQUEST_ID_SIZE]; // the client's own or ours; for the client and the log
    const Route *route;       // NULL until it is found, and where none fits
    uint64_t cache_age;       // response_cache_age when it was found
    int64_t started_ns;       // monotonic
    bool is_resumed;          // the handler asked to wait and is called again
    bool is_expired;          // ... because the time was up
    void *kept;               // what the handler kept when it asked to wait; see Reply
    const Callback *callback; // resumes this request; outlives it, so that a late call is harmless
    const char *allow_origin; // an Origin of another site that --allow-origin names, or NULL
    const char *preflight;    // Access-Control-Request-Method, or NULL
    bool is_pretty;           // JSON is indented: by ?pretty=1, or where Accept prefers text/html
    bool is_pretty_asked;     // by the query, which is removed from `queries`
    char *storage;            // what the texts above point into
    char *parameter_storage;  // part of it
};

// Takes `target` apart: path, queries, percent-decoded. The rest of `request` stays. STATUS_USAGE
// for a broken escape, a NUL, a query named twice or more than REQUEST_QUERIES of them. Closed by
// request_close in any case.
Status request_open(Request *request, const char *target, Problem *problem);
void request_close(Request *request);

// Keeps the headers named above, the first of each kind; `value` (NULL: none) must outlive the
// request. An X-Request-Id becomes `id` if it is 1 to 64 of [A-Za-z0-9._-].
void request_header(Request *request, const char *name, size_t name_size, const char *value,
                    size_t value_size);

// The names that requests may call us by.
typedef struct AcceptedHosts {
    const char *const *names;   // without port, "[::1]", NULL-terminated
    bool takes_addresses;       // any numeric address as well: no other site's name leads to it
    const char *const *origins; // of other sites that may use the API, NULL-terminated; or NULL
} AcceptedHosts;
extern const AcceptedHosts loopback_hosts; // localhost, 127.0.0.1 and [::1]

// Refuses heads that two parsers could read differently and hosts that are not this server's: the
// connection is to be closed. `target` is as sent; request->target may be unset. 0 if the request
// may go on, else the HTTP status (400, 403, 414, 421, 501, 505), with the reason in `problem`.
// 403: another site's page sends a request that is not GET, HEAD or OPTIONS.
int request_validate(Request *request, const AcceptedHosts *hosts, const char *target,
                     const char *version, Problem *problem);
// The one of the origins that the Origin header names; NULL: none.
const char *request_allowed_origin(const Request *request, const AcceptedHosts *hosts);
// Whether a Host header's value is one of the names, with any port or none.
bool host_is_ours(const AcceptedHosts *hosts, const char *host);

const char *request_query(const Request *request, const char *name); // NULL if absent

// Decodes %XX in place; '+' is a space if `is_query`. False for a broken escape or %00.
bool request_decode(char *text, bool is_query);

// A number within [least, most] from a query, `initial` if it is absent. STATUS_USAGE says what
// would be right.
Status request_number(const Request *request, const char *name, double least, double most,
                      double initial, double *value, Problem *problem);
// 1, 0, true or false; without it false. STATUS_USAGE likewise.
Status request_flag(const Request *request, const char *name, bool *flag, Problem *problem);
// A whole number of at most 2^53, likewise.
Status request_count(const Request *request, const char *name, size_t least, size_t most,
                     size_t initial, size_t *value, Problem *problem);

// The text, NULL where it is absent or empty; at most REQUEST_TEXT_MAX bytes.
Status request_text(const Request *request, const char *name, const char **text, Problem *problem);
// Which of `names` (NULL-terminated) it is; `initial` where it is absent.
Status request_choice(const Request *request, const char *name, const char *const *names,
                      int initial, int *choice, Problem *problem);
// Whether text[size], which need not end there, is a finite decimal number of less than 64 bytes.
bool request_read_real(const char *text, size_t size, double *value);
// The members of a document that is sent as queries: texts and choices, of which those absent or
// empty stay as they are. STATUS_INVALID at the member's pointer, with a suggestion.
Status request_read_fields(const Request *request, const Field *fields, void *item,
                           Problem *problem);

// STATUS_UNSUPPORTED_TYPE unless the body is JSON by its Content-Type and not encoded,
// STATUS_TOO_LARGE if it was over the limit, STATUS_UNREADABLE if there is none.
Status request_require_json(const Request *request, Problem *problem);
// The same of any type.
Status request_require_body(const Request *request, Problem *problem);
// Whether the body is JSON or one of `texts` (NULL-terminated), likewise; a fault says what is
// wanted and a hint.
Status request_require_type(const Request *request, const char *const *texts, const char *wanted,
                            const char *hint, bool *is_json, Problem *problem);
// The JSON body of a request without queries, which are for other types.
Status request_read_document(const Request *request, const Field *fields, void *item,
                             Problem *problem);
// STATUS_TOO_LARGE: the limit, and how to raise it.
Status request_error_large(size_t max, Problem *problem);

// Whether Accept decides if JSON is indented: GET below /v1/, without ?pretty.
bool request_is_pretty_by_accept(const Request *request);

// Of Route.runs_on_loop: the request has no body.
bool request_is_empty(const Request *request);

// A body made piece by piece while it is sent, because it is too long for memory or not complete
// yet. `next` writes up to `size` bytes and returns how many, STREAM_END after the last,
// STREAM_WAIT to be called again when the request's callback (which the context may keep) is called
// or after `wait_ms`, or STREAM_BROKEN where the rest cannot be had: the client sees that it is cut
// off. It is called from one thread at a time, must be quick, and has no Request: that ends with
// the handler. `release(context)` is called once, also if the client leaves early.
enum { STREAM_END = -1, STREAM_WAIT = -2, STREAM_BROKEN = -3 };
typedef struct Stream {
    ptrdiff_t (*next)(void *context, char *target, size_t size);
    uint64_t size; // of the whole body; UINT64_MAX: not known
    int wait_ms;
    // Only bytes first ... first + size - 1 from now on; called before `next`. NULL: all or
    // nothing.
    void (*cut)(void *context, uint64_t first, uint64_t size);
} Stream;

struct Reply {
    int code; // HTTP status
    const char *content_type;
    const void *body;
    size_t body_size;
    Stream stream;                  // `next` not NULL: in place of body
    void (*release)(void *context); // called once when the body was sent or given up; may be NULL
    void *context;
    char location[512]; // "": not sent; without the base path, which the router adds
    char etag[112];     // with quotes, "" for none
    char cache_control[64];
    char link[2048];          // "": not sent; without the base path
    const char *policy;       // Content-Security-Policy; NULL: nothing may load anything
    const char *authenticate; // WWW-Authenticate; NULL: none
    char preference_applied[48];
    char allow[64];
    char content_range[80];
    bool is_replayed;             // an earlier request's answer, under the same Idempotency-Key
    int retry_after;              // seconds, -1 for none
    const char *content_encoding; // "gzip", or NULL
    bool is_immutable;            // the same target gets it for ever
    bool accepts_ranges;
    bool is_preflight; // of CORS: `allow` has the methods
    bool varies_by_encoding;
    bool varies_by_accept; // the same path has several representations
    int wait_ms; // > 0: not a reply yet; call the handler again when woken or after so long
    void *keep;  // with wait_ms: handed back as request->kept; `forget` frees it, always, after the
    void (*forget)(void *keep); // next call of the handler or when the client has gone
};

#endif
