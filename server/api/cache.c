// What is known already: how often that helped, and why a scene is known or not.
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/json/document.h"

// The scenes that are compared, and how long they may be.
enum { RECENT_MAX = 256, SCENE_MAX = 16384 };

static void put_layer(Bytes *bytes, const char *name, const CacheStats *layer, bool has_budget) {
    bytes_format(bytes, "\"%s\": {\"hits\": %llu, \"misses\": %llu", name,
                 (unsigned long long)layer->hits, (unsigned long long)layer->misses);
    if (has_budget)
        bytes_format(
            bytes, ", \"evictions\": %llu, \"count\": %zu, \"bytes\": %zu, \"most_bytes\": %zu",
            (unsigned long long)layer->evictions, layer->count, layer->bytes, layer->most_bytes);
    bytes_text(bytes, "}");
}

Status cache_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    JobStats metrics;
    Bytes bytes = {.most = app->reply_most};
    jobs_tally(app->manager, &metrics);
    bytes_text(&bytes, "{");
    put_layer(&bytes, "documents", &metrics.heads, true);
    bytes_text(&bytes, ", ");
    put_layer(&bytes, "series", &metrics.series, true);
    bytes_text(&bytes, ", ");
    put_layer(&bytes, "results", &metrics.rows, false);
    uint64_t count, size;
    db_series_tally(app->db, &count, &size, &metrics.stored.evictions);
    metrics.stored.count = count;
    metrics.stored.bytes = size;
    bytes_text(&bytes, ", ");
    put_layer(&bytes, "stored_series", &metrics.stored, true);
    bytes_text(&bytes, "}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static const char *flag(bool is_so) {
    return is_so ? "true" : "false";
}

static void put_nearest(Bytes *bytes, const ResultRow *row, const Bytes *differences,
                        size_t count) {
    const bool is_other = strcmp(row->engine, engine_version) != 0;
    bytes_format(bytes, "{\"result\": \"%s\", \"engine\": ", row->id);
    bytes_json_string(bytes, row->engine);
    bytes_format(bytes,
                 ", \"engine_differs\": %s, \"count\": %zu, \"differences\": ", flag(is_other),
                 count);
    bytes_put(bytes, differences->at, differences->count);
    bytes_text(bytes, "}");
}

// The cached scene with the fewest differences, or null.
static Status find_nearest(App *app, const char *scene, Bytes *bytes, Problem *problem) {
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
        put_nearest(bytes, nearest, &best, best_count);
    else
        bytes_text(bytes, "null");
    bytes_clear(&best);
    result_rows_clear(&rows);
    return STATUS_OK;
}

static Status explain(App *app, const StudyRequest *inquiry, Bytes *bytes, Problem *problem) {
    char result[72];
    CacheLayers cache_layers;
    Bytes scene = {.most = app->reply_most};
    jobs_result_id(inquiry, result);
    jobs_layers(app->manager, result, &cache_layers);
    const bool is_known = cache_layers.in_memory || cache_layers.in_database;
    bytes_format(bytes, "{\"result\": \"%s\", \"engine\": ", result);
    bytes_json_string(bytes, engine_version);
    bytes_format(bytes,
                 ", \"cached\": %s, \"layers\": {\"memory\": %s, \"database\": %s, "
                 "\"series_memory\": %s, \"series_database\": %s}, \"nearest\": ",
                 flag(is_known), flag(cache_layers.in_memory), flag(cache_layers.in_database),
                 flag(cache_layers.series_in_memory), flag(cache_layers.series_in_database));
    Status status = STATUS_OK;
    if (is_known) {
        bytes_text(bytes, "null");
    } else {
        document_scene(&scene, inquiry);
        char *text = bytes_take(&scene, NULL);
        status = text == NULL ? STATUS_NO_MEMORY : find_nearest(app, text, bytes, problem);
        free(text);
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
        status = explain(app, &inquiry, &bytes, problem);
    if (status == STATUS_OK)
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    else
        bytes_clear(&bytes);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return jobs_refused(app, request, reply, status);
}
