#include "server/http/access.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/util/clock.h"
#include "server/util/process.h"

const char *const log_mode_names[] = {"off", "errors", "all", NULL};

// The handlers of these routes check the sender of the job.
static bool access_is_for_sender(const Route *route) {
    return route != NULL && strcmp(route->method, "GET") == 0 &&
           (strcmp(route->pattern, "/v1/jobs/{id}") == 0 ||
            strcmp(route->pattern, "/v1/jobs/{id}/events") == 0);
}

Status access_authorize(const AccessControl *access, const char *scope, Request *request,
                        Problem *problem) {
    request->client = NULL;
    request->is_sender_only = false;
    if (strcmp(scope, "open") == 0)
        return STATUS_OK;
    const Status status =
        tokens_check(access->tokens, request->authorization, scope, &request->holder, problem);
    if (status == STATUS_FORBIDDEN && access_is_for_sender(request->route) &&
        tokens_check(access->tokens, request->authorization, "submit", &request->holder, NULL) ==
            STATUS_OK) {
        problem_clear(problem);
        request->is_sender_only = true;
    } else if (status != STATUS_OK) {
        return status;
    }
    request->client = request->holder.name[0] != '\0' ? request->holder.name : NULL;
    return STATUS_OK;
}

Status access_owns(const Request *request, const char *owner, const char *what, Problem *problem) {
    if (request->client == NULL || request->holder.is_admin || owner == NULL ||
        strcmp(owner, request->client) == 0)
        return STATUS_OK;
    return problem_set(
        problem, STATUS_FORBIDDEN,
        "%s belongs to the token \"%s\": only that token or one of the scope \"admin\" "
        "may do this, and this one is \"%s\"",
        what, owner, request->client);
}

enum { CLASSES = 6 }; // 1xx to 5xx by their first digit; 0 never

typedef struct RouteMetrics {
    Counter classes[CLASSES];
    Histogram seconds;
} RouteMetrics;

struct RequestMetrics {
    const Route *table;
    size_t count;
    Counter received, sent;
    RouteMetrics rows[]; // by route, and one more for requests without
};

RequestMetrics *request_metrics_new(const Route *table) {
    size_t count = 0;
    while (table[count].method != NULL)
        count++;
    RequestMetrics *metrics = calloc(1, sizeof *metrics + (count + 1) * sizeof metrics->rows[0]);
    if (metrics == NULL)
        return NULL;
    metrics->table = table;
    metrics->count = count;
    return metrics;
}

void request_metrics_free(RequestMetrics *metrics) {
    free(metrics);
}

static void request_metrics_count(RequestMetrics *metrics, const Route *route, int code, int64_t ns,
                                  uint64_t received, uint64_t sent) {
    RouteMetrics *row =
        &metrics->rows[route != NULL ? (size_t)(route - metrics->table) : metrics->count];
    counter_add(&row->classes[code / 100 % CLASSES], 1);
    histogram_add(&row->seconds, ns);
    counter_add(&metrics->received, received);
    counter_add(&metrics->sent, sent);
}

// Patterns hold nothing that a label's value would have to escape.
static void request_metrics_label(const RequestMetrics *metrics, size_t i, char target[256]) {
    const bool is_none = i == metrics->count;
    snprintf(target, 256, "route=\"%s\",method=\"%s\"",
             is_none ? "none" : metrics->table[i].pattern,
             is_none ? "any" : metrics->table[i].method);
}

void request_metrics_write(const RequestMetrics *metrics, Bytes *bytes) {
    char labels[256], all[288];
    static const char requests[] = "impactd_http_requests_total";
    static const char seconds[] = "impactd_http_request_duration_seconds";
    metrics_family(bytes, requests, "counter",
                   "Requests answered, by route, method and class of code.");
    for (size_t i = 0; i <= metrics->count; i++)
        for (int class = 1; class < CLASSES; class ++) {
            const uint64_t count = counter_get(&metrics->rows[i].classes[class]);
            if (count == 0)
                continue;
            request_metrics_label(metrics, i, labels);
            snprintf(all, sizeof all, "%s,code=\"%dxx\"", labels, class);
            metrics_count(bytes, requests, all, count);
        }
    metrics_family(bytes, seconds, "histogram",
                   "From a request's head to its answer, its waiting included.");
    for (size_t i = 0; i <= metrics->count; i++) {
        if (histogram_count(&metrics->rows[i].seconds) == 0)
            continue;
        request_metrics_label(metrics, i, labels);
        metrics_histogram(bytes, seconds, labels, &metrics->rows[i].seconds);
    }
    metrics_counter(bytes, "impactd_http_received_bytes_total", "Bytes of request bodies.",
                    counter_get(&metrics->received));
    metrics_counter(bytes, "impactd_http_sent_bytes_total",
                    "Bytes of answers' bodies before compression; streamed ones of unknown length "
                    "are not in it.",
                    counter_get(&metrics->sent));
}

static void access_log(const Request *request, const Reply *reply, int64_t ns, uint64_t sent) {
    enum { PATH_SHOWN = 200, NAME_SHOWN = 80 };
    Bytes line = {.most = 4096};
    bytes_text(&line, clock_rfc3339(clock_unix_ms()).at);
    log_put(&line, "request", request->id, NAME_SHOWN);
    log_put(&line, "client", request->client, NAME_SHOWN);
    log_put(&line, "method", request->method, NAME_SHOWN);
    // Without the query, which may hold what should not be in a log.
    log_put(&line, "path", request->path, PATH_SHOWN);
    bytes_format(&line, " code=%d ms=%.3f sent=%llu", reply->code, 1e-6 * (double)ns,
                 (unsigned long long)sent);
    log_write(&line);
    bytes_clear(&line);
}

void access_record(const AccessControl *access, const Request *request, const Reply *reply) {
    const int64_t ns = clock_monotonic_ns() - request->started_ns;
    const bool is_stream = reply->stream.next != NULL;
    const uint64_t sent = !is_stream                         ? reply->body_size
                          : reply->stream.size != UINT64_MAX ? reply->stream.size
                                                             : 0;
    request_metrics_count(access->request_metrics, request->route, reply->code, ns,
                          request->received, sent);
    const int code = reply->code;
    const bool is_fault = code >= 500 && code != 501 && code != 503 && code != 505;
    if (access->log_mode == LOG_ALL || (access->log_mode == LOG_ERRORS && is_fault))
        access_log(request, reply, ns, sent);
}
