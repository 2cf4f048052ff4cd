// The caches: how often they were used, and whether a scene is cached and in what it differs from
// the most similar cached one.
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/jobs/documents.h"
#include "server/json/document.h"

// The scenes that are compared, and how long they may be.
enum { RECENT_MAX = 256, SCENE_MAX = 16384 };

static void cache_put_layer(Bytes *bytes, const char *name, const CacheStats *layer,
                            bool has_budget) {
    bytes_json(bytes, "%p\"%s\": {\"hits\": %llu, \"misses\": %llu", bytes->count > 1 ? ", " : "",
               name, (unsigned long long)layer->hits, (unsigned long long)layer->misses);
    if (has_budget)
        bytes_json(
            bytes, ", \"evictions\": %llu, \"count\": %zu, \"bytes\": %zu, \"most_bytes\": %zu",
            (unsigned long long)layer->evictions, layer->count, layer->bytes, layer->most_bytes);
    bytes_text(bytes, "}");
}

void cache_tally_all(App *app, JobStats *stats) {
    uint64_t count, size;
    jobs_stats(app->manager, stats);
    db_series_stats(app->db, &count, &size, &stats->stored.evictions);
    stats->stored.count = count;
    stats->stored.bytes = size;
}

Status cache_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    JobStats stats;
    Bytes bytes = {.most = app->reply_most};
    cache_tally_all(app, &stats);
    bytes_text(&bytes, "{");
    cache_put_layer(&bytes, "documents", &stats.heads, true);
    cache_put_layer(&bytes, "series", &stats.series, true);
    cache_put_layer(&bytes, "results", &stats.rows, false);
    cache_put_layer(&bytes, "stored_series", &stats.stored, true);
    bytes_text(&bytes, "}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static void cache_put_nearest(Bytes *bytes, const ResultRow *row, const Bytes *differences,
                              size_t count) {
    bytes_json(bytes,
               "{\"result\": %s, \"engine\": %s, \"engine_differs\": %p, \"count\": %zu, "
               "\"differences\": %p}",
               row->id, row->engine, json_flag(strcmp(row->engine, engine_version) != 0), count,
               differences->at);
}

// The cached scene with the fewest differences, or null.
static Status cache_find_nearest(App *app, const char *scene, Bytes *bytes, Problem *problem) {
    static const DiffFormat format = {"here", "there", false};
    ResultRows rows = {NULL, 0};
    Bytes best = {0};
    size_t best_count = 0;
    const ResultRow *nearest = NULL;
    TRY(db_result_recent(app->db, RECENT_MAX, SCENE_MAX, &rows, problem));
    for (size_t i = 0; i < rows.count; i++) {
        Bytes other = {0};
        size_t count;
        if (json_diff(scene, rows.at[i].scene, NULL, &format, &other, &count, NULL) == STATUS_OK &&
            !other.is_failed && (nearest == NULL || count < best_count)) {
            bytes_clear(&best);
            best = other;
            best_count = count;
            nearest = &rows.at[i];
        } else {
            bytes_clear(&other);
        }
    }
    if (nearest != NULL)
        cache_put_nearest(bytes, nearest, &best, best_count);
    else
        bytes_text(bytes, "null");
    bytes_clear(&best);
    result_rows_clear(&rows);
    return STATUS_OK;
}

static Status cache_put_explained(App *app, const StudyRequest *inquiry, Bytes *bytes,
                                  Problem *problem) {
    char result[72];
    CacheLayers layers;
    TRY(jobs_result_id(inquiry, result, problem));
    jobs_layers(app->manager, result, &layers);
    const bool is_cached = layers.in_memory || layers.in_database;
    bytes_json(bytes,
               "{\"result\": %s, \"engine\": %s, \"cached\": %p, \"layers\": {\"memory\": %p, "
               "\"database\": %p, \"series_memory\": %p, \"series_database\": %p}, \"nearest\": ",
               result, engine_version, json_flag(is_cached), json_flag(layers.in_memory),
               json_flag(layers.in_database), json_flag(layers.series_in_memory),
               json_flag(layers.series_in_database));
    Status status = STATUS_OK;
    if (is_cached) {
        bytes_text(bytes, "null");
    } else {
        Bytes scene = {.most = app->reply_most};
        document_scene(&scene, inquiry);
        status = scene.is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the scene")
                                 : cache_find_nearest(app, scene.at, bytes, problem);
        bytes_clear(&scene);
    }
    bytes_text(bytes, "}\n");
    return status;
}

Status cache_explain(App *app, const Request *request, Reply *reply, Problem *problem) {
    StudyRequest inquiry = {0};
    Warnings warnings = {NULL, 0};
    Bytes bytes = {.most = app->reply_most};
    TRY(request_require_json(request, problem));
    Status status = jobs_charge(app->manager, request->client, problem);
    if (status == STATUS_OK)
        status = jobs_prepare_request(app->manager, request->body, request->body_size, NULL,
                                      &inquiry, &warnings, problem);
    if (status == STATUS_OK)
        status = cache_put_explained(app, &inquiry, &bytes, problem);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return jobs_refused(app, request, reply, reply_json(reply, 200, &bytes, status, problem));
}
