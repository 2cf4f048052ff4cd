// Results as documents: the summary with everything stored as JSON, and the manifest. Their numbers
// in columns are columns.c's.
#include "server/api/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/api/studies.h"
#include "server/formats/study_formats.h"
#include "server/http/access.h"
#include "server/http/reply.h"
#include "server/jobs/documents.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"
#include "server/util/sha256.h"

const char no_impacts[] =
    "the scene asked for no ledger of impacts: their number is the summary's, their energy that of "
    "energy.json; with \"output\": {\"impacts\": true} they are listed";

void results_link_gone(const char *id, Reply *reply) {
    snprintf(reply->link, sizeof reply->link,
             "</v1/results/%.72s/again>; rel=\"successor-version\"; title=\"POST submits the scene "
             "anew\", </v1/results/%.72s/manifest>; rel=\"describedby\"",
             id, id);
}

// The scene as it was run, from its canonical JSON. Cleared by study_request_clear in any case.
static Status result_read_scene(const ResultRow *row, StudyRequest *inquiry, Problem *problem) {
    Problem *fault = malloc(sizeof *fault);
    if (fault == NULL || row->scene == NULL) {
        free(fault);
        memset(inquiry, 0, sizeof *inquiry);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the result's scene");
    }
    problem_clear(fault);
    const Status status =
        json_parse(row->scene, strlen(row->scene), study_request_fields, inquiry, fault);
    // A fault here is the server's, not the client's.
    if (status != STATUS_OK)
        problem_set(problem, STATUS_INTERNAL, "the stored scene cannot be read: %s", fault->detail);
    free(fault);
    return status == STATUS_OK ? STATUS_OK : STATUS_INTERNAL;
}

static const char *result_channel_unit(const char *name) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    return channel != NULL ? channel->unit : NULL;
}

static void result_put_units(Bytes *bytes, const Simulation *simulation) {
    bytes_text(bytes, "{");
    const char *separator = "";
    for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++) {
        if (field->unit == NULL)
            continue;
        bytes_format(bytes, "%s\"%s\": ", separator, field->name);
        bytes_json_string(bytes, field->unit);
        separator = ", ";
    }
    for (size_t i = 0; i < simulation->output.channels.count; i++) {
        bytes_text(bytes, separator);
        bytes_json_string(bytes, simulation->output.channels.at[i]);
        bytes_text(bytes, ": ");
        bytes_json_string(bytes, result_channel_unit(simulation->output.channels.at[i]));
        separator = ", ";
    }
    bytes_text(bytes, "}");
}

// "series" is the JSON one; the other formats are named in full.
static void result_put_formats(Bytes *bytes, const char *id, const char *part,
                               const char *formats) {
    bytes_format(bytes, ", \"%s\": \"%s/v1/results/%s/%s.json\"", part, base_path(), id, part);
    for (size_t size; (size = strcspn(formats, " ")) > 0; formats += size + (formats[size] != '\0'))
        bytes_format(bytes, ", \"%s.%.*s\": \"%s/v1/results/%s/%s.%.*s\"", part, (int)size, formats,
                     base_path(), id, part, (int)size, formats);
}

static void result_put_links(Bytes *bytes, const ResultRow *row, const Simulation *simulation,
                             const StudyAnswer *answer) {
    const char *id = row->id;
    const Output *output = &simulation->output;
    bytes_format(bytes,
                 "{\"self\": \"%s/v1/results/%s\", \"manifest\": \"%s/v1/results/%s/manifest\"",
                 base_path(), id, base_path(), id);
    result_put_formats(bytes, id, "series", "csv npy npz mat");
    if (output->psd.channels.count > 0)
        result_put_formats(bytes, id, "psd", "csv npy npz mat");
    if (output->impacts)
        result_put_formats(bytes, id, "impacts", "csv npy npz mat");
    // A template (RFC 6570): the impact's number in the list, from 1. Impulses have no force.
    if (output->impacts && row->impact_count > 0 && simulation_has_force(simulation))
        bytes_format(bytes, ", \"force\": \"%s/v1/results/%s/impacts/{number}/force.json\"",
                     base_path(), id);
    result_put_formats(bytes, id, "energy", "csv npy npz mat");
    bytes_format(bytes, ", \"bundle.zip\": \"%s/v1/results/%s/bundle.zip\"", base_path(), id);
    if (answer->study != NULL) {
        // A sweep's rows are a table of their own.
        const bool is_table = answer->study->kind == study_sweep.answer;
        const char *name = is_table ? "table" : answer->study->kind->name;
        const StudyFormat *format = study_formats(answer->study->kind);
        bytes_format(bytes, ", \"%s\": \"%s/v1/results/%s/%s.json\"", name, base_path(), id, name);
        while ((++format)->extension != NULL)
            bytes_format(bytes, ", \"%s.%s\": \"%s/v1/results/%s/%s.%s\"", name, format->extension,
                         base_path(), id, name, format->extension);
    }
    bytes_text(bytes, "}");
}

