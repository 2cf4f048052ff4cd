// Who comes in and what is noted of it: a route's scope against the request's token, one count and
// perhaps one line per answer. Not which routes exist (dispatch.h) and not what heads are fit to be
// read (gate.h). Used by dispatch.c and cli/serve.c.
#ifndef SERVER_HTTP_ACCESS_H
#define SERVER_HTTP_ACCESS_H

#include "server/auth/tokens.h"
#include "server/http/request_metrics.h"

typedef enum LogMode {
    JOURNAL_OFF,
    JOURNAL_ERRORS, // answers of 500 and more, but for those that ask to come back later
    JOURNAL_ALL,
} LogMode;
extern const char *const log_mode_names[];

// All may be NULL, which is an open door that counts nothing.
typedef struct AccessControl {
    Tokens *tokens;
    RequestMetrics *request_metrics;
    LogMode journal;
} AccessControl;

// Whether the request may use a route of this scope ("open": whoever it is); request->client
// becomes who it is. STATUS_UNAUTHORIZED, STATUS_FORBIDDEN.
Status access_authorize(const AccessControl *access, const char *scope, Request *request,
                        Problem *problem);

// Whether an admitted request may undo what `owner` (a token's name; NULL: nobody in particular)
// made: its own and nobody's, all with the scope admin or where no tokens are asked for.
// STATUS_FORBIDDEN says of `what` ("the job j-7f3a") whose it is.
Status access_owns(const Request *request, const char *owner, const char *what, Problem *problem);

// Once per answer, when it is ready to be sent; request->route may be NULL.
void access_log(const AccessControl *access, const Request *request, const Reply *reply);

#endif
