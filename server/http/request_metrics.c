#include "server/http/request_metrics.h"

#include <stdio.h>
#include <stdlib.h>

enum { CLASSES = 6 }; // 1xx to 5xx by their first digit; 0 never

typedef struct Row {
    Counter classes[CLASSES];
    Histogram seconds;
} Row;

struct RequestMetrics {
    const Route *table;
    size_t count;
    Counter received, sent;
    Row rows[]; // by route, and one more for requests without
};

RequestMetrics *request_metrics_new(const Route *table) {
    size_t count = 0;
    while (table[count].method != NULL)
        count++;
    RequestMetrics *request_metrics =
        calloc(1, sizeof *request_metrics + (count + 1) * sizeof request_metrics->rows[0]);
    if (request_metrics == NULL)
        return NULL;
    request_metrics->table = table;
    request_metrics->count = count;
    return request_metrics;
}

void request_metrics_free(RequestMetrics *request_metrics) {
    free(request_metrics);
}

void request_metrics_count(RequestMetrics *request_metrics, const Route *route, int code,
                           int64_t ns, uint64_t received, uint64_t sent) {
    Row *row = &request_metrics->rows[route != NULL ? (size_t)(route - request_metrics->table)
                                                    : request_metrics->count];
    counter_add(&row->classes[code / 100 > 0 && code / 100 < CLASSES ? code / 100 : 0], 1);
    histogram_add(&row->seconds, ns);
    counter_add(&request_metrics->received, received);
    counter_add(&request_metrics->sent, sent);
}

// Patterns hold nothing that a label's value would have to escape.
static void label(const RequestMetrics *request_metrics, size_t i, char target[256]) {
    const bool is_none = i == request_metrics->count;
    snprintf(target, 256, "route=\"%s\",method=\"%s\"",
             is_none ? "none" : request_metrics->table[i].pattern,
             is_none ? "any" : request_metrics->table[i].method);
}

void request_metrics_write(const RequestMetrics *request_metrics, Bytes *bytes) {
    char labels[256], all[288];
    static const char requests[] = "impactd_http_requests_total";
    static const char seconds[] = "impactd_http_request_duration_seconds";
    metrics_family(bytes, requests, "counter",
                   "Requests answered, by route, method and class of code.");
    for (size_t i = 0; i <= request_metrics->count; i++)
        for (int class = 1; class < CLASSES; class ++) {
            const uint64_t count = counter_get(&request_metrics->rows[i].classes[class]);
            if (count == 0)
                continue;
            label(request_metrics, i, labels);
            snprintf(all, sizeof all, "%s,code=\"%dxx\"", labels, class);
            metrics_count(bytes, requests, all, count);
        }
    metrics_family(bytes, seconds, "histogram",
                   "From a request's head to its answer, its waiting included.");
    for (size_t i = 0; i <= request_metrics->count; i++) {
        if (histogram_count(&request_metrics->rows[i].seconds) == 0)
            continue;
        label(request_metrics, i, labels);
        metrics_histogram(bytes, seconds, labels, &request_metrics->rows[i].seconds);
    }
    metrics_counter(bytes, "impactd_http_received_bytes_total", "Bytes of request bodies.",
                    counter_get(&request_metrics->received));
    metrics_counter(bytes, "impactd_http_sent_bytes_total",
                    "Bytes of answers' bodies before compression; streamed ones of unknown length "
                    "are not in it.",
                    counter_get(&request_metrics->sent));
}
