// Results as documents: the summary with everything stored as JSON, and the manifest. Their numbers
// in columns are columns.c's.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/app.h"
#include "server/http/access.h"
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
             "again\", </v1/results/%.72s/manifest>; rel=\"describedby\"",
             id, id);
}

static Status result_read(const char *document, const char *what, const Field *fields, void *item,
                          Problem *problem) {
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL || document == NULL) {
        free(fault);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the result's %s", what);
    }
    const Status status = json_parse(document, strlen(document), fields, item, fault);
    // A fault here is the server's, not the client's.
    const Status reported =
        status == STATUS_OK || status == STATUS_NO_MEMORY ? status : STATUS_INTERNAL;
    if (reported != STATUS_OK)
        problem_set(problem, reported, "the stored %s cannot be read: %s", what, fault->detail);
    free(fault);
    return reported;
}

// The scene as it was run, from its canonical JSON. Cleared by study_request_clear in any case.
static Status result_read_scene(const ResultRow *row, StudyRequest *inquiry, Problem *problem) {
    *inquiry = (StudyRequest){0};
    return result_read(row->scene, "scene", study_request_fields, inquiry, problem);
}

Status study_read(const ResultRow *row, StudyAnswer *answer, Problem *problem) {
    *answer = (StudyAnswer){NULL};
    return result_read(row->study, "study", study_answer_fields, answer, problem);
}

static void result_put_units(Bytes *bytes, const Texts *names) {
    const char *separator = "";
    size_t number;
    for (const Field *field = summary_fields; field->kind != FIELD_KIND_END; field++)
        if (field->unit != NULL) {
            bytes_json(bytes, "%p%s: %s", separator, field->name, field->unit);
            separator = ", ";
        }
    for (size_t i = 0; i < names->count; i++) {
        const Channel *channel = channel_find(names->at[i], &number);
        bytes_json(bytes, "%p%s: %s", separator, names->at[i],
                   channel != NULL ? channel->unit : NULL);
        separator = ", ";
    }
}

// Under `name` the JSON, and under "name.csv" and so on the other formats, "csv, svg".
static void result_put_formats(Bytes *bytes, const char *id, const char *name,
                               const char *formats) {
    const char *base = base_path();
    char extension[8];
    bytes_json(bytes, ", \"%s\": \"%s/v1/results/%s/%s.json\"", name, base, id, name);
    for (size_t size; (size = strcspn(formats, ", ")) > 0;
         formats += size + strspn(formats + size, ", ")) {
        snprintf(extension, sizeof extension, "%.*s", (int)size, formats);
        bytes_json(bytes, ", \"%s.%s\": \"%s/v1/results/%s/%s.%s\"", name, extension, base, id,
                   name, extension);
    }
}

static void result_put_links(Bytes *bytes, const ResultRow *row, const Simulation *simulation,
                             const StudyAnswer *answer) {
    static const char tables[] = "csv, npy, npz, mat";
    const char *id = row->id, *base = base_path();
    const Output *output = &simulation->output;
    bytes_json(bytes,
               "{\"self\": \"%s/v1/results/%s\", \"manifest\": \"%s/v1/results/%s/manifest\"", base,
               id, base, id);
    result_put_formats(bytes, id, "series", tables);
    if (output->psd.channels.count > 0)
        result_put_formats(bytes, id, "psd", tables);
    if (output->impacts)
        result_put_formats(bytes, id, "impacts", tables);
    // A template (RFC 6570): the impact's number in the list, from 1. Impulses have no force.
    if (output->impacts && row->impact_count > 0 && simulation_has_force(simulation))
        bytes_json(bytes, ", \"force\": \"%s/v1/results/%s/impacts/{number}/force.json\"", base,
                   id);
    result_put_formats(bytes, id, "energy", tables);
    bytes_json(bytes, ", \"bundle.zip\": \"%s/v1/results/%s/bundle.zip\"", base, id);
    if (answer->study != NULL) {
        const Kind *kind = answer->study->kind;
        char others[64];
        study_formats_names(study_formats(kind) + 1, "", others, sizeof others);
        result_put_formats(bytes, id, study_document_name(study_of_answer(kind)), others);
    }
    bytes_text(bytes, "}");
}

static Status manifest_put_material(App *app, Bytes *bytes, const ReferenceRow *use,
                                    Problem *problem) {
    MaterialRevision material = {0};
    Status status = db_material(app->db, use->slug, use->revision, &material, problem);
    if (status == STATUS_OK) {
        material_write_contents(bytes, &material);
    } else if (status == STATUS_NOT_FOUND) { // of another server: its numbers stand in the scene
        problem_clear(problem);
        bytes_json(bytes, "{\"slug\": %s, \"revision\": %llu}", use->slug, use->revision);
        status = STATUS_OK;
    }
    material_revision_clear(&material);
    return status;
}

