// GET /metrics: counters and gauges of all rooms in the Prometheus text format, version 0.0.4.
#include "server/api/app.h"
#include "server/http/reply.h"
#include "server/http/request_metrics.h"
#include "server/http/response_cache.h"
#include "server/http/server.h"
#include "server/jobs/job_metrics.h"
#include "server/util/process.h"

// What is known already, by layer in the order in which they are asked.
static void write_layers(Bytes *bytes, const JobStats *tally, Db *store) {
    CacheStats stored = tally->stored;
    uint64_t count = 0, size = 0;
    db_series_tally(store, &count, &size, &stored.evictions);
    stored.count = count;
    stored.bytes = size;
    const struct {
        const char *label;
        const CacheStats *layer;
    } layers[] = {{"layer=\"documents\"", &tally->heads},
                  {"layer=\"series\"", &tally->series},
                  {"layer=\"results\"", &tally->rows},
                  {"layer=\"stored_series\"", &stored}};
    static const char hits[] = "impactd_cache_hits_total", misses[] = "impactd_cache_misses_total",
                      evictions[] = "impactd_cache_evictions_total",
                      bytes_kept[] = "impactd_cache_layer_bytes";
    metrics_family(bytes, hits, "counter", "Looks that found what was known, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        metrics_count(bytes, hits, layers[i].label, layers[i].layer->hits);
    metrics_family(bytes, misses, "counter", "Looks that did not, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        metrics_count(bytes, misses, layers[i].label, layers[i].layer->misses);
    metrics_family(bytes, evictions, "counter", "What made room for others, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        metrics_count(bytes, evictions, layers[i].label, layers[i].layer->evictions);
    metrics_family(bytes, bytes_kept, "gauge", "What a layer takes, in memory or on disk.");
    for (size_t i = 0; i < COUNT(layers); i++)
        metrics_real(bytes, bytes_kept, layers[i].label, (double)layers[i].layer->bytes);
}

static void write_queue(Bytes *bytes, JobManager *intake, Db *store) {
    JobStats tally = {0};
    jobs_tally(intake, &tally);
    write_layers(bytes, &tally, store);
    metrics_gauge(bytes, "impactd_queue_length", "Computations that wait.", (double)tally.queued);
    metrics_gauge(bytes, "impactd_queue_limit", "Unfinished jobs at most.",
                  (double)tally.queue_most);
    metrics_gauge(bytes, "impactd_workers", "Computations at once at most.", (double)tally.workers);
    metrics_gauge(bytes, "impactd_workers_busy", "Computations under way.", (double)tally.running);
    metrics_gauge(bytes, "impactd_cache_outcomes", "Results in memory with their series.",
                  (double)tally.cached_outcomes);
    metrics_gauge(bytes, "impactd_cache_bytes", "Memory of these results.",
                  (double)tally.cached_bytes);
}

// Whole answers that are kept ready to be sent.
static void write_hot(Bytes *bytes, ResponseCache *hot) {
    const ResponseCacheStats tally = response_cache_tally(hot);
    metrics_gauge(bytes, "impactd_reply_cache_entries", "Answers kept whole.", (double)tally.count);
    metrics_gauge(bytes, "impactd_reply_cache_bytes", "Memory of these answers.",
                  (double)tally.bytes);
    metrics_counter(bytes, "impactd_reply_cache_hits_total", "Requests answered by these.",
                    tally.hits);
    metrics_counter(bytes, "impactd_reply_cache_misses_total",
                    "Looks for an answer that was not there.", tally.misses);
    metrics_counter(bytes, "impactd_reply_cache_evictions_total", "Answers that made room.",
                    tally.evictions);
}

static void write_store(Bytes *bytes, Db *store) {
    const DbStats *totals = db_totals(store);
    metrics_counter(bytes, "impactd_sqlite_transactions_total", "Transactions that were committed.",
                    histogram_count(&totals->commits));
    metrics_counter(bytes, "impactd_sqlite_writes_total",
                    "Writes in these transactions, many of which may share one.",
                    counter_get(&totals->writes));
    metrics_counter(bytes, "impactd_sqlite_rows_total", "Rows inserted, changed or deleted.",
                    counter_get(&totals->rows));
    metrics_counter(bytes, "impactd_sqlite_errors_total", "Transactions that came to nothing.",
                    counter_get(&totals->errors));
    static const char commits[] = "impactd_sqlite_transaction_seconds";
    metrics_family(bytes, commits, "histogram",
                   "From a transaction's beginning until it is durable.");
    metrics_histogram(bytes, commits, "", &totals->commits);
}

static void write_process(Bytes *bytes, const App *app) {
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
    if (app->meter != NULL)
        request_metrics_write(app->meter, &bytes);
    const Server *listener = atomic_load(&app->listener);
    if (listener != NULL)
        metrics_gauge(&bytes, "impactd_http_connections", "Clients connected.",
                      (double)server_connections(listener));
    if (app->hot != NULL)
        write_hot(&bytes, app->hot);
    write_queue(&bytes, app->intake, app->store);
    job_metrics_write(jobs_totals(app->intake), &bytes);
    write_store(&bytes, app->store);
    write_process(&bytes, app);
    return reply_bytes(reply, 200, "text/plain; version=0.0.4; charset=utf-8", &bytes, problem);
}
