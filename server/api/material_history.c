// How a material came to be what it is: its revisions, what was done to it by whom and why, and in
// what two revisions differ.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/base/link.h"
#include "server/codec/write.h"
#include "server/http/reply.h"
#include "server/materials/catalogue.h"

enum { LIST_INITIAL = 100, LIST_MOST = 1000 };

// A page of a list that is numbered from 1, newest first: items beyond - 1 down to `least`.
typedef struct Page {
    size_t beyond, least;
} Page;

static Status read_page(const Request *request, size_t count, Page *page, Problem *problem) {
    size_t limit, before;
    TRY(request_count(request, "limit", 1, LIST_MOST, LIST_INITIAL, &limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, count + 1, &before, problem));
    page->beyond = before <= count ? before : count + 1;
    page->least = page->beyond > limit ? page->beyond - limit : 1;
    return STATUS_OK;
}

static void link_page(const Request *request, Reply *reply, const Page *page) {
    char number[24];
    snprintf(number, sizeof number, "%zu", page->least);
    if (page->least > 1)
        query_link_next(request, reply, "before", number);
}

// True where the client has this state of the material already, in the page that it asks for.
static bool is_known(const Request *request, Reply *reply, const MaterialState *state) {
    char tag[MATERIAL_TAG];
    material_tag(request->parameters[0], state->latest, state->version, tag);
    return reply_tagged(reply, request, tag);
}

static Status list_revisions(App *app, const Request *request, MaterialRevisions *revisions,
                             Reply *reply, Problem *problem) {
    const MaterialRevision *last = &revisions->at[revisions->count - 1];
    const MaterialState state = {last->latest, last->version, 0};
    Page page;
    TRY(read_page(request, revisions->count, &page, problem));
    if (is_known(request, reply, &state))
        return STATUS_OK;
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"latest\": %llu, \"version\": %llu, \"revisions\": [",
                 last->slug, (unsigned long long)state.latest, (unsigned long long)state.version);
    for (size_t i = page.beyond - 1; i >= page.least; i--) {
        const Status status = catalogue_read_lists(&revisions->at[i - 1], problem);
        if (status != STATUS_OK) {
            bytes_clear(&bytes);
            return status;
        }
        catalogue_write(&bytes, &revisions->at[i - 1]);
        bytes_text(&bytes, i > page.least ? ",\n " : "");
    }
    bytes_text(&bytes, "]}\n");
    link_page(request, reply, &page);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_revisions(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialRevisions revisions = {0};
    Status status =
        store_material_revisions(app->store, request->parameters[0], &revisions, problem);
    if (status == STATUS_OK)
        status = list_revisions(app, request, &revisions, reply, problem);
    material_revisions_clear(&revisions);
    return status;
}

static void put_number(Bytes *bytes, const char *name, uint64_t number) {
    if (number > 0)
        bytes_format(bytes, ", \"%s\": %llu", name, (unsigned long long)number);
    else
        bytes_format(bytes, ", \"%s\": null", name);
}

static void put_deed(Bytes *bytes, const MaterialDeed *deed, size_t version) {
    bytes_format(bytes, "{\"version\": %zu, \"action\": \"%s\"", version, deed->action);
    put_number(bytes, "revision", deed->revision);
    put_number(bytes, "measurement", deed->measurement);
    material_put_text(bytes, "who", deed->who);
    material_put_text(bytes, "why", deed->why);
    material_put_time(bytes, "when", deed->created_unix_ms);
    bytes_text(bytes, "}");
}

static Status list_deeds(App *app, const Request *request, const MaterialDeeds *deeds, Reply *reply,
                         Problem *problem) {
    MaterialState state = {0, deeds->count, 0}; // each deed made a version
    for (size_t i = 0; i < deeds->count; i++)
        state.latest = deeds->at[i].revision > state.latest ? deeds->at[i].revision : state.latest;
    Page page;
    TRY(read_page(request, deeds->count, &page, problem));
    if (is_known(request, reply, &state))
        return STATUS_OK;
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"version\": %zu, \"history\": [",
                 request->parameters[0], deeds->count);
    for (size_t i = page.beyond - 1; i >= page.least; i--) {
        put_deed(&bytes, &deeds->at[i - 1], i);
        bytes_text(&bytes, i > page.least ? ",\n " : "");
    }
    bytes_text(&bytes, "]}\n");
    link_page(request, reply, &page);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_history(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialDeeds deeds = {0};
    Status status = store_material_trail(app->store, request->parameters[0], &deeds, problem);
    if (status == STATUS_OK)
        status = list_deeds(app, request, &deeds, reply, problem);
    material_deeds_clear(&deeds);
    return status;
}

static void put_side(Bytes *bytes, const char *name, const MaterialRevision *revision) {
    bytes_format(bytes, ", \"%s\": {\"revision\": %llu, \"status\": \"%s\"", name,
                 (unsigned long long)revision->revision, revision->status);
    material_put_text(bytes, "author", revision->author);
    material_put_text(bytes, "comment", revision->comment);
    material_put_time(bytes, "created", revision->created_unix_ms);
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/materials/%s@%llu\"}}", link_base(),
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
        (void)write_members(&a, alone, from, WRITE_REPORT);
        (void)write_members(&b, alone, to, WRITE_REPORT);
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

static Status diff(App *app, const Request *request, const MaterialRevisions *revisions,
                   size_t approved, Reply *reply, Problem *problem) {
    const size_t count = revisions->count;
    size_t from, to;
    TRY(request_count(request, "to", 1, count, count, &to, problem));
    // What came newest is set beside what is in use; that itself beside the one before it.
    size_t before = to > 1 ? to - 1 : 1;
    if (approved > 0 && approved < to)
        before = approved;
    TRY(request_count(request, "from", 1, count, before, &from, problem));
    MaterialRevision *a = &revisions->at[from - 1], *b = &revisions->at[to - 1];
    TRY(catalogue_read_lists(a, problem));
    if (a != b)
        TRY(catalogue_read_lists(b, problem));
    if (is_known(request, reply, &(MaterialState){b->latest, b->version, 0}))
        return STATUS_OK;
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
    MaterialRevisions revisions = {0};
    Status status =
        store_material_revisions(app->store, request->parameters[0], &revisions, problem);
    size_t approved = 0;
    for (size_t i = 0; i < revisions.count; i++)
        if (strcmp(revisions.at[i].status, "approved") == 0)
            approved = i + 1;
    if (status == STATUS_OK)
        status = diff(app, request, &revisions, approved, reply, problem);
    material_revisions_clear(&revisions);
    return status;
}
