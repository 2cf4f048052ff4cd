// How a material came to be what it is: its revisions, what was done to it by whom and why, and in
// what two revisions differ.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"

// Revisions may be long, with their tables; what was done is short.
enum { REVISIONS_MAX = 100, DEEDS_INITIAL = 100, DEEDS_MAX = 1000 };

// A page of a list that is numbered from 1, newest first: `limit` items before `before`.
typedef struct Page {
    size_t limit, before;
} Page;

static Status read_page(const Request *request, size_t initial, size_t most, Page *page,
                        Problem *problem) {
    const size_t beyond = (size_t)1 << 53;
    TRY(request_count(request, "limit", 1, most, initial, &page->limit, problem));
    return request_count(request, "before", 1, beyond, beyond, &page->before, problem);
}

// `last` is the number of the last item of a page.
static void link_page(const Request *request, Reply *reply, uint64_t last) {
    char number[24];
    snprintf(number, sizeof number, "%llu", (unsigned long long)last);
    if (last > 1)
        query_link_next(request, reply, "before", number);
}

// True where the client has this state of the material already.
static bool is_known(const Request *request, Reply *reply, uint64_t latest, uint64_t version) {
    char tag[MATERIAL_TAG];
    material_tag(request->parameters[0], latest, version, tag);
    return reply_tagged(reply, request, tag);
}

static Status put_revisions(Bytes *bytes, MaterialRevisions *revisions, Problem *problem) {
    for (size_t i = 0; i < revisions->count; i++) {
        TRY(material_read_lists(&revisions->at[i], problem));
        bytes_text(bytes, i > 0 ? ",\n " : "");
        material_write(bytes, &revisions->at[i]);
    }
    return STATUS_OK;
}

