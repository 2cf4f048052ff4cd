#include "server/http/body.h"

#include <stdlib.h>

#include "server/codec/write.h"
#include "server/http/header.h"
#include "server/http/reply.h"

static const char type_problem[] = "application/problem+json";
static const char no_memory[] =
    "{\"type\": \"/problems/no-memory\", \"title\": \"Out of memory\", \"status\": 500}\n";

int body_code(Status status) {
    // clang-format off
    static const int codes[STATUS_COUNT] = {
        [STATUS_OK] = 200,             [STATUS_UNREADABLE] = 400,     [STATUS_INVALID] = 422,
        [STATUS_USAGE] = 400,          [STATUS_TOO_LARGE] = 413,      [STATUS_UNSUPPORTED_TYPE] = 415,
        [STATUS_NOT_ACCEPTABLE] = 406, [STATUS_UNAUTHORIZED] = 401,   [STATUS_FORBIDDEN] = 403,
        [STATUS_NOT_FOUND] = 404,      [STATUS_METHOD] = 405,         [STATUS_CONFLICT] = 409,
        [STATUS_GONE] = 410,           [STATUS_TIMEOUT] = 504,        [STATUS_BUSY] = 503,
        [STATUS_CANCELLED] = 409,      [STATUS_LIMIT] = 422,          [STATUS_UNSTABLE] = 500,
        [STATUS_NO_MEMORY] = 500,      [STATUS_IO] = 500,             [STATUS_INTERNAL] = 500,
    };
    // clang-format on
    return (size_t)status < COUNT(codes) && codes[status] != 0 ? codes[status] : 500;
}

Status body_require_json(const Request *request, Problem *problem) {
    if (!header_type_is(request->content_type, type_json))
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be application/json, is %.60s; with curl use --json @scene.json, or "
            "-H 'Content-Type: application/json'",
            request->content_type != NULL ? request->content_type : "of no given type");
    if (request->is_too_large)
        return problem_set(problem, STATUS_TOO_LARGE, "the body is larger than %zu bytes",
                           request->body_most);
    if (request->body == NULL || request->body_size == 0)
        return problem_set(problem, STATUS_UNREADABLE, "there is no body; send the scene as JSON");
    return STATUS_OK;
}

void body_problem(Reply *reply, const Problem *problem, int code, const char *instance) {
    if (code == 0)
        code = body_code(problem->status);
    if (reply->release != NULL)
        reply->release(reply->context);
    reply->release = NULL;
    Bytes bytes = {.most = 1 << 20};
    write_problem(&bytes, problem, code, instance);
    bytes_text(&bytes, "\n");
    if (reply_bytes(reply, code, type_problem, &bytes, NULL) != STATUS_OK)
        reply_borrow(reply, code, type_problem, no_memory, sizeof no_memory - 1);
    if (code == 503 && reply->retry_after < 0)
        reply->retry_after = 1;
    reply->etag[0] = '\0';
    reply->accepts_ranges = false;
    reply->location[0] = '\0';
}
