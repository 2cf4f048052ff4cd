// GET /metrics: counters and gauges of all rooms in the Prometheus text format, version 0.0.4.
#include "server/api/app.h"
#include "server/http/reply.h"
#include "server/http/request_metrics.h"
#include "server/http/response_cache.h"
#include "server/http/server.h"
#include "server/jobs/job_metrics.h"
#include "server/util/process.h"

// What is known already, by layer in the order in which they are asked.
static void write_layers(Bytes *bytes, const IntakeTally *tally, Store *store) {
    LayerTally stored = tally->stored;
    uint64_t count = 0, size = 0;
    store_series_tally(store, &count, &size, &stored.evictions);
    stored.count = count;
    stored.bytes = size;
    const struct {
        const char *label;
        const LayerTally *layer;
    } layers[] = {{"layer=\"documents\"", &tally->heads},
                  {"layer=\"series\"", &tally->series},
                  {"layer=\"results\"", &tally->rows},
                  {"layer=\"stored_series\"", &stored}};
    static const char hits[] = "impactd_cache_hits_total", misses[] = "impactd_cache_misses_total",
                      evictions[] = "impactd_cache_evictions_total",
                      bytes_kept[] = "impactd_cache_layer_bytes";
    tally_family(bytes, hits, "counter", "Looks that found what was known, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        tally_count(bytes, hits, layers[i].label, layers[i].layer->hits);
    tally_family(bytes, misses, "counter", "Looks that did not, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        tally_count(bytes, misses, layers[i].label, layers[i].layer->misses);
    tally_family(bytes, evictions, "counter", "What made room for others, by layer.");
    for (size_t i = 0; i < COUNT(layers); i++)
        tally_count(bytes, evictions, layers[i].label, layers[i].layer->evictions);
    tally_family(bytes, bytes_kept, "gauge", "What a layer takes, in memory or on disk.");
    for (size_t i = 0; i < COUNT(layers); i++)
        tally_real(bytes, bytes_kept, layers[i].label, (double)layers[i].layer->bytes);
}

static void write_queue(Bytes *bytes, Intake *intake, Store *store) {
    IntakeTally tally = {0};
    intake_tally(intake, &tally);
    write_layers(bytes, &tally, store);
    tally_gauge(bytes, "impactd_queue_length", "Computations that wait.", (double)tally.queued);
    tally_gauge(bytes, "impactd_queue_limit", "Unfinished jobs at most.", (double)tally.queue_most);
    tally_gauge(bytes, "impactd_workers", "Computations at once at most.", (double)tally.workers);
    tally_gauge(bytes, "impactd_workers_busy", "Computations under way.", (double)tally.running);
    tally_gauge(bytes, "impactd_cache_outcomes", "Results in memory with their series.",
                (double)tally.cached_outcomes);
    tally_gauge(bytes, "impactd_cache_bytes", "Memory of these results.",
                (double)tally.cached_bytes);
}

// Whole answers that are kept ready to be sent.
static void write_hot(Bytes *bytes, Hot *hot) {
    const HotTally tally = hot_tally(hot);
    tally_gauge(bytes, "impactd_reply_cache_entries", "Answers kept whole.", (double)tally.count);
    tally_gauge(bytes, "impactd_reply_cache_bytes", "Memory of these answers.",
                (double)tally.bytes);
    tally_counter(bytes, "impactd_reply_cache_hits_total", "Requests answered by these.",
                  tally.hits);
    tally_counter(bytes, "impactd_reply_cache_misses_total",
                  "Looks for an answer that was not there.", tally.misses);
    tally_counter(bytes, "impactd_reply_cache_evictions_total", "Answers that made room.",
                  tally.evictions);
}

static void write_store(Bytes *bytes, Store *store) {
    const StoreTotals *totals = store_totals(store);
    tally_counter(bytes, "impactd_sqlite_transactions_total", "Transactions that were committed.",
                  histogram_count(&totals->commits));
    tally_counter(bytes, "impactd_sqlite_writes_total",
                  "Writes in these transactions, many of which may share one.",
                  counter_get(&totals->writes));
    tally_counter(bytes, "impactd_sqlite_rows_total", "Rows inserted, changed or deleted.",
                  counter_get(&totals->rows));
    tally_counter(bytes, "impactd_sqlite_errors_total", "Transactions that came to nothing.",
                  counter_get(&totals->errors));
    static const char commits[] = "impactd_sqlite_transaction_seconds";
    tally_family(bytes, commits, "histogram",
                 "From a transaction's beginning until it is durable.");
    tally_histogram(bytes, commits, "", &totals->commits);
}

static void write_process(Bytes *bytes, const App *app) {
    ProcessFacts facts;
    process_facts(&facts);
    tally_gauge(bytes, "process_resident_memory_bytes", "Resident memory.",
                (double)facts.resident_bytes);
    tally_gauge(bytes, "process_open_fds", "Open file descriptors.", (double)facts.open_files);
    tally_gauge(bytes, "process_max_fds", "File descriptors at most.",
                (double)facts.open_files_most);
    tally_gauge(bytes, "process_start_time_seconds", "When it started, since 1970.",
                1e-3 * (double)app->started_unix_ms);
    tally_family(bytes, "process_cpu_seconds_total", "counter", "CPU time, user and system.");
    tally_real(bytes, "process_cpu_seconds_total", "", facts.cpu_seconds);
}

Status metrics_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    Bytes bytes = {.most = 4 << 20};
    tally_family(&bytes, "impactd_build_info", "gauge", "The program's version; always 1.");
    bytes_format(&bytes, "impactd_build_info{version=\"%s\"} 1\n", program_version);
    if (app->meter != NULL)
        meter_write(app->meter, &bytes);
    const Listener *listener = atomic_load(&app->listener);
    if (listener != NULL)
        tally_gauge(&bytes, "impactd_http_connections", "Clients connected.",
                    (double)listener_connections(listener));
    if (app->hot != NULL)
        write_hot(&bytes, app->hot);
    write_queue(&bytes, app->intake, app->store);
    totals_write(intake_totals(app->intake), &bytes);
    write_store(&bytes, app->store);
    write_process(&bytes, app);
    return reply_bytes(reply, 200, "text/plain; version=0.0.4; charset=utf-8", &bytes, problem);
}
