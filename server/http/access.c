#include "server/http/access.h"

#include <string.h>

#include "server/util/clock.h"
#include "server/util/log.h"

const char *const log_mode_names[] = {"off", "errors", "all", NULL};

Status access_authorize(const AccessControl *access, const char *scope, Request *request,
                        Problem *problem) {
    request->client = NULL;
    if (access == NULL || access->tokens == NULL || strcmp(scope, "open") == 0)
        return STATUS_OK;
    TRY(tokens_check(access->tokens, request->authorization, scope, &request->holder, problem));
    request->client = request->holder.name[0] != '\0' ? request->holder.name : NULL;
    return STATUS_OK;
}

Status access_owns(const Request *request, const char *owner, const char *what, Problem *problem) {
    if (request->client == NULL || request->holder.is_admin || owner == NULL ||
        strcmp(owner, request->client) == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_FORBIDDEN,
                       "%s is of the token \"%s\": that alone or one of the scope \"admin\" may do "
                       "this, and this one is \"%s\"",
                       what, owner, request->client);
}

static void write_line(const Request *request, const Reply *reply, int64_t ns, uint64_t sent) {
    enum { PATH_SHOWN = 200, NAME_SHOWN = 80 };
    char now[32];
    Bytes line = {.most = 4096};
    clock_rfc3339(clock_unix_ms(), now);
    bytes_text(&line, now);
    log_put(&line, "request", request->id, NAME_SHOWN);
    log_put(&line, "client", request->client, NAME_SHOWN);
    log_put(&line, "method", request->method, NAME_SHOWN);
    // Without the query: people put there what should not stand in a journal.
    log_put(&line, "path", request->path, PATH_SHOWN);
    bytes_format(&line, " code=%d ms=%.3f sent=%llu", reply->code, 1e-6 * (double)ns,
                 (unsigned long long)sent);
    log_write(&line);
    bytes_clear(&line);
}

void access_log(const AccessControl *access, const Request *request, const Reply *reply) {
    if (access == NULL)
        return;
    const int64_t ns = clock_monotonic_ns() - request->started_ns;
    const bool is_stream = reply->stream.next != NULL;
    const uint64_t sent = !is_stream                         ? reply->body_size
                          : reply->stream.size != UINT64_MAX ? reply->stream.size
                                                             : 0;
    if (access->request_metrics != NULL)
        request_metrics_count(access->request_metrics, request->route, reply->code, ns,
                              request->received, sent);
    const int code = reply->code;
    const bool is_fault = code >= 500 && code != 501 && code != 503 && code != 505;
    if (access->journal == JOURNAL_ALL || (access->journal == JOURNAL_ERRORS && is_fault))
        write_line(request, reply, ns, sent);
}
