// Buffer materials, read only: the list, a slug's head, one revision.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/api/app.h"
#include "server/base/link.h"
#include "server/codec/write.h"
#include "server/http/reply.h"

static void write_material(Bytes *bytes, const MaterialRevision *material) {
    bytes_text(bytes, "{");
    if (write_members(bytes, material_fields, material, WRITE_REPORT) > 0)
        bytes_text(bytes, ", ");
    bytes_format(
        bytes,
        "\"links\": {\"self\": \"%s/v1/materials/%s\", \"revision\": \"%s/v1/materials/%s@%llu\"}}",
        link_base(), material->slug, link_base(), material->slug,
        (unsigned long long)material->revision);
}

static bool holds(const char *text, const char *word) {
    const size_t size = strlen(word);
    for (; text != NULL; text = *text != '\0' ? text + 1 : NULL)
        if (strncasecmp(text, word, size) == 0)
            return true;
    return false;
}

Status materials_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *word = request_query(request, "q");
    MaterialRevisions materials = {0};
    const Status status = store_materials(app->store, &materials, problem);
    if (status != STATUS_OK) {
        material_revisions_clear(&materials);
        return status;
    }
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"materials\": [");
    bool is_first = true;
    for (size_t i = 0; i < materials.count; i++) {
        const MaterialRevision *material = &materials.at[i];
        if (word != NULL && !holds(material->slug, word) && !holds(material->name, word) &&
            !holds(material->source, word))
            continue;
        bytes_text(&bytes, is_first ? "" : ",\n ");
        write_material(&bytes, material);
        is_first = false;
    }
    bytes_text(&bytes, "]}\n");
    material_revisions_clear(&materials);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status show(App *app, const Request *request, uint64_t revision, Reply *reply,
                   Problem *problem) {
    MaterialRevision material = {0};
    const Status status =
        store_material(app->store, request->parameters[0], revision, &material, problem);
    if (status != STATUS_OK) {
        fields_clear(material_fields, &material);
        return status;
    }
    // A revision's status may still change (a draft is approved), so the tag tells it too.
    char tag[96];
    snprintf(tag, sizeof tag, "%.48s@%llu-%.20s", material.slug,
             (unsigned long long)material.revision, material.status != NULL ? material.status : "");
    Bytes bytes = {.most = app->reply_most};
    const bool is_known = reply_tagged(reply, request, tag);
    if (!is_known) {
        write_material(&bytes, &material);
        bytes_text(&bytes, "\n");
    }
    fields_clear(material_fields, &material);
    return is_known ? STATUS_OK : reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    return show(app, request, 0, reply, problem);
}

Status materials_show_revision(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *text = request->parameters[1];
    const size_t size = strlen(text);
    unsigned long long revision = 0;
    if (size > 0 && size <= 9 && strspn(text, "0123456789") == size)
        revision = strtoull(text, NULL, 10);
    if (revision == 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no revision \"%.20s\"; they count from 1", text);
    return show(app, request, revision, reply, problem);
}
