// What commands that ask a daemon share: where it is, patience while it is busy, watching a job.
// Not a command.
#ifndef SERVER_CLI_CLIENT_H
#define SERVER_CLI_CLIENT_H

#include "server/cli/http.h"
#include "server/cli/reply.h"
#include "server/options.h"

// First rows of every such command's options; its struct has these members. IMPACTD_SERVER,
// IMPACTD_TOKEN_FILE and IMPACTD_CA_FILE stand in for them.
#define DAEMON_ROWS(struct_type)                                                                   \
    FIELD_TEXT(struct_type, server, 2000, PRESENCE_OPTIONAL, 0,                                    \
               "URL of the daemon (IMPACTD_SERVER, else http://127.0.0.1:8080)"),                  \
        FIELD_TEXT(struct_type, token_file, 4000, PRESENCE_OPTIONAL, 0,                            \
                   "a file with the token, readable by you alone (else IMPACTD_TOKEN)"),           \
        FIELD_TEXT(struct_type, ca_file, 4000, PRESENCE_OPTIONAL, 0,                               \
                   "certificates to trust, PEM (the system's)")

typedef struct ApiClient {
    Http *http;
    int64_t until_ns; // monotonic; patience ends then
} ApiClient;

// `wait` [s]: how long a busy daemon and an unfinished job are waited for. From here on Ctrl-C ends
// the program with 130.
Status api_client_open(const char *server, const char *token_file, const char *ca_file, double wait,
                       ApiClient *daemon, Problem *problem);
void api_client_close(ApiClient *daemon);
double api_client_left(const ApiClient *daemon); // [s], at least 0

// http_ask, again after each 503 and 429 as Retry-After says. STATUS_OK for 200, 201, 202
// and 204 alone; any other code is told in `problem`. The answer is cleared by http_answer_clear in
// any case.
Status api_client_ask(ApiClient *daemon, const HttpAsk *ask, HttpAnswer *answer, Problem *problem);

// The same at `path`, which is cleared in any case.
Status api_client_request(ApiClient *daemon, HttpAsk ask, Bytes *path, HttpAnswer *answer,
                          Problem *problem);
void api_client_print(const HttpAnswer *answer); // the document as it came

// An id as the API writes them; anything else is no path's part.
bool api_client_is_id(const char *text);

// Asks for a job, at most `wait` seconds for its end.
Status api_client_job(ApiClient *daemon, const char *id, double wait, HttpAnswer *answer,
                      JobReply *job, Problem *problem);

// The result that `id` means: itself, or of a job that is finished, or is so before patience ends.
// STATUS_TIMEOUT: it goes on.
Status api_client_result(ApiClient *daemon, const char *id, char result[96], Problem *problem);

// Follows a job to its end, by its events where the server has them, else by asking again and
// again: a bar on a terminal, else lines on `lines` (NULL: none). A daemon that is started anew
// meanwhile is found again. STATUS_TIMEOUT when patience ends: the job goes on. The last answer and
// what it tells stay with the caller, who clears both.
Status api_client_follow(ApiClient *daemon, const char *id, FILE *lines, HttpAnswer *answer,
                         JobReply *job, Problem *problem);

// The exit code of a finished job; tells on stderr why it failed.
int api_client_verdict(const JobReply *job, Problem *problem);

// Everything a fault says, on stderr, under `name`; returns the exit code.
int api_client_refuse(const char *command, const char *name, Status status, const Problem *problem);

#endif
