// The HTTP client of the commands that ask a server: where it is, one request after another, how
// long to wait for it, and its problem documents. The server is not trusted: its headers and bodies
// are bounded, redirects are not followed, TLS is verified.
#ifndef SERVER_CLI_CLIENT_H
#define SERVER_CLI_CLIENT_H

#include "core/base/field.h"
#include "server/cli/command.h"
#include "server/util/bytes.h"

enum {
    HTTP_DOCUMENT_MAX = 64 << 20, // [B] of a body that is kept in memory
    HTTP_HEADERS_MAX = 64 << 10,  // [B] of all headers of a response
    HTTP_SILENCE = 60,            // [s] without a byte, after which a request fails
};

// The options that all these commands have. IMPACTD_SERVER, IMPACTD_TOKEN_FILE and IMPACTD_CA_FILE
// are the defaults of the first three.
typedef struct ClientSettings {
    char *server, *token_file, *ca_file;
    double wait; // [s] for a busy server and for an unfinished job
} ClientSettings;

// Rows of the texts above. Their struct has the same members, or a ClientSettings as its first one.
#define DAEMON_ROWS(struct_type)                                                                   \
    FIELD_TEXT(struct_type, server, 2000, PRESENCE_OPTIONAL, 0,                                    \
               "URL of the server (IMPACTD_SERVER, else http://127.0.0.1:8080)"),                  \
        FIELD_TEXT(struct_type, token_file, 4000, PRESENCE_OPTIONAL, 0,                            \
                   "file with the token, readable by its owner only (else IMPACTD_TOKEN)"),        \
        FIELD_TEXT(struct_type, ca_file, 4000, PRESENCE_OPTIONAL, 0,                               \
                   "PEM file of trusted certificates (default: those of the system)")

typedef struct ApiClient {
    void *curl; // the handle keeps the connection between requests
    char *url, *token, *ca_file;
    bool is_loopback, is_tls;
    bool has_patience; // a wait was given
    int64_t until_ns;  // monotonic; end of the wait
    const char *about; // what messages of failures name
} ApiClient;

// Connects to nothing yet. From here on Ctrl-C ends the program with 130. STATUS_USAGE says what is
// wrong with the URL or the token. The client is closed by api_client_close in any case.
Status api_client_open(const ClientSettings *settings, ApiClient *client, Problem *problem);
void api_client_close(ApiClient *client);

// Opens a client, calls `act` with it, prints the reason of a failure on stderr, and closes it.
// `about` (may be NULL) is the first value of client->about. Returns the exit code.
int api_client_run(const Command *command, const ClientSettings *settings, const char *about,
                   Status (*act)(ApiClient *client, void *context, Problem *problem), void *context,
                   Problem *problem);

// Whether the token travels unencrypted to another machine.
bool api_client_exposes_token(const ApiClient *client);
double api_client_left(const ApiClient *client); // [s] of the wait, at least 0

typedef struct HttpAsk {
    const char *method;
    const char *path;            // "/v1/jobs?dry_run=1"
    const Bytes *body;           // NULL: none
    const char *content_type;    // of the body; NULL: JSON
    const char *if_match;        // NULL: not sent
    const char *prefer;          // NULL: not sent
    const char *idempotency_key; // NULL: not sent
    // Takes the body of a 200 as it arrives, `most` bytes at most; NULL: the body is kept. A body
    // that is cut off is continued once, if the server supports ranges.
    Status (*take)(void *context, const void *bytes, size_t size, Problem *problem);
    void *context;
    uint64_t most;
    double within; // [s] for the whole request; 0: no limit
} HttpAsk;

typedef struct HttpAnswer {
    int code;
    char content_type[64]; // without parameters
    char etag[256];        // a strong one with its quotes; "" for none
    int retry_after;       // [s]; 0: none
    Bytes body;
} HttpAnswer;

// One request. STATUS_OK if the server answered, with any status code; STATUS_UNREACHABLE if it did
// not, or not with HTTP; else what `take` returned. The answer is cleared by http_answer_clear in
// any case.
Status http_ask(ApiClient *client, const HttpAsk *ask, HttpAnswer *answer, Problem *problem);
void http_answer_clear(HttpAnswer *answer);

// The same, repeated after each 503 and 429 when Retry-After is over and while the wait lasts.
// STATUS_OK for 200, 201, 202 and 204 only; the problem document of other codes is in `problem`.
Status api_client_ask(ApiClient *client, const HttpAsk *ask, HttpAnswer *answer, Problem *problem);

// The same at `path`, which is cleared in any case.
Status api_client_request(ApiClient *client, HttpAsk ask, Bytes *path, HttpAnswer *answer,
                          Problem *problem);
void api_client_print(const HttpAnswer *answer); // the body as it came

// An id as the API has them; other texts are not put into a path.
bool api_client_is_id(const char *text);

// Prints all faults of `problem` on stderr, under `name`; returns the exit code.
int api_client_refuse(const char *command, const char *name, Status status, const Problem *problem);

// STATUS_UNREACHABLE: the response is not what impactd sends.
Status api_client_unexpected(const char *wanted, Problem *problem);

// A problem document (RFC 9457) as the server sent it.
typedef struct ProblemReply {
    char *type, *title, *detail;
    List errors;
    uint64_t more;
} ProblemReply;
extern const Field problem_reply_fields[];

// Adds the faults of the document to `problem`, with `status` and without control characters.
void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem);
// The problem document of an answer; returns what its code means, never STATUS_OK.
Status problem_reply_read(const HttpAnswer *answer, Problem *problem);

// Appends "?name=value" to a path, "&name=value" if it has a query; nothing if `value` is NULL or
// NAN.
void http_query(Bytes *path, const char *name, const char *value);
void http_query_real(Bytes *path, const char *name, double value);

#endif
