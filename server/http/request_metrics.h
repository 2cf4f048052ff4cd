// What is counted of requests: by route, method and class of code, with times and bytes. Not the
// journal and not other rooms' counters. Used by dispatch.c and api/metrics.c.
#ifndef SERVER_HTTP_REQUEST_METRICS_H
#define SERVER_HTTP_REQUEST_METRICS_H

#include "server/http/route.h"
#include "server/util/metrics.h"

typedef struct Meter Meter;

// NULL without memory. Borrows `table`, which ends with method == NULL.
Meter *meter_new(const Route *table);
void meter_free(Meter *meter);

// `route` NULL: a request that no route fits, or that was refused by its head.
void meter_count(Meter *meter, const Route *route, int code, int64_t ns, uint64_t received,
                 uint64_t sent);
// In the Prometheus text format; routes that were never asked for are left out.
void meter_write(const Meter *meter, Bytes *bytes);

#endif
