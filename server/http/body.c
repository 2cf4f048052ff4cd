#include "server/http/body.h"

#include <stdlib.h>
#include <strings.h>

#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/encode.h"

static const char type_problem[] = "application/problem+json";
static const char no_memory[] =
    "{\"type\": \"/problems/no-memory\", \"title\": \"Out of memory\", \"status\": 500}\n";

Status body_require_json(const Request *request, Problem *problem) {
    if (!header_type_is(request->content_type, type_json))
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be application/json, is %.60s; with curl use --json @scene.json, or "
            "-H 'Content-Type: application/json'",
            request->content_type != NULL ? request->content_type : "of no given type");
    return body_require(request, problem);
}

Status body_error_large(size_t most, Problem *problem) {
    return problem_set(problem, STATUS_TOO_LARGE,
                       "the body is larger than %zu bytes; impactd serve --max-body lets in more",
                       most);
}

Status body_require(const Request *request, Problem *problem) {
    const char *encoding = request->content_encoding;
    if (encoding != NULL && encoding[0] != '\0' && strcasecmp(encoding, "identity") != 0)
        return problem_set(problem, STATUS_UNSUPPORTED_TYPE,
                           "the body must be sent as it is, without Content-Encoding, is encoded "
                           "as %.60s",
                           encoding);
    if (request->is_too_large)
        return body_error_large(request->body_most, problem);
    if (request->body == NULL || request->body_size == 0)
        return problem_set(problem, STATUS_UNREADABLE, "there is no body; send the scene as JSON");
    return STATUS_OK;
}

void body_problem(Reply *reply, const Problem *problem, int code, const char *instance,
                  const char *request_id) {
    if (code == 0)
        code = encode_problem_code(problem->status);
    if (reply->release != NULL)
        reply->release(reply->context);
    reply->release = NULL;
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, code, instance);
    if (request_id != NULL && bytes.count > 0) {
        bytes.count--; // the closing brace
        bytes_text(&bytes, ", \"request_id\": ");
        bytes_json_string(&bytes, request_id);
        bytes_text(&bytes, "}");
    }
    bytes_text(&bytes, "\n");
    if (reply_bytes(reply, code, type_problem, &bytes, NULL) != STATUS_OK)
        reply_borrow(reply, code, type_problem, no_memory, sizeof no_memory - 1);
    if (code == 503 && reply->retry_after < 0)
        reply->retry_after = 1;
    if (code == 401)
        reply->authenticate = "Bearer realm=\"impactd\"";
    reply->etag[0] = '\0';
    reply->cache_control[0] = '\0'; // of what it would have been
    reply->accepts_ranges = false;
    reply->location[0] = '\0';
    reply->preference_applied[0] = '\0';
}
