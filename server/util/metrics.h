// Counters and histograms that any thread may add to, cheap enough for every request, and how they
// are written in the Prometheus text format.
#ifndef SERVER_UTIL_METRICS_H
#define SERVER_UTIL_METRICS_H

#include <stdatomic.h>
#include <stdint.h>

#include "server/util/bytes.h"

typedef atomic_uint_fast64_t Counter; // all zero to begin with

static inline void counter_add(Counter *counter, uint64_t more) {
    atomic_fetch_add_explicit(counter, more, memory_order_relaxed);
}
static inline uint64_t counter_get(const Counter *counter) {
    return atomic_load_explicit(counter, memory_order_relaxed);
}

enum { HISTOGRAM_BUCKETS = 18 };
typedef struct Histogram {
    Counter
        buckets[HISTOGRAM_BUCKETS + 1]; // by upper edge, from 0.1 ms to a minute; the last has none
    Counter sum_ns;
} Histogram;
void histogram_add(Histogram *histogram, int64_t ns);
uint64_t histogram_count(const Histogram *histogram);

// "# HELP" and "# TYPE" of a family; its samples follow. `type`: "counter", "gauge", "histogram".
void metrics_family(Bytes *bytes, const char *name, const char *type, const char *help);
// One sample. `labels` is "" or "a=\"b\",c=\"d\"", escaped already.
void metrics_count(Bytes *bytes, const char *name, const char *labels, uint64_t value);
void metrics_real(Bytes *bytes, const char *name, const char *labels, double value);
void metrics_histogram(Bytes *bytes, const char *name, const char *labels,
                       const Histogram *histogram);
// A family of one sample.
void metrics_counter(Bytes *bytes, const char *name, const char *help, uint64_t value);
void metrics_gauge(Bytes *bytes, const char *name, const char *help, double value);

#endif
