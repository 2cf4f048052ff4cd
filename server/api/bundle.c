// All of a result in one archive that explains itself.
#include <string.h>

#include "server/api/app.h"

// web/bundle.txt, in which "@result" and "@engine" stand for those.
static void bundle_put_readme(Bytes *bytes, const ResultRow *row) {
    const char *at = embedded_find(embedded_web, "web/bundle.txt")->bytes;
    for (const char *next; (next = strchr(at, '@')) != NULL; at = next + sizeof "@result" - 1) {
        bytes_put(bytes, at, (size_t)(next - at));
        bytes_text(bytes, next[1] == 'r' ? row->id : row->engine);
    }
    bytes_text(bytes, at);
}

static const TableFormat bundle_format = {
    .extension = "zip", .content_type = "application/zip", .is_binary = true};

// Clears `bytes`.
static Status bundle_put(Zip *zip, const char *name, Bytes *bytes, Problem *problem) {
    Segments content = {.size = 0};
    segments_text(&content, bytes);
    const Status status = zip_put(zip, name, &content, problem);
    segments_clear(&content);
    return status;
}

static Status bundle_put_table(Zip *zip, const char *name, const TableFormat *format,
                               const Table *table, Problem *problem) {
    Bytes bytes = {.most = 0};
    TRY(format_write(format, table, &bytes, problem));
    return bundle_put(zip, name, &bytes, problem);
}

static Status bundle_put_series(Zip *zip, TableStream *stream, Problem *problem) {
    Segments content = {.size = 0};
    TRY(table_stream_series(stream, problem));
    Status status = format_npz.layout(&stream->table, &content, problem);
    if (status == STATUS_OK)
        status = zip_put(zip, "series.npz", &content, problem);
    segments_clear(&content);
    return status;
}

// Spectra and impacts, if the scene asked for them.
static Status bundle_put_lists(Zip *zip, Outcome *outcome, Problem *problem) {
    TableStream *psd = table_stream_new(outcome_ref(outcome));
    TableStream *impacts = table_stream_new(outcome_ref(outcome));
    Status status = psd != NULL && impacts != NULL
                        ? STATUS_OK
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for the bundle");
    if (status == STATUS_OK && outcome->spectrum.densities.count > 0) {
        status = table_stream_psd(psd, problem);
        if (status == STATUS_OK)
            status = bundle_put_table(zip, "psd.json", &format_json, &psd->table, problem);
        if (status == STATUS_OK)
            status = bundle_put_table(zip, "psd.csv", &format_csv, &psd->table, problem);
    }
    if (status == STATUS_OK && !outcome->response.is_unlisted) {
        status = table_stream_impacts(impacts, &format_csv, NULL, problem);
        if (status == STATUS_OK)
            status = bundle_put_table(zip, "impacts.csv", &format_csv, &impacts->table, problem);
    }
    table_stream_free(psd);
    table_stream_free(impacts);
    return status;
}

// The segments borrow the series of the stream's outcome.
static Status bundle_fill(Zip *zip, const ResultRow *row, Bytes *manifest, TableStream *stream,
                          Problem *problem) {
    Bytes readme = {.most = 0}, scene = {.most = 0}, result = {.most = 0};
    bundle_put_readme(&readme, row);
    TRY(bundle_put(zip, "README.txt", &readme, problem));
    bytes_text(&scene, row->scene);
    bytes_text(&scene, "\n");
    TRY(bundle_put(zip, "scene.json", &scene, problem));
    const Status status = result_put(row, &result, problem);
    if (status != STATUS_OK) {
        bytes_clear(&result);
        return status;
    }
    TRY(bundle_put(zip, "result.json", &result, problem));
    TRY(bundle_put(zip, "manifest.json", manifest, problem));
    TRY(bundle_put_series(zip, stream, problem));
    return bundle_put_lists(zip, stream->outcome, problem);
}

static Status bundle_reply(App *app, Reply *reply, const ResultRow *row, Bytes *manifest,
                           TableStream *stream, Problem *problem) {
    if (stream == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the bundle");
    Zip zip = {.segments = &stream->segments};
    Status status = bundle_fill(&zip, row, manifest, stream, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    status = status != STATUS_OK ? status : ended;
    if (status == STATUS_OK)
        return columns_reply(app, reply, &bundle_format, stream, problem);
    table_stream_free(stream);
    return status;
}

Status results_bundle(App *app, const Request *request, Reply *reply, Problem *problem) {
    ResultRow row = {.count = 0};
    Bytes manifest = {.most = app->reply_most};
    Outcome *outcome = NULL;
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK)
        status = manifest_put(app, &row, &manifest, problem);
    // What may change is in the manifest: a material's status and the base of the links.
    if (status == STATUS_OK && !results_tagged(request, reply, &row, "bundle", &manifest)) {
        status = columns_outcome(app, request, reply, &outcome, problem);
        if (status == STATUS_OK && outcome != NULL)
            status = bundle_reply(app, reply, &row, &manifest, table_stream_new(outcome), problem);
    }
    bytes_clear(&manifest);
    result_row_clear(&row);
    return status;
}