static const char *result_json(const char *json, const char *otherwise) {
    return json != NULL ? json : otherwise;
}

static void manifest_put_material(App *app, Bytes *bytes, const ReferenceRow *use) {
    MaterialRevision material = {0};
    if (db_material(app->db, use->slug, use->revision, &material, NULL) == STATUS_OK) {
        material_write_contents(bytes, &material);
    } else { // no longer here: its numbers stand in the scene
        bytes_text(bytes, "{\"slug\": ");
        bytes_json_string(bytes, use->slug);
        bytes_format(bytes, ", \"revision\": %llu}", use->revision);
    }
    material_revision_clear(&material);
}

static void result_put_material(App *app, Bytes *bytes, const ReferenceRow *use) {
    (void)app;
    bytes_format(bytes,
                 "{\"slug\": \"%s\", \"revision\": %llu, \"links\": {\"revision\": "
                 "\"%s/v1/materials/%s@%llu\", \"used_by\": "
                 "\"%s/v1/materials/%s@%llu/used-by\"}}",
                 use->slug, use->revision, base_path(), use->slug, use->revision, base_path(),
                 use->slug, use->revision);
}

// The materials of the scene and its study, each by `put`.
static void result_put_materials(App *app, Bytes *bytes, const StudyRequest *inquiry,
                                 void (*put)(App *app, Bytes *bytes, const ReferenceRow *use)) {
    Bytes lines = {0};
    ReferenceRow use;
    const char *separator = "";
    references_write(&lines, inquiry, true);
    const char *rest = lines.at;
    bytes_text(bytes, "[");
    while (references_next(&rest, &use)) {
        if (use.revision == 0)
            continue;
        bytes_text(bytes, separator);
        put(app, bytes, &use);
        separator = ", ";
    }
    bytes_text(bytes, "]");
    bytes->is_failed = bytes->is_failed || lines.is_failed;
    bytes_clear(&lines);
}

static void result_put_members(Bytes *bytes, const ResultRow *row, const StudyRequest *inquiry,
                               const StudyAnswer *answer) {
    const Simulation *simulation = &inquiry->simulation;
    bytes_format(bytes, "{\"id\": \"%s\", \"engine\": ", row->id);
    bytes_json_string(bytes, row->engine);
    bytes_text(bytes, ", \"scene\": ");
    bytes_text(bytes, result_json(row->scene, "null"));
    bytes_text(bytes, ", \"plan\": ");
    bytes_text(bytes, result_json(row->plan, "null"));
    bytes_text(bytes, ", \"summary\": ");
    bytes_text(bytes, result_json(row->summary, "null"));
    bytes_text(bytes, ", \"work\": ");
    bytes_text(bytes, result_json(row->work, "null"));
    bytes_text(bytes, ", \"units\": ");
    result_put_units(bytes, simulation);
    bytes_text(bytes, ", \"channels\": [");
    for (size_t i = 0; i < simulation->output.channels.count; i++) {
        bytes_text(bytes, i > 0 ? ", " : "");
        bytes_json_string(bytes, simulation->output.channels.at[i]);
    }
    bytes_text(bytes, "], \"sample_rate\": ");
    bytes_real(bytes, row->sample_rate);
    bytes_format(bytes, ", \"count\": %llu, \"warnings\": ", (unsigned long long)row->count);
    document_join(bytes, row->warnings, row->notes);
    bytes_text(bytes, ", \"materials\": ");
    result_put_materials(NULL, bytes, inquiry, result_put_material);
    bytes_text(bytes, ", \"study\": ");
    if (answer->study != NULL)
        document_answer(bytes, answer->study);
    else
        bytes_text(bytes, "null");
    bytes_text(bytes, ", \"links\": ");
    result_put_links(bytes, row, simulation, answer);
    bytes_text(bytes, "}\n");
}

