// Additions are relaxed: a reader may see one sample's bucket and not yet its time. Buckets are
// summed up when they are written, so that adding touches one of them.
#include "server/util/metrics.h"

static const struct {
    int64_t ns;
    const char *edge; // [s]
} edges[HISTOGRAM_BUCKETS] = {
    {100000, "0.0001"},  {250000, "0.00025"}, {500000, "0.0005"},  {1000000, "0.001"},
    {2500000, "0.0025"}, {5000000, "0.005"},  {10000000, "0.01"},  {25000000, "0.025"},
    {50000000, "0.05"},  {100000000, "0.1"},  {250000000, "0.25"}, {500000000, "0.5"},
    {1000000000, "1"},   {2500000000, "2.5"}, {5000000000, "5"},   {10000000000, "10"},
    {30000000000, "30"}, {60000000000, "60"},
};

void histogram_add(Histogram *histogram, int64_t ns) {
    int i = 0;
    while (i < HISTOGRAM_BUCKETS && ns > edges[i].ns)
        i++;
    counter_add(&histogram->buckets[i], 1);
    counter_add(&histogram->sum_ns, ns > 0 ? (uint64_t)ns : 0);
}

uint64_t histogram_count(const Histogram *histogram) {
    uint64_t count = 0;
    for (int i = 0; i <= HISTOGRAM_BUCKETS; i++)
        count += counter_get(&histogram->buckets[i]);
    return count;
}

void metrics_family(Bytes *bytes, const char *name, const char *type, const char *help) {
    bytes_format(bytes, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void metrics_put_name(Bytes *bytes, const char *name, const char *suffix,
                             const char *labels) {
    bytes_text(bytes, name);
    bytes_text(bytes, suffix);
    if (labels[0] != '\0')
        bytes_format(bytes, "{%s}", labels);
    bytes_text(bytes, " ");
}

void metrics_count(Bytes *bytes, const char *name, const char *labels, uint64_t value) {
    metrics_put_name(bytes, name, "", labels);
    bytes_format(bytes, "%llu\n", (unsigned long long)value);
}

void metrics_real(Bytes *bytes, const char *name, const char *labels, double value) {
    metrics_put_name(bytes, name, "", labels);
    bytes_real(bytes, value);
    bytes_text(bytes, "\n");
}

void metrics_histogram(Bytes *bytes, const char *name, const char *labels,
                       const Histogram *histogram) {
    uint64_t count = 0;
    const char *comma = labels[0] != '\0' ? "," : "";
    for (int i = 0; i <= HISTOGRAM_BUCKETS; i++) {
        count += counter_get(&histogram->buckets[i]);
        bytes_format(bytes, "%s_bucket{%s%sle=\"%s\"} %llu\n", name, labels, comma,
                     i < HISTOGRAM_BUCKETS ? edges[i].edge : "+Inf", (unsigned long long)count);
    }
    metrics_put_name(bytes, name, "_sum", labels);
    bytes_real(bytes, 1e-9 * (double)counter_get(&histogram->sum_ns));
    bytes_text(bytes, "\n");
    metrics_put_name(bytes, name, "_count", labels);
    bytes_format(bytes, "%llu\n", (unsigned long long)count);
}

void metrics_counter(Bytes *bytes, const char *name, const char *help, uint64_t value) {
    metrics_family(bytes, name, "counter", help);
    metrics_count(bytes, name, "", value);
}

void metrics_gauge(Bytes *bytes, const char *name, const char *help, double value) {
    metrics_family(bytes, name, "gauge", help);
    metrics_real(bytes, name, "", value);
}
