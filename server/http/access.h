// Who may send a request, and what is recorded of it: a route's scope against the request's token;
// counters by route and perhaps one line of the log for each answer.
#ifndef SERVER_HTTP_ACCESS_H
#define SERVER_HTTP_ACCESS_H

#include "server/auth/tokens.h"
#include "server/http/request.h"
#include "server/util/metrics.h"

typedef enum LogMode {
    LOG_OFF,
    LOG_ERRORS, // answers of 500 and more, except those that ask to come back later
    LOG_ALL,
} LogMode;
extern const char *const log_mode_names[];

// Requests by route, method and class of code, with times and bytes.
typedef struct RequestMetrics RequestMetrics;

// NULL without memory. Borrows `table`, which ends with method == NULL.
RequestMetrics *request_metrics_new(const Route *table);
void request_metrics_free(RequestMetrics *metrics);
// In the Prometheus text format; routes without requests are left out.
void request_metrics_write(const RequestMetrics *metrics, Bytes *bytes);

typedef struct AccessControl {
    Tokens *tokens;
    RequestMetrics *request_metrics;
    LogMode log_mode;
} AccessControl;

// Whether the request may use a route of this scope ("open": without a token); sets
// request->client. STATUS_UNAUTHORIZED, STATUS_FORBIDDEN.
Status access_authorize(const AccessControl *access, const char *scope, Request *request,
                        Problem *problem);

// Whether an admitted request may change what `owner` (a token's name; NULL: made without a token)
// made: its own, what has no owner, and everything with the scope admin or without tokens.
// STATUS_FORBIDDEN names the owner of `what` ("the job j-7f3a").
Status access_owns(const Request *request, const char *owner, const char *what, Problem *problem);

// Once for each answer, when it is ready to be sent; request->route may be NULL.
void access_record(const AccessControl *access, const Request *request, const Reply *reply);

#endif