static Status result_put_material(App *app, Bytes *bytes, const ReferenceRow *use,
                                  Problem *problem) {
    const char *base = base_path();
    (void)app;
    (void)problem;
    bytes_json(bytes,
               "{\"slug\": %s, \"revision\": %llu, \"links\": {\"revision\": "
               "\"%s/v1/materials/%s@%llu\", \"used_by\": \"%s/v1/materials/%s@%llu/used-by\"}}",
               use->slug, use->revision, base, use->slug, use->revision, base, use->slug,
               use->revision);
    return STATUS_OK;
}

// The materials of the scene and its study, each by `put`.
static Status result_put_materials(App *app, Bytes *bytes, const StudyRequest *inquiry,
                                   Status (*put)(App *app, Bytes *bytes, const ReferenceRow *use,
                                                 Problem *problem),
                                   Problem *problem) {
    Status status = STATUS_OK;
    Bytes lines = {0};
    ReferenceRow use;
    const char *separator = "";
    references_write(&lines, inquiry, true);
    const char *rest = lines.at;
    bytes_text(bytes, "[");
    while (status == STATUS_OK && references_next(&rest, &use)) {
        if (use.revision == 0)
            continue;
        bytes_text(bytes, separator);
        status = put(app, bytes, &use, problem);
        separator = ", ";
    }
    bytes_text(bytes, "]");
    bytes->is_failed = bytes->is_failed || lines.is_failed;
    bytes_clear(&lines);
    return status;
}

static void result_put_members(Bytes *bytes, const ResultRow *row, const StudyRequest *inquiry,
                               const StudyAnswer *answer) {
    const Simulation *simulation = &inquiry->simulation;
    const Texts *names = &simulation->output.channels;
    bytes_json(bytes,
               "{\"id\": %s, \"engine\": %s, \"scene\": %p, \"plan\": %p, \"summary\": %p, "
               "\"work\": %p, \"units\": {",
               row->id, row->engine, row->scene, row->plan, row->summary, row->work);
    result_put_units(bytes, names);
    bytes_text(bytes, "}, \"channels\": [");
    for (size_t i = 0; i < names->count; i++)
        bytes_json(bytes, "%p%s", i > 0 ? ", " : "", names->at[i]);
    bytes_json(bytes, "], \"sample_rate\": %g, \"count\": %llu, \"warnings\": ", row->sample_rate,
               (unsigned long long)row->count);
    document_join(bytes, row->warnings, row->notes);
    bytes_text(bytes, ", \"materials\": ");
    (void)result_put_materials(NULL, bytes, inquiry, result_put_material, NULL);
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
    if (status == STATUS_OK && !reply_immutable(reply, request, row.id))
        status = reply_json(reply, 200, &bytes, result_put(&row, &bytes, problem), problem);
    result_row_clear(&row);
    return status;
}

Status manifest_put(App *app, const ResultRow *row, Bytes *bytes, Problem *problem) {
    StudyRequest inquiry = {0};
    Status status = result_read_scene(row, &inquiry, problem);
    if (status == STATUS_OK) {
        bytes_json(bytes,
                   "{\"id\": %s, \"engine\": %s, \"created\": %s, \"program\": {\"name\": "
                   "\"impactd\", \"version\": %s, \"build\": %s}, \"scene\": %p, \"materials\": ",
                   row->id, row->engine, clock_rfc3339(row->created_unix_ms).at, program_version,
                   program_build, row->scene);
        status = result_put_materials(app, bytes, &inquiry, manifest_put_material, problem);
        // The CPU time of a study is measured once and stored; another run measures another one.
        const bool is_measured = inquiry.study != NULL && study_kind(inquiry.study)->is_measured;
        bytes_json(bytes,
                   ", \"again\": {\"method\": \"POST\", \"path\": \"%s/v1/jobs\", "
                   "\"content_type\": \"application/json\", \"body\": \"the member scene of this "
                   "document\", \"why\": \"the same scene and engine give the same id and the same "
                   "bytes%s\"}}\n",
                   base_path(),
                   is_measured ? ", but for the CPU time that a study measures and what follows of "
                                 "it"
                               : "");
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
    if (status == STATUS_OK && results_tagged(request, reply, &row, "manifest", &bytes))
        bytes_clear(&bytes);
    else
        status = reply_json(reply, 200, &bytes, status, problem);
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
