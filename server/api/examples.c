// What does not change while the daemon runs: examples, schemas, the API's description, health and
// version. The files are embedded in the program under their path in the source tree.
#include <stdio.h>
#include <string.h>

#include "core/study/study.h"
#include "server/api/app.h"
#include "server/json/parse.h"
#include "server/json/schema.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

const char program_version[] = "0.1.0"; // as in CMakeLists.txt; a test compares
#ifdef __clang__
const char program_build[] = "clang " __clang_version__;
#else
const char program_build[] = "gcc " __VERSION__;
#endif

static const char examples_folder[] = "schema/examples/";

static void examples_put(Bytes *bytes, const EmbeddedFile *file) {
    StudyRequest inquiry = {0};
    char name[64];
    (void)json_parse(file->bytes, file->size, study_request_fields, &inquiry, NULL);
    const char *from = file->path + strlen(examples_folder);
    snprintf(name, sizeof name, "%.*s", (int)strcspn(from, "."), from);
    bytes_json(bytes,
               "{\"name\": %s, \"title\": %s, \"links\": {\"self\": \"%s/v1/examples/%s\"}, "
               "\"scene\": ",
               name, inquiry.simulation.title, base_path(), name);
    bytes_put(bytes, file->bytes, file->size);
    bytes_text(bytes, "}");
    study_request_clear(&inquiry);
}

Status examples_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"examples\": [");
    for (const EmbeddedFile *file = embedded_examples; file->path != NULL; file++) {
        bytes_text(&bytes, file == embedded_examples ? "\n" : ",\n");
        examples_put(&bytes, file);
    }
    bytes_text(&bytes, "]}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status examples_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    char path[128];
    (void)app;
    snprintf(path, sizeof path, "%s%.60s.json", examples_folder, request->parameters[0]);
    const EmbeddedFile *file = embedded_find(embedded_examples, path);
    if (file != NULL)
        return reply_embedded(reply, request, file, type_json);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no example \"%.60s\"; GET /v1/examples lists them",
                       request->parameters[0]);
}

Status schemas_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"schemas\": [");
    for (const SchemaDocument *document = schema_documents; document->name != NULL; document++) {
        bytes_json(&bytes,
                   "%p{\"name\": %s, \"title\": %s, \"links\": {\"self\": \"%s/schemas/%s\"}}",
                   document == schema_documents ? "" : ", ", document->name, document->title,
                   base_path(), document->name);
    }
    bytes_text(&bytes, "]}\n");
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

// "scene", also under its file name "scene.schema.json".
Status schemas_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *name = request->parameters[0];
    const size_t size = strcspn(name, ".");
    const bool is_named = name[size] == '\0' || strcmp(name + size, ".schema.json") == 0;
    for (const SchemaDocument *document = schema_documents; document->name != NULL; document++) {
        if (!is_named || strlen(document->name) != size || strncmp(document->name, name, size) != 0)
            continue;
        Bytes bytes = {.most = app->reply_most};
        schema_write_document(&bytes, document);
        return reply_bytes(reply, 200, "application/schema+json", &bytes, problem);
    }
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no schema \"%.60s\"; GET /schemas lists them", name);
}

// The description names the server that it stands for in the file; here that is the base URL.
Status openapi_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char before[] = "\"servers\": [{\"url\": \"";
    const EmbeddedFile *file = embedded_find(embedded_schemas, "schema/openapi.json");
    const char *servers = file != NULL ? strstr(file->bytes, before) : NULL;
    if (servers == NULL)
        return problem_set(problem, STATUS_INTERNAL,
                           "this program was built without its API description");
    if (app->base_url[0] == '\0')
        return reply_embedded(reply, request, file, type_json);
    const char *url = servers + sizeof before - 1, *rest = strchr(url, '"');
    Bytes bytes = {.most = app->reply_most};
    bytes_put(&bytes, file->bytes, (size_t)(url - file->bytes));
    bytes_text(&bytes, app->base_url);
    bytes_text(&bytes, rest);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status health_live(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)app;
    (void)request;
    (void)problem;
    static const char body[] = "{\"status\": \"live\"}\n";
    reply_borrow(reply, 200, type_json, body, sizeof body - 1);
    return STATUS_OK;
}

Status health_ready(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    JobStats metrics = {0};
    if (atomic_load(&app->is_stopping))
        return problem_set(problem, STATUS_BUSY, "the server is stopping");
    if (!db_is_writable(app->db))
        return problem_set(problem, STATUS_BUSY,
                           "the last write to the database failed: is the disk full or read-only?");
    jobs_stats(app->manager, &metrics);
    if (metrics.unfinished >= metrics.queue_most)
        return problem_set(problem, STATUS_BUSY,
                           "the queue is full: of unfinished jobs it has %zu, and may have %zu",
                           metrics.unfinished, metrics.queue_most);
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes,
                 "{\"status\": \"ready\", \"queued\": %zu, \"running\": %zu, \"workers\": %zu, "
                 "\"queue_most\": "
                 "%zu, \"cached_outcomes\": %zu, \"cached_bytes\": %zu}\n",
                 metrics.queued, metrics.running, metrics.workers, metrics.queue_most,
                 metrics.cached_outcomes, metrics.cached_bytes);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status version_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    (void)request;
    Bytes bytes = {.most = app->reply_most};
    bytes_json(&bytes,
               "{\"program\": \"impactd\", \"version\": %s, \"engine\": %s, \"build\": %s, "
               "\"started\": %s}\n",
               program_version, engine_version, program_build,
               clock_rfc3339(app->started_unix_ms).at);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}