Status result_put(const ResultRow *row, Bytes *bytes, Problem *problem) {
    StudyRequest inquiry = {0};
    StudyAnswer answer = {NULL};
    Status status = result_read_scene(row, &inquiry, problem);
    if (status == STATUS_OK && row->study != NULL)
        status = study_read(row, &answer, problem);
    if (status == STATUS_OK)
        result_put_members(bytes, row, &inquiry, &answer);
    study_request_clear(&inquiry);
    fields_clear(study_answer_fields, &answer);
    return status;
}

Status results_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    ResultRow row = {0};
    Bytes bytes = {.most = app->reply_most};
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK && !reply_immutable(reply, request, row.id)) {
        status = result_put(&row, &bytes, problem);
        if (status == STATUS_OK)
            status = reply_bytes(reply, 200, type_json, &bytes, problem);
        else
            bytes_clear(&bytes);
    }
    result_row_clear(&row);
    return status;
}

Status manifest_put(App *app, const ResultRow *row, Bytes *bytes, Problem *problem) {
    StudyRequest inquiry = {0};
    const Status status = result_read_scene(row, &inquiry, problem);
    if (status == STATUS_OK) {
        char created[32];
        clock_rfc3339(row->created_unix_ms, created);
        bytes_format(bytes, "{\"id\": \"%s\", \"engine\": ", row->id);
        bytes_json_string(bytes, row->engine);
        bytes_format(bytes,
                     ", \"created\": \"%s\", \"program\": {\"name\": \"impactd\", \"version\": "
                     "\"%s\", \"build\": ",
                     created, program_version);
        bytes_json_string(bytes, program_build);
        bytes_text(bytes, "}, \"scene\": ");
        bytes_text(bytes, result_json(row->scene, "null"));
        bytes_text(bytes, ", \"materials\": ");
        result_put_materials(app, bytes, &inquiry, manifest_put_material);
        bytes_format(
            bytes,
            ", \"again\": {\"method\": \"POST\", \"path\": \"%s/v1/jobs\", \"content_type\": "
            "\"application/json\", \"body\": \"the member scene of this document\", "
            "\"why\": \"the same "
            "scene and engine give the same id and the same bytes",
            base_path());
        // It is measured once and stored; another run measures a little more or less.
        if (inquiry.study != NULL && study_kind(inquiry.study)->is_measured)
            bytes_text(bytes, ", but for the CPU time that a study measures and what follows of "
                              "it");
        bytes_text(bytes, "\"}}\n");
    }
    study_request_clear(&inquiry);
    return status;
}

bool results_tagged(const Request *request, Reply *reply, const ResultRow *row, const char *what,
                    const Bytes *content) {
    char digits[65] = "", tag[104];
    Sha256 *digest = sha256_new();
    if (digest != NULL) {
        sha256_add(digest, content->at, content->count);
        sha256_end(digest, digits);
    }
    snprintf(tag, sizeof tag, "%.72s-%.8s-%.16s", row->id, what, digits);
    return reply_tagged(reply, request, tag);
}

Status results_manifest(App *app, const Request *request, Reply *reply, Problem *problem) {
    ResultRow row = {0};
    Bytes bytes = {.most = app->reply_most};
    Status status = db_result_load(app->db, request->parameters[0], &row, problem);
    if (status == STATUS_OK)
        status = manifest_put(app, &row, &bytes, problem);
    if (status == STATUS_OK && !results_tagged(request, reply, &row, "manifest", &bytes))
        status = reply_bytes(reply, 200, type_json, &bytes, problem);
    else
        bytes_clear(&bytes);
    result_row_clear(&row);
    return status;
}

// Clients with jobs of this result share it: none may delete it for the others.
static Status result_check_owner(App *app, const Request *request, Problem *problem) {
    char owner[72], what[128];
    if (request->client == NULL || request->holder.is_admin)
        return STATUS_OK;
    TRY(db_result_sharer(app->db, request->parameters[0], request->client, owner, problem));
    snprintf(what, sizeof what, "a job with the result %.80s", request->parameters[0]);
    return access_owns(request, owner[0] != '\0' ? owner : NULL, what, problem);
}

Status results_delete(App *app, const Request *request, Reply *reply, Problem *problem) {
    TRY(result_check_owner(app, request, problem));
    TRY(jobs_delete(app->manager, request->parameters[0], problem));
    reply_borrow(reply, 204, NULL, NULL, 0);
    return STATUS_OK;
}
