#include "server/materials/material.h"

#include <stdlib.h>
#include <string.h>

#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

Status material_read_lists(MaterialRevision *revision, Problem *problem) {
    Material *material = &revision->material;
    material->tags = (Texts){NULL, 0};
    material->table = (MaterialRows){NULL, 0};
    material->measurements = (Reals){NULL, 0};
    if (revision->lists == NULL)
        return STATUS_OK;
    return json_parse(revision->lists, strlen(revision->lists), material_list_fields, material,
                      problem);
}

Status material_write_lists(MaterialRevision *revision, Problem *problem) {
    const Material *material = &revision->material;
    free(revision->lists);
    revision->lists = NULL;
    if (material->tags.count == 0 && material->table.count == 0 &&
        material->measurements.count == 0)
        return STATUS_OK;
    Bytes bytes = {0};
    encode_item(&bytes, material_list_fields, material, WRITE_SCENE);
    revision->lists = bytes_take(&bytes, NULL);
    return revision->lists != NULL ? STATUS_OK
                                   : problem_set(problem, STATUS_NO_MEMORY, "no memory for it");
}

Status material_find(Db *db, const char *slug, uint64_t revision, MaterialRevision *found,
                     Problem *problem) {
    TRY(db_material(db, slug, revision, found, problem));
    return material_read_lists(found, problem);
}

void material_put_text(Bytes *bytes, const char *name, const char *text) {
    bytes_format(bytes, ", \"%s\": ", name);
    bytes_json_string(bytes, text);
}

void material_put_time(Bytes *bytes, const char *name, int64_t unix_ms) {
    char text[32];
    if (unix_ms > 0)
        clock_rfc3339(unix_ms, text);
    material_put_text(bytes, name, unix_ms > 0 ? text : NULL);
}

static void write_review(Bytes *bytes, const MaterialRevision *revision) {
    if (revision->reviewed_unix_ms == 0) {
        bytes_text(bytes, ", \"review\": null");
        return;
    }
    const bool is_own = text_same(revision->reviewer, revision->author);
    bytes_text(bytes, ", \"review\": {\"status\": ");
    bytes_json_string(bytes, revision->status);
    material_put_text(bytes, "reason", revision->reason);
    material_put_text(bytes, "reviewer", revision->reviewer);
    bytes_format(bytes, ", \"self_approved\": %s",
                 is_own && strcmp(revision->status, "approved") == 0 ? "true" : "false");
    material_put_time(bytes, "created", revision->reviewed_unix_ms);
    bytes_text(bytes, "}");
}

void material_write(Bytes *bytes, const MaterialRevision *revision) {
    const char *slug = revision->slug, *base = base_path();
    const unsigned long long number = revision->revision;
    bytes_format(bytes,
                 "{\"slug\": \"%s\", \"revision\": %llu, \"latest\": %llu, \"version\": %llu, "
                 "\"status\": \"%s\", ",
                 slug, number, (unsigned long long)revision->latest,
                 (unsigned long long)revision->version, revision->status);
    (void)encode_members(bytes, material_fields, &revision->material, WRITE_REPORT);
    material_put_text(bytes, "author", revision->author);
    material_put_text(bytes, "comment", revision->comment);
    if (revision->reverts > 0)
        bytes_format(bytes, ", \"reverts\": %llu", (unsigned long long)revision->reverts);
    else
        bytes_text(bytes, ", \"reverts\": null");
    material_put_time(bytes, "created", revision->created_unix_ms);
    write_review(bytes, revision);
    bytes_format(bytes,
                 ", \"links\": {\"self\": \"%s/v1/materials/%s\", \"revision\": "
                 "\"%s/v1/materials/%s@%llu\", \"revisions\": \"%s/v1/materials/%s/revisions\", "
                 "\"measurements\": \"%s/v1/materials/%s/measurements\", \"history\": "
                 "\"%s/v1/materials/%s/history\", \"used_by\": \"%s/v1/materials/%s/used-by\"}}",
                 base, slug, base, slug, number, base, slug, base, slug, base, slug, base, slug);
}

void material_write_stated(Bytes *bytes, const MaterialRevision *revision) {
    bytes_format(bytes, "{\"slug\": \"%s\", \"revision\": %llu, \"status\": \"%s\", ",
                 revision->slug, (unsigned long long)revision->revision, revision->status);
    (void)encode_members(bytes, material_fields, &revision->material, WRITE_REPORT);
    bytes_text(bytes, "}");
}
