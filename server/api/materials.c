// Buffer materials, read only: the list, a slug's head, one revision.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/api/app.h"
#include "server/http/reply.h"
#include "server/materials/catalogue.h"

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
        MaterialRevision *material = &materials.at[i];
        const Material *said = &material->material;
        if (word != NULL && !holds(material->slug, word) && !holds(said->name, word) &&
            !holds(said->source, word))
            continue;
        bytes_text(&bytes, is_first ? "" : ",\n ");
        (void)catalogue_read_lists(material, NULL);
        catalogue_write(&bytes, material);
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
        catalogue_find(app->store, request->parameters[0], revision, &material, problem);
    if (status != STATUS_OK) {
        material_revision_clear(&material);
        return status;
    }
    // What is said of a revision may still change (a draft is approved): the version tells.
    char tag[110];
    snprintf(tag, sizeof tag, "%.63s@%llu-%llu", material.slug,
             (unsigned long long)material.revision, (unsigned long long)material.version);
    Bytes bytes = {.most = app->reply_most};
    const bool is_known = reply_tagged(reply, request, tag);
    if (!is_known) {
        catalogue_write(&bytes, &material);
        bytes_text(&bytes, "\n");
    }
    material_revision_clear(&material);
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
