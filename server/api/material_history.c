// The history of a material: its revisions, its audit log, the differences of two revisions, and
// the results that used it.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

// Revisions may be long, with their tables; audit entries are short.
enum { REVISIONS_MAX = 100, AUDIT_INITIAL = 100, AUDIT_MAX = 1000 };
enum { RESULTS_INITIAL = 20, RESULTS_MAX = 1000 };

// In all handlers below the state is read first, so that the tag is not newer than the reply.

Status materials_revisions(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevisions revisions;
    MaterialState state;
    MaterialPage page;
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(material_page_read(request, REVISIONS_MAX, REVISIONS_MAX, state.latest, &page, problem));
    if (material_is_cached(request, reply, &state))
        return STATUS_OK;
    TRY(db_material_page(app->db, slug, page.before, page.limit, &revisions, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"latest\": %llu, \"version\": %llu, \"revisions\": [",
                 slug, (unsigned long long)state.latest, (unsigned long long)state.version);
    for (size_t i = 0; i < revisions.count; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        material_write(&bytes, &revisions.at[i]);
    }
    bytes_text(&bytes, "]}\n");
    if (revisions.count > 0)
        material_page_link(request, reply, revisions.at[revisions.count - 1].revision, &bytes);
    material_revisions_clear(&revisions);
    return reply_json(reply, 200, &bytes, STATUS_OK, problem);
}

Status materials_history(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    AuditEntries entries;
    MaterialState state;
    MaterialPage page;
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(material_page_read(request, AUDIT_INITIAL, AUDIT_MAX, state.version, &page, problem));
    if (material_is_cached(request, reply, &state))
        return STATUS_OK;
    TRY(db_audit_entries(app->db, slug, page.before, page.limit, &entries, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_json(&bytes, "{\"slug\": %s, \"version\": %llu, \"history\": [", slug,
               (unsigned long long)state.version);
    for (size_t i = 0; i < entries.count; i++) {
        const AuditEntry *entry = &entries.at[i];
        bytes_json(&bytes,
                   "%p{\"version\": %llu, \"action\": %s, \"revision\": %g, \"measurement\": %g, "
                   "\"who\": %s, \"why\": %s, \"when\": %s}",
                   i > 0 ? ",\n " : "", (unsigned long long)entry->version, entry->action,
                   material_count(entry->revision), material_count(entry->measurement), entry->who,
                   entry->why,
                   entry->created_unix_ms > 0 ? clock_rfc3339(entry->created_unix_ms).at : NULL);
    }
    bytes_text(&bytes, "]}\n");
    if (entries.count > 0)
        material_page_link(request, reply, entries.at[entries.count - 1].version, &bytes);
    audit_entries_clear(&entries);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static void diff_put_side(Bytes *bytes, const char *name, const MaterialRevision *revision) {
    const unsigned long long number = revision->revision;
    bytes_json(bytes,
               ", \"%s\": {\"revision\": %llu, \"status\": %s, \"author\": %s, \"comment\": %s, "
               "\"created\": %s, \"links\": {\"self\": \"%s/v1/materials/%s@%llu\"}}",
               name, number, revision->status, revision->author, revision->comment,
               clock_rfc3339(revision->created_unix_ms).at, base_path(), revision->slug, number);
}

// Member by member; a list is one.
static void diff_put(Bytes *bytes, const MaterialRevision *from, const MaterialRevision *to) {
    Bytes ours = {.most = 0}, theirs = {.most = 0};
    size_t count = 0;
    bytes_format(bytes, "{\"slug\": \"%s\"", from->slug);
    diff_put_side(bytes, "from", from);
    diff_put_side(bytes, "to", to);
    bytes_text(bytes, ", \"differences\": [");
    for (const Field *field = material_fields; field->kind != FIELD_KIND_END; field++) {
        const char *a = material_member_json(&ours, field, &from->material);
        const char *b = material_member_json(&theirs, field, &to->material);
        if (a == NULL || b == NULL)
            bytes->is_failed = true;
        else if (strcmp(a, b) != 0) {
            bytes_json(bytes, "%p{\"pointer\": \"/%s\", \"from\": %p, \"to\": %p, \"unit\": %s}",
                       count++ > 0 ? ",\n " : "", field->name, a, b, field->unit);
        }
    }
    bytes_format(bytes, "], \"count\": %zu}\n", count);
    bytes_clear(&ours);
    bytes_clear(&theirs);
}

// By default the newest revision is compared with the one in use, and that with the one before it.
static Status diff_read_sides(App *app, const Request *request, const MaterialState *state,
                              size_t *from, size_t *to, Problem *problem) {
    const size_t latest = (size_t)state->latest;
    MaterialRevision head;
    TRY(request_count(request, "to", 1, latest, latest, to, problem));
    size_t before = *to > 1 ? *to - 1 : 1;
    const Status status = db_material(app->db, request->parameters[0], 0, &head, NULL);
    if (status == STATUS_OK && strcmp(head.status, "approved") == 0 && head.revision < *to)
        before = (size_t)head.revision;
    material_revision_clear(&head);
    return request_count(request, "from", 1, latest, before, from, problem);
}

Status materials_diff(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevision a = {0}, b = {0};
    MaterialState state;
    size_t from, to;
    Bytes bytes = {.most = app->reply_most};
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(diff_read_sides(app, request, &state, &from, &to, problem));
    if (material_is_cached(request, reply, &state))
        return STATUS_OK;
    Status status = db_material(app->db, slug, from, &a, problem);
    if (status == STATUS_OK)
        status = db_material(app->db, slug, to, &b, problem);
    if (status == STATUS_OK)
        diff_put(&bytes, &a, &b);
    material_revision_clear(&a);
    material_revision_clear(&b);
    return reply_json(reply, 200, &bytes, status, problem);
}

// The results that used one revision.
static Status uses_list(App *app, const Request *request, uint64_t revision, Reply *reply,
                        Problem *problem) {
    const char *slug = request->parameters[0], *base = base_path();
    const unsigned long long number = revision;
    MaterialState state;
    size_t limit, before;
    uint64_t total;
    char name[96];
    ResultUses uses;
    TRY(request_count(request, "limit", 1, RESULTS_MAX, RESULTS_INITIAL, &limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, 0, &before, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    if (revision > state.latest)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "the material \"%.63s\" has no revision %llu, its newest is %llu", slug,
                           number, (unsigned long long)state.latest);
    snprintf(name, sizeof name, "%.63s@%llu", slug, number);
    // One more than the limit shows whether there is a next page.
    TRY(db_result_uses(app->db, name, limit + 1, (int64_t)before, &uses, &total, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"revision\": %llu, \"total\": %llu, \"results\": [",
                 slug, number, (unsigned long long)total);
    for (size_t i = 0; i < uses.count && i < limit; i++) {
        const ResultUse *use = &uses.at[i];
        bytes_json(&bytes,
                   "%p{\"id\": %s, \"created\": %s, \"links\": {\"self\": \"%s/v1/results/%s\", "
                   "\"manifest\": \"%s/v1/results/%s/manifest\"}}",
                   i > 0 ? ",\n " : "", use->id, clock_rfc3339(use->created_unix_ms).at, base,
                   use->id, base, use->id);
    }
    bytes_text(&bytes, "]}\n");
    if (uses.count > limit)
        material_page_link(request, reply, (uint64_t)uses.at[limit - 1].number, &bytes);
    free(uses.at);
    return reply_json(reply, 200, &bytes, STATUS_OK, problem);
}

// Each revision with the number of results that used it.
static Status uses_count(App *app, const char *slug, Reply *reply, Problem *problem) {
    const char *base = base_path();
    MaterialState state;
    MaterialReferences uses;
    uint64_t total = 0;
    Bytes bytes = {.most = app->reply_most};
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(db_material_uses(app->db, slug, &uses, problem));
    bytes_format(&bytes, "{\"slug\": \"%s\", \"revisions\": [", slug);
    for (size_t i = 0; i < uses.count; i++) {
        const MaterialReference *use = &uses.at[i];
        const unsigned long long number = use->revision;
        total += use->results;
        bytes_format(&bytes,
                     "%s{\"revision\": %llu, \"status\": \"%s\", \"results\": %llu, \"links\": "
                     "{\"self\": \"%s/v1/materials/%s@%llu\", \"used_by\": "
                     "\"%s/v1/materials/%s@%llu/used-by\"}}",
                     i > 0 ? ",\n " : "", number, use->status, (unsigned long long)use->results,
                     base, slug, number, base, slug, number);
    }
    bytes_format(&bytes, "], \"total\": %llu}\n", (unsigned long long)total);
    free(uses.at);
    return reply_json(reply, 200, &bytes, STATUS_OK, problem);
}

// Of the revision in the path or the query, or of all.
Status materials_uses(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *text = request->parameters[1];
    uint64_t revision;
    if (text == NULL)
        text = request_query(request, "revision");
    if (text == NULL &&
        (request_query(request, "limit") != NULL || request_query(request, "before") != NULL))
        return problem_set(problem, STATUS_USAGE,
                           "limit and before need a revision: add revision=1, or use "
                           "/v1/materials/%.63s@1/used-by",
                           request->parameters[0]);
    TRY(material_number(text, "revision", &revision, problem));
    return revision == 0 ? uses_count(app, request->parameters[0], reply, problem)
                         : uses_list(app, request, revision, reply, problem);
}
