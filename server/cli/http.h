// One HTTP exchange after another with a server that is not trusted: bounded, no redirects, TLS
// verified. Bodies are read by reply.h.
#ifndef SERVER_CLI_HTTP_H
#define SERVER_CLI_HTTP_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "server/util/bytes.h"

enum {
    HTTP_DOCUMENT_MAX = 64 << 20, // [B] of a body that is kept in memory
    HTTP_HEADERS_MAX = 64 << 10,  // [B] of all headers of an answer
    HTTP_SILENCE = 60,            // [s] without a byte, after which a server is given up
};

typedef struct HttpServer {
    const char *url;     // "http://127.0.0.1:8080", perhaps with a path
    const char *token;   // NULL: none
    const char *ca_file; // PEM; NULL: the system's
} HttpServer;

typedef struct Http Http; // a connection that is kept between exchanges

// Judges the URL; connects to nothing yet. STATUS_USAGE says what would be right. The texts of
// `server` are copied.
Status http_open(const HttpServer *server, Http **http, Problem *problem);
void http_close(Http *http);

// Whether a token would travel unencrypted to another machine.
bool http_exposes_token(const Http *http);

typedef struct HttpAsk {
    const char *method;
    const char *path;            // "/v1/jobs?dry_run=1"
    const Bytes *body;           // NULL: none
    const char *content_type;    // of the body; NULL: JSON
    const char *if_match;        // NULL: not sent
    const char *prefer;          // NULL: not sent
    const char *idempotency_key; // NULL: not sent
    // Where the body of a 200 goes as it comes, `most` bytes at most; NULL: it is kept. A body that
    // is cut off is asked for once more from there on, if the server offers that.
    Status (*take)(void *context, const void *bytes, size_t size, Problem *problem);
    void *context;
    uint64_t most;
    double within; // [s] for the whole, above 0; 0: any
} HttpAsk;

typedef struct HttpAnswer {
    int code;
    char content_type[64]; // without parameters
    char etag[256];        // a strong one with its quotes; "" for none
    int retry_after;       // [s]; 0: none
    Bytes body;
} HttpAnswer;

// STATUS_OK if the server answered, whatever its code; STATUS_UNREACHABLE if nothing sensible
// answers there, with what to do; or what `take` returned. The answer is cleared by
// http_answer_clear in any case.
Status http_ask(Http *http, const HttpAsk *ask, HttpAnswer *answer, Problem *problem);
void http_answer_clear(HttpAnswer *answer);

// Appends `text` percent-encoded.
void http_encode(Bytes *bytes, const char *text);
// Appends "?name=value" to a path, or "&name=value" where it has a query; nothing where `value` is
// NULL or NAN.
void http_query(Bytes *path, const char *name, const char *value);
void http_query_real(Bytes *path, const char *name, double value);

#endif
