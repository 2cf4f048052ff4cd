// Which results were made with a material: how many with each revision, and those of one.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

enum { LIST_INITIAL = 20, LIST_MAX = 1000 };

// An empty list is of a revision that is there.
static Status require_revision(App *app, const char *slug, uint64_t revision, Problem *problem) {
    MaterialState state;
    TRY(db_material_state(app->db, slug, &state, problem));
    if (revision <= state.latest)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no revision %llu of the material \"%.63s\", it has %llu",
                       (unsigned long long)revision, slug, (unsigned long long)state.latest);
}

static Status list_uses(App *app, const Request *request, uint64_t revision, Reply *reply,
                        Problem *problem) {
    const char *slug = request->parameters[0], *base = base_path();
    const unsigned long long number = revision;
    size_t limit, before;
    uint64_t total;
    char name[96], next[24];
    ResultUses uses = {0};
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, 0, &before, problem));
    TRY(require_revision(app, slug, revision, problem));
    snprintf(name, sizeof name, "%.63s@%llu", slug, number);
    // One more than asked for tells whether there is a next page.
    TRY(db_result_uses(app->db, name, limit + 1, (int64_t)before, &uses, &total, problem));
    const size_t count = uses.count > limit ? limit : uses.count;
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"revision\": %llu, \"total\": %llu, \"results\": [",
                 slug, number, (unsigned long long)total);
    for (size_t i = 0; i < count; i++) {
        const ResultUse *use = &uses.at[i];
        bytes_format(&bytes, "%s{\"id\": \"%s\"", i > 0 ? ",\n " : "", use->id);
        material_put_time(&bytes, "created", use->created_unix_ms);
        bytes_format(&bytes,
                     ", \"links\": {\"self\": \"%s/v1/results/%s\", \"manifest\": "
                     "\"%s/v1/results/%s/manifest\"}}",
                     base, use->id, base, use->id);
    }
    bytes_text(&bytes, "]}\n");
    if (uses.count > limit) {
        snprintf(next, sizeof next, "%lld", (long long)uses.at[limit - 1].number);
        query_link_next(request, reply, "before", next);
    }
    free(uses.at);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static void put_counts(Bytes *bytes, const char *slug, const MaterialReferences *uses) {
    const char *base = base_path();
    uint64_t total = 0;
    bytes_format(bytes, "{\"slug\": \"%s\", \"revisions\": [", slug);
    for (size_t i = 0; i < uses->count; i++) {
        const MaterialReference *use = &uses->at[i];
        const unsigned long long number = use->revision;
        total += use->results;
        bytes_format(bytes,
                     "%s{\"revision\": %llu, \"status\": \"%s\", \"results\": %llu, \"links\": "
                     "{\"self\": \"%s/v1/materials/%s@%llu\", \"used_by\": "
                     "\"%s/v1/materials/%s@%llu/used-by\"}}",
                     i > 0 ? ",\n " : "", number, use->status, (unsigned long long)use->results,
                     base, slug, number, base, slug, number);
    }
    bytes_format(bytes, "], \"total\": %llu}\n", (unsigned long long)total);
}

static Status count_uses(App *app, const char *slug, Reply *reply, Problem *problem) {
    MaterialState state;
    MaterialReferences uses = {0};
    Bytes bytes = {.most = app->reply_most};
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(db_material_uses(app->db, slug, &uses, problem));
    put_counts(&bytes, slug, &uses);
    free(uses.at);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_uses(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *text = request_query(request, "revision");
    uint64_t revision;
    if (text == NULL &&
        (request_query(request, "limit") != NULL || request_query(request, "before") != NULL))
        return problem_set(problem, STATUS_USAGE,
                           "limit and before belong to the list of one revision: say revision=1, "
                           "or ask /v1/materials/%.63s@1/used-by",
                           request->parameters[0]);
    if (text == NULL)
        return count_uses(app, request->parameters[0], reply, problem);
    TRY(material_revision_number(text, &revision, problem));
    return list_uses(app, request, revision, reply, problem);
}

Status materials_uses_revision(App *app, const Request *request, Reply *reply, Problem *problem) {
    uint64_t revision;
    TRY(material_revision_number(request->parameters[1], &revision, problem));
    return list_uses(app, request, revision, reply, problem);
}
