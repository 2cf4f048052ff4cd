// The HTTP client of the commands that ask a server, and the frame of such a command: its actions
// and operands, requests, answers, problem documents. The server is not trusted: its headers and
// bodies are bounded, redirects are not followed, TLS is verified.
#ifndef SERVER_CLI_CLIENT_H
#define SERVER_CLI_CLIENT_H

#include "core/base/field.h"
#include "server/cli/command.h"
#include "server/json/table.h"
#include "server/util/bytes.h"

// The options that all these commands have, the first member of their settings. IMPACTD_SERVER,
// IMPACTD_TOKEN_FILE and IMPACTD_CA_FILE are the defaults of the first three.
typedef struct ClientSettings {
    char *server, *token_file, *ca_file;
    double wait; // [s] for a busy server and for an unfinished job
    bool json;   // print answers as they came
} ClientSettings;

#define CLIENT_ROWS                                                                                \
    FIELD_TEXT(ClientSettings, server, 2000, PRESENCE_OPTIONAL, 0,                                 \
               "URL of the server (IMPACTD_SERVER, else http://127.0.0.1:8080)"),                  \
        FIELD_TEXT(ClientSettings, token_file, 4000, PRESENCE_OPTIONAL, 0,                         \
                   "file with the token, readable by its owner only (else IMPACTD_TOKEN)"),        \
        FIELD_TEXT(ClientSettings, ca_file, 4000, PRESENCE_OPTIONAL, 0,                            \
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
// Whether the token travels unencrypted to another machine.
bool api_client_exposes_token(const ApiClient *client);
double api_client_left(const ApiClient *client); // [s] of the wait, at least 0

typedef struct ApiRequest {
    const char *method;          // NULL: GET, with a body POST
    Bytes path;                  // "/v1/jobs?dry_run=1"
    const Bytes *body;           // NULL: none
    const char *content_type;    // of the body; NULL: JSON
    const char *if_match;        // NULL: not sent
    const char *prefer;          // NULL: not sent
    const char *idempotency_key; // NULL: not sent
    // > 0: the body of a 200 of at most this size goes to the open output, and one that is cut off
    // is continued once, if the server supports ranges. 0: the body is kept.
    uint64_t output_max;
} ApiRequest;

typedef struct ApiAnswer {
    int code;
    char content_type[64]; // without parameters
    char etag[256];        // a strong one with its quotes; "" for none
    int retry_after;       // [s]; 0: none
    Bytes body;
} ApiAnswer;

typedef struct ReplyFault {
    char *pointer, *detail, *unit, *did_you_mean, *column;
    uint64_t row; // of a table
} ReplyFault;
typedef struct ReplyFaults {
    ReplyFault *at;
    size_t count;
} ReplyFaults;

// A problem document (RFC 9457).
typedef struct ProblemReply {
    char *type, *title, *detail;
    ReplyFaults errors;
    uint64_t more;
} ProblemReply;

typedef struct ReviewReply {
    bool self_approved;
} ReviewReply;
typedef struct NameReply {
    char *name;
} NameReply;
typedef struct NameReplies {
    NameReply *at;
    size_t count;
} NameReplies;

// The members that commands use of any answer: of a problem, a job, a revision, a record and a list
// of records. Unknown members are skipped, missing ones are absent: the server may be newer, older
// or no impactd. Texts have no control characters.
typedef struct ApiReply {
    ProblemReply self;
    char *id, *status, *result;
    double progress;      // [%]
    ProblemReply problem; // of a failed job
    char *slug;
    uint64_t revision;
    ReviewReply review;
    char *name, *layout;
    double interval, peak, peak_time; // [s], [m/s^2]
    uint64_t count;
    ReplyFaults warnings;
    NameReplies records;
} ApiReply;

// A call of a command. The client, body, answer and reply are closed at its end.
typedef struct ApiCall {
    ApiClient client;
    const struct ApiAction *action;
    const void *settings;
    const char *const *operands; // after the action's name
    size_t count;
    char id[96]; // of the job that was sent
    Bytes body;  // of the next request
    ApiAnswer answer;
    ApiReply reply;
    size_t rows; // of the longest table that was printed; SIZE_MAX for JSON
} ApiCall;

// Sends a request, again after each 503 and 429 when Retry-After is over and while the wait lasts,
// and clears its path. STATUS_OK for 200, 201, 202 and 204 only; the problem document of other
// codes is in `problem`. STATUS_UNREACHABLE: no answer, or not in HTTP. The answer replaces the
// earlier one.
Status api_ask(ApiCall *call, ApiRequest *request, Problem *problem);
Status api_get(ApiCall *call, Bytes path, Problem *problem);
// Reads the answer into the call's reply, until the next one is read.
const ApiReply *api_reply(ApiCall *call);

// Prints the body as it came.
void api_print(const ApiCall *call);
// The same, or without --json as tables.
Status api_print_tables(ApiCall *call, const PrintTableView *view, Problem *problem);

typedef struct ApiAction {
    const char *name;  // the first operand; NULL: the command has this action alone
    const char *takes; // its operands, for a message
    size_t min, max;   // their number
    Status (*act)(ApiCall *call, Problem *problem);
    size_t ids;         // the first operands, which must be ids
    const char *detail; // for an `act` of several actions; may be NULL
} ApiAction;

// Runs one of the actions of `self` on settings that begin with a ClientSettings. Prints the reason
// of a failure on stderr; returns the exit code.
int api_command(const Command *self, void *settings, const Options *options, Problem *problem);

// Writes the body of the answer to a file, completely or not at all; NULL: to standard output.
Status api_download(ApiCall *call, ApiRequest *request, const char *path, Problem *problem);

// An id as the API has them; other texts are not put into a path.
bool api_is_id(const char *text);

// STATUS_UNREACHABLE: the response is not what impactd sends.
Status api_unexpected(const char *wanted, Problem *problem);

// A path of a request, limited in size.
Bytes api_path(const char *format, ...) __attribute__((format(printf, 1, 2)));
// Appends "?name=value", "&name=value" to a path with a query; nothing if `value` is NULL.
void api_query(Bytes *path, const char *name, const char *value);
// The same for the rows `names` ("q kind status") of `settings` that are not absent; a flag is 1.
void api_query_rows(Bytes *path, const Field *fields, const void *settings, const char *names);

// Adds the faults of the document to `problem`, with `status`.
void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem);

#endif
