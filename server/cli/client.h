// The frame of the commands that ask a server: their actions and operands, requests, answers,
// problem documents. The server is not trusted: its headers and bodies are bounded, redirects to
// other servers are not followed, TLS is verified.
#ifndef SERVER_CLI_CLIENT_H
#define SERVER_CLI_CLIENT_H

#include "server/cli/command.h"
#include "server/json/document.h"
#include "server/json/table.h"

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

typedef struct ApiCall ApiCall;

typedef struct ApiAction {
    const char *name;  // the first operand; NULL: the command has this action alone
    const char *takes; // its operands, for a message
    // A letter for each operand: i an id, s SLUG, r SLUG or SLUG@REVISION, v SLUG@REVISION,
    // n a whole number from 1, t the name of a record, p a part of a result, f a file; those behind
    // "?" may be missing.
    const char *operands;
    Status (*act)(ApiCall *call, Problem *problem); // such as api_show
    // The request of the action, for api_send and api_show.
    const char *method; // NULL: GET
    const char *path; // {} is the next operand; it ends before a parameter whose operand is missing
    const char *query;  // options that are sent as they are named: "q kind"
    const char *needs;  // an option that must be given; NULL: none
    const char *detail; // for an `act` of several actions
    const char *list;   // the list that each page of the answer has; NULL: none
} ApiAction;

typedef struct ApiAnswer {
    int code;
    char etag[256];  // a strong one with its quotes; "" for none
    char next[1024]; // query of the next page, "?limit=10&before=7"; "": none
    int retry_after; // [s]; 0: none
    Bytes body;
} ApiAnswer;

// A call of a command.
struct ApiCall {
    const Command *command;
    const ApiAction *action;
    const void *settings;        // begin with a ClientSettings
    const char *const *operands; // after the action's name
    size_t count;
    const char *about; // what messages of failures name
    void *curl;        // the handle keeps the connection between requests
    char *url;
    char token[640]; // "": none
    bool is_loopback, is_tls;
    long answer_ms;      // that an answer may take; 0: the usual
    int64_t until_ns;    // monotonic; end of the wait
    char id[96];         // of the job that was sent
    Bytes body;          // of the next POST
    ApiAnswer answer;    // to the last request
    JsonDocument *reply; // of the answer, by api_reply
};

typedef struct ApiRequest {
    const char *method;          // NULL: GET; POST sends the body of the call
    Bytes path;                  // "/v1/jobs?dry_run=1"
    const char *content_type;    // of the body; NULL: JSON
    const char *if_match;        // NULL: not sent
    const char *prefer;          // NULL: not sent
    const char *idempotency_key; // NULL: not sent
    // > 0: the body of a 200 of at most this size goes to the open output, and one that is cut off
    // is continued once. 0: the body is kept.
    uint64_t output_max;
    const char *type; // Content-Type that such a body must have; NULL: any
} ApiRequest;

// Runs one of the actions of `self` on settings that begin with a ClientSettings. Prints the reason
// of a failure on stderr; returns the exit code.
int api_command(const Command *self, void *settings, const Options *options, Problem *problem);

// The letter of an operand of an action; '\0' if it takes fewer.
char api_operand_kind(const ApiAction *action, size_t index);
// For completion: prints the names in members of the objects of the list in the answer to `path`;
// no other text, and nothing without an answer in 0.3 s. `members` ends with NULL.
void api_print_names(const Command *self, void *settings, const char *path, const char *list,
                     const char *const *members, Problem *problem);

// Prepares the call of the settings; connects to nothing yet. From here on Ctrl-C ends the program
// with 130. STATUS_USAGE says what is wrong with the URL or the token. api_close in any case.
Status api_open(ApiCall *call, Problem *problem);
void api_close(ApiCall *call);
// Whether the token travels unencrypted to another machine.
bool api_exposes_token(const ApiCall *call);
double api_left(const ApiCall *call); // [s] of the wait, at least 0

// Sends a request, again after each 503 and 429 when Retry-After is over and while the wait lasts,
// and clears its path. STATUS_OK for 200, 201, 202 and 204 only; the problem document of other
// codes is in `problem`. STATUS_UNREACHABLE: no answer, or not in HTTP. The answer replaces the
// earlier one.
Status api_ask(ApiCall *call, ApiRequest *request, Problem *problem);
Status api_get(ApiCall *call, Bytes path, Problem *problem);
// Sends the request of the action.
Status api_send(ApiCall *call, Problem *problem);
// The same, and adds up to `more` pages that follow to the answer.
Status api_send_pages(ApiCall *call, size_t more, Problem *problem);
// Sends the request and prints all pages of the answer.
Status api_show(ApiCall *call, Problem *problem);
// Writes the body of the answer to a file, completely or not at all; NULL: to standard output.
Status api_download(ApiCall *call, ApiRequest *request, const char *path, Problem *problem);

// Reads the answer, until the next one is read; NULL: it is no object.
const JsonDocument *api_reply(ApiCall *call);
// Prints the answer as it came.
Status api_print(const ApiCall *call, Problem *problem);
// Prints the answer as tables by the view of the command or, with --json or without a view, as it
// came.
Status api_print_tables(ApiCall *call, Problem *problem);
// STATUS_UNREACHABLE: the answer is not what impactd sends.
Status api_unexpected(const ApiCall *call, const char *wanted, Problem *problem);
// Adds the faults of a problem document (RFC 9457) to `problem`, with `status`.
void api_add_faults(const JsonDocument *document, Status status, Problem *problem);

// An id as the API has them; other texts are not put into a path.
bool api_is_id(const char *text);
// A path of a request, limited in size.
Bytes api_path(const char *format, ...) __attribute__((format(printf, 1, 2)));
// The path of the action with its operands.
Bytes api_action_path(const ApiCall *call);
// Appends "?name=value", "&name=value" to a path with a query; nothing if `value` is NULL.
void api_query(Bytes *path, const char *name, const char *value);
// The same for the options `names` ("q kind status") that are given; a flag is 1.
void api_query_options(Bytes *path, const ApiCall *call, const char *names);

#endif
