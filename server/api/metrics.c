// GET /metrics: counters and gauges of all modules in the Prometheus text format, version 0.0.4.
#include "server/api/app.h"
#include "server/http/access.h"
#include "server/http/response_cache.h"
#include "server/http/server.h"
#include "server/util/process.h"

// Caches, in the order in which they are asked.
static void metrics_write_layers(Bytes *bytes, const JobStats *stats) {
    const struct {
        const char *label;
        const CacheStats *layer;
    } layers[] = {{"layer=\"documents\"", &stats->heads},
                  {"layer=\"series\"", &stats->series},
                  {"layer=\"results\"", &stats->rows},
                  {"layer=\"stored_series\"", &stats->stored}};
    static const char *const families[][3] = {
        {"impactd_cache_hits_total", "counter", "Lookups that found a cached result, by layer."},
        {"impactd_cache_misses_total", "counter", "Lookups that found none, by layer."},
        {"impactd_cache_evictions_total", "counter", "What made room for others, by layer."},
        {"impactd_cache_layer_bytes", "gauge", "What a layer takes, in memory or on disk."}};
    for (size_t k = 0; k < COUNT(families); k++) {
        metrics_family(bytes, families[k][0], families[k][1], families[k][2]);
        for (size_t i = 0; i < COUNT(layers); i++) {
            const CacheStats *layer = layers[i].layer;
            const uint64_t values[] = {layer->hits, layer->misses, layer->evictions, layer->bytes};
            metrics_count(bytes, families[k][0], layers[i].label, values[k]);
        }
    }
}

static void metrics_write_queue(Bytes *bytes, App *app) {
    JobStats metrics;
    cache_tally_all(app, &metrics);
    metrics_write_layers(bytes, &metrics);
    metrics_gauge(bytes, "impactd_queue_length", "Computations that wait.", (double)metrics.queued);
    metrics_gauge(bytes, "impactd_queue_limit", "Unfinished jobs at most.",
                  (double)metrics.queue_most);
    metrics_gauge(bytes, "impactd_workers", "Computations at once at most.",
                  (double)metrics.workers);
    metrics_gauge(bytes, "impactd_workers_busy", "Computations under way.",
                  (double)metrics.running);
    metrics_gauge(bytes, "impactd_cache_outcomes", "Results in memory with their series.",
                  (double)metrics.cached_outcomes);
    metrics_gauge(bytes, "impactd_cache_bytes", "Memory of these results.",
                  (double)metrics.cached_bytes);
}

// Whole answers that are kept ready to be sent.
static void metrics_write_responses(Bytes *bytes, ResponseCache *response_cache) {
    const LruStats metrics = response_cache_stats(response_cache);
    metrics_gauge(bytes, "impactd_reply_cache_entries", "Answers kept whole.",
                  (double)metrics.count);
    metrics_gauge(bytes, "impactd_reply_cache_bytes", "Memory of these answers.",
                  (double)metrics.bytes);
    metrics_counter(bytes, "impactd_reply_cache_hits_total", "Requests answered by these.",
                    metrics.hits);
    metrics_counter(bytes, "impactd_reply_cache_misses_total",
                    "Lookups of a reply that was not cached.", metrics.misses);
    metrics_counter(bytes, "impactd_reply_cache_evictions_total", "Answers that made room.",
                    metrics.evictions);
}

static void metrics_write_db(Bytes *bytes, Db *db) {
    const DbStats *totals = db_stats(db);
    metrics_counter(bytes, "impactd_sqlite_transactions_total", "Transactions that were committed.",
                    histogram_count(&totals->commits));
    metrics_counter(bytes, "impactd_sqlite_writes_total",
                    "Writes in these transactions, many of which may share one.",
                    counter_get(&totals->writes));
    metrics_counter(bytes, "impactd_sqlite_rows_total", "Rows inserted, changed or deleted.",
                    counter_get(&totals->rows));
    metrics_counter(bytes, "impactd_sqlite_errors_total", "Transactions that failed.",
                    counter_get(&totals->errors));
    static const char commits[] = "impactd_sqlite_transaction_seconds";
    metrics_family(bytes, commits, "histogram",
                   "From a transaction's beginning until it is durable.");
    metrics_histogram(bytes, commits, "", &totals->commits);
}

static void metrics_write_process(Bytes *bytes, const App *app) {
    ProcessFacts facts;
    process_facts(&facts);
    metrics_gauge(bytes, "process_resident_memory_bytes", "Resident memory.",
                  (double)facts.resident_bytes);
    metrics_gauge(bytes, "process_open_fds", "Open file descriptors.", (double)facts.open_files);
    metrics_gauge(bytes, "process_max_fds", "File descriptors at most.",
                  (double)facts.open_files_most);
    metrics_gauge(bytes, "process_start_time_seconds", "When it started, since 1970.",
                  1e-3 * (double)app->started_unix_ms);
    metrics_family(bytes, "process_cpu_seconds_total", "counter", "CPU time, user and system.");
    metrics_real(bytes, "process_cpu_seconds_total", "", facts.cpu_seconds);
}

Status metrics_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    Bytes bytes = {.most = 4 << 20};
    metrics_family(&bytes, "impactd_build_info", "gauge", "The program's version; always 1.");
    bytes_format(&bytes, "impactd_build_info{version=\"%s\"} 1\n", program_version);
    request_metrics_write(app->request_metrics, &bytes);
    const Server *server = atomic_load(&app->server);
    if (server != NULL)
        metrics_gauge(&bytes, "impactd_http_connections", "Clients connected.",
                      (double)server_connections(server));
    metrics_write_responses(&bytes, app->response_cache);
    metrics_write_queue(&bytes, app);
    jobs_write_metrics(app->manager, &bytes);
    metrics_write_db(&bytes, app->db);
    metrics_write_process(&bytes, app);
    return reply_bytes(reply, 200, "text/plain; version=0.0.4; charset=utf-8", &bytes, problem);
}
