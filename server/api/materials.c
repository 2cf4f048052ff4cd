// One material: a slug's head, one revision.
#include "server/api/materials.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/materials/material.h"

void material_tag(const char *slug, uint64_t revision, uint64_t version, char tag[MATERIAL_TAG]) {
    snprintf(tag, MATERIAL_TAG, "%.63s@%llu-%llu", slug, (unsigned long long)revision,
             (unsigned long long)version);
}

// A number of at most 18 digits; *text goes on behind it.
static bool read_count(const char **text, const char *end, uint64_t *count) {
    const char *from = *text;
    *count = 0;
    for (; *text < end && **text >= '0' && **text <= '9'; (*text)++)
        *count = 10 * *count + (uint64_t)(**text - '0');
    return *text > from && *text - from <= 18;
}

// The version in a tag of this material, with its quotes; what was packed has a word behind it.
static bool read_tag(const char *tag, size_t size, const char *slug, uint64_t *version) {
    const char *end = tag + size - 1, *text = tag + 1;
    const size_t length = strlen(slug);
    uint64_t revision;
    if (size < length + 6 || memcmp(text, slug, length) != 0 || text[length] != '@')
        return false;
    text += length + 1;
    return read_count(&text, end, &revision) && *text++ == '-' && read_count(&text, end, version) &&
           (text == end || *text == '-');
}

Status material_condition(App *app, const Request *request, const char *slug, bool is_required,
                          uint64_t *version, MaterialState *state, Problem *problem) {
    const char *list = request->if_match, *tag;
    uint64_t seen = 0, newest = 0;
    size_t size;
    *version = ANY_VERSION;
    TRY(db_material_state(app->db, slug, state, problem));
    const unsigned long long current = state->version;
    if (list == NULL && !is_required)
        return STATUS_OK;
    if (list == NULL)
        return problem_set(problem, STATUS_UNCONDITIONAL,
                           "send If-Match with the ETag that GET /v1/materials/%.63s told you, so "
                           "that you change what you have seen; it is \"%.63s@%llu-%llu\" now",
                           slug, slug, (unsigned long long)state->latest, current);
    while (header_etag_next(&list, &tag, &size)) {
        if (*tag == '*')
            return STATUS_OK;
        if (!read_tag(tag, size, slug, &seen))
            continue;
        if (seen == state->version) {
            *version = seen;
            return STATUS_OK;
        }
        newest = seen > newest ? seen : newest;
    }
    if (newest == 0)
        return problem_set(problem, STATUS_STALE,
                           "If-Match has no tag of the material \"%.63s\": its ETag is "
                           "\"%.63s@%llu-%llu\" now, you sent %.80s",
                           slug, slug, (unsigned long long)state->latest, current,
                           request->if_match);
    return problem_set(problem, STATUS_STALE,
                       "the material \"%.63s\" has changed since you read it: it is at version "
                       "%llu, you have seen version %llu; read it again",
                       slug, current, (unsigned long long)newest);
}

Status material_revision_number(const char *text, uint64_t *revision, Problem *problem) {
    const size_t size = strlen(text);
    *revision = 0;
    if (size <= 9 && strspn(text, "0123456789") == size)
        *revision = strtoull(text, NULL, 10);
    if (*revision > 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no revision \"%.20s\"; they count from 1", text);
}

static Status show(App *app, const Request *request, uint64_t revision, Reply *reply,
                   Problem *problem) {
    MaterialRevision material = {0};
    const Status status =
        material_find(app->db, request->parameters[0], revision, &material, problem);
    if (status != STATUS_OK) {
        material_revision_clear(&material);
        return status;
    }
    char tag[MATERIAL_TAG];
    material_tag(material.slug, material.revision, material.version, tag);
    Bytes bytes = {.most = app->reply_most};
    const bool is_known = reply_tagged(reply, request, tag);
    if (!is_known) {
        material_write(&bytes, &material);
        bytes_text(&bytes, "\n");
    }
    material_revision_clear(&material);
    return is_known ? STATUS_OK : reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, 0, reply, problem);
}

Status materials_show_revision(App *app, const Request *request, Reply *reply, Problem *problem) {
    uint64_t revision;
    TRY(material_revision_number(request->parameters[1], &revision, problem));
    return show(app, request, revision, reply, problem);
}
