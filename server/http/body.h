// Bodies that go through HTTP: what a request must bring, and how a Problem looks going out (RFC
// 9457). This file alone knows which HTTP status a Status is. Used by dispatch.c, listener.c and
// api/.
#ifndef SERVER_HTTP_BODY_H
#define SERVER_HTTP_BODY_H

#include "server/http/request.h"

// STATUS_UNSUPPORTED_TYPE unless the request's body is JSON by its type and not packed,
// STATUS_TOO_LARGE if it was over the limit, STATUS_UNREADABLE if there is none.
Status body_require_json(const Request *request, Problem *problem);
// The same of any type.
Status body_require(const Request *request, Problem *problem);
// STATUS_TOO_LARGE, with what lets in more than `most` bytes.
Status body_error_large(size_t most, Problem *problem);

// Makes the reply problem+json. `code` 0: encode_problem_code(problem->status). Headers already set
// in `reply` (Allow, Retry-After, Content-Range) stay. Never fails: without memory the body is a
// constant.
// `instance` and `request_id` may be NULL.
void body_problem(Reply *reply, const Problem *problem, int code, const char *instance,
                  const char *request_id);

#endif
