// What is counted of requests: by route, method and class of code, with times and bytes. Not the
// journal and not other rooms' counters. Used by dispatch.c and api/metrics.c.
#ifndef SERVER_HTTP_REQUEST_METRICS_H
#define SERVER_HTTP_REQUEST_METRICS_H

#include "server/http/route.h"
#include "server/util/metrics.h"

typedef struct RequestMetrics RequestMetrics;

// NULL without memory. Borrows `table`, which ends with method == NULL.
RequestMetrics *request_metrics_new(const Route *table);
void request_metrics_free(RequestMetrics *request_metrics);

// `route` NULL: a request that no route fits, or that was refused by its head.
void request_metrics_count(RequestMetrics *request_metrics, const Route *route, int code,
                           int64_t ns, uint64_t received, uint64_t sent);
// In the Prometheus text format; routes that were never asked for are left out.
void request_metrics_write(const RequestMetrics *request_metrics, Bytes *bytes);

#endif