// `state` was read before the revisions: what has come since is not told, so that its tag is not
// newer than what it stands for.
static Status list_revisions(App *app, const Request *request, const MaterialState *state,
                             MaterialRevisions *revisions, Reply *reply, Problem *problem) {
    if (is_known(request, reply, state->latest, state->version))
        return STATUS_OK;
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"latest\": %llu, \"version\": %llu, \"revisions\": [",
                 request->parameters[0], (unsigned long long)state->latest,
                 (unsigned long long)state->version);
    const Status status = put_revisions(&bytes, revisions, problem);
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    bytes_text(&bytes, "]}\n");
    if (revisions->count > 0)
        link_page(request, reply, revisions->at[revisions->count - 1].revision);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_revisions(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevisions revisions = {0};
    MaterialState state;
    Page page;
    TRY(read_page(request, REVISIONS_MAX, REVISIONS_MAX, &page, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    if (page.before > state.latest + 1)
        page.before = state.latest + 1;
    TRY(db_material_page(app->db, slug, page.before, page.limit, &revisions, problem));
    const Status status = list_revisions(app, request, &state, &revisions, reply, problem);
    material_revisions_clear(&revisions);
    return status;
}

static void put_number(Bytes *bytes, const char *name, uint64_t number) {
    if (number > 0)
        bytes_format(bytes, ", \"%s\": %llu", name, (unsigned long long)number);
    else
        bytes_format(bytes, ", \"%s\": null", name);
}

static void put_deed(Bytes *bytes, const AuditEntry *deed) {
    bytes_format(bytes, "{\"version\": %llu, \"action\": \"%s\"", (unsigned long long)deed->version,
                 deed->action);
    put_number(bytes, "revision", deed->revision);
    put_number(bytes, "measurement", deed->measurement);
    material_put_text(bytes, "who", deed->who);
    material_put_text(bytes, "why", deed->why);
    material_put_time(bytes, "when", deed->created_unix_ms);
    bytes_text(bytes, "}");
}

Status materials_history(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    AuditEntries audit_entries = {0};
    MaterialState state;
    Page page;
    TRY(read_page(request, DEEDS_INITIAL, DEEDS_MAX, &page, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    if (page.before > state.version + 1)
        page.before = state.version + 1;
    if (is_known(request, reply, state.latest, state.version))
        return STATUS_OK;
    TRY(db_audit_entries(app->db, slug, page.before, page.limit, &audit_entries, problem));
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"version\": %llu, \"history\": [", slug,
                 (unsigned long long)state.version);
    for (size_t i = 0; i < audit_entries.count; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        put_deed(&bytes, &audit_entries.at[i]);
    }
    bytes_text(&bytes, "]}\n");
    if (audit_entries.count > 0)
        link_page(request, reply, audit_entries.at[audit_entries.count - 1].version);
    audit_entries_clear(&audit_entries);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static void put_side(Bytes *bytes, const char *name, const MaterialRevision *revision) {
    bytes_format(bytes, ", \"%s\": {\"revision\": %llu, \"status\": \"%s\"", name,
                 (unsigned long long)revision->revision, revision->status);
    material_put_text(bytes, "author", revision->author);
    material_put_text(bytes, "comment", revision->comment);
    material_put_time(bytes, "created", revision->created_unix_ms);
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/materials/%s@%llu\"}}", base_path(),
                 revision->slug, (unsigned long long)revision->revision);
}

// The value alone of what is written as "name": value.
static const char *value_of(const Bytes *member) {
    const char *colon = member->at != NULL ? strstr(member->at, ": ") : NULL;
    return colon != NULL ? colon + 2 : "null";
}

// Member by member, a list being one: what is the same on both sides is written the same.
static size_t put_differences(Bytes *bytes, const Material *from, const Material *to) {
    size_t count = 0;
    for (const Field *row = material_fields; row->kind != FIELD_KIND_END; row++) {
        const Field alone[] = {*row, FIELD_END};
        Bytes a = {0}, b = {0};
        (void)encode_members(&a, alone, from, WRITE_REPORT);
        (void)encode_members(&b, alone, to, WRITE_REPORT);
        if (strcmp(value_of(&a), value_of(&b)) != 0) {
            bytes_format(bytes, "%s{\"pointer\": \"/%s\", \"from\": ", count++ > 0 ? ",\n " : "",
                         row->name);
            bytes_text(bytes, value_of(&a));
            bytes_text(bytes, ", \"to\": ");
            bytes_text(bytes, value_of(&b));
            material_put_text(bytes, "unit", row->unit);
            bytes_text(bytes, "}");
        }
        bytes_clear(&a);
        bytes_clear(&b);
    }
    return count;
}

// What came newest is set beside what is in use; that itself beside the one before it.
static Status read_sides(App *app, const Request *request, const MaterialState *state, size_t *from,
                         size_t *to, Problem *problem) {
    const char *slug = request->parameters[0];
    const size_t latest = (size_t)state->latest;
    MaterialRevision head;
    TRY(request_count(request, "to", 1, latest, latest, to, problem));
    size_t before = *to > 1 ? *to - 1 : 1;
    const Status status = db_material(app->db, slug, 0, &head, NULL);
    if (status == STATUS_OK && strcmp(head.status, "approved") == 0 && head.revision < *to)
        before = (size_t)head.revision;
    material_revision_clear(&head);
    return request_count(request, "from", 1, latest, before, from, problem);
}

static Status diff(App *app, const MaterialRevision *a, const MaterialRevision *b, Reply *reply,
                   Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\"", a->slug);
    put_side(&bytes, "from", a);
    put_side(&bytes, "to", b);
    bytes_text(&bytes, ", \"differences\": [");
    const size_t differences = put_differences(&bytes, &a->material, &b->material);
    bytes_format(&bytes, "], \"count\": %zu}\n", differences);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_diff(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevision a = {0}, b = {0};
    MaterialState state;
    size_t from, to;
    // Before all else, so that its tag is not newer than what it stands for.
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(read_sides(app, request, &state, &from, &to, problem));
    if (is_known(request, reply, state.latest, state.version))
        return STATUS_OK;
    Status status = material_find(app->db, slug, from, &a, problem);
    if (status == STATUS_OK)
        status = material_find(app->db, slug, to, &b, problem);
    if (status == STATUS_OK)
        status = diff(app, &a, &b, reply, problem);
    material_revision_clear(&a);
    material_revision_clear(&b);
    return status;
}
