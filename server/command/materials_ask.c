#include "server/command/materials_ask.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/evaluation.h"
#include "core/drop_test/pair_parameters.h"
#include "core/scene/buffer.h"
#include "core/scene/material.h"
#include "server/codec/json_edit.h"
#include "server/codec/read.h"
#include "server/command/scene_file.h"
#include "server/command/sheet.h"

enum { NUMBER_MAX = 9 }; // digits of a revision

static bool is_number(const char *text) {
    const size_t size = strlen(text);
    return size > 0 && size <= NUMBER_MAX && text[0] != '0' && strspn(text, "0123456789") == size;
}

Status materials_number(const char *text, const char *what, Problem *problem) {
    return is_number(text)
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE,
                             "%s must be a whole number from 1 on, is \"%.60s\"", what, text);
}

Status materials_name(const char *text, bool may_have_revision, Problem *problem) {
    char slug[MATERIAL_SLUG_MAX + 1];
    const size_t length = strcspn(text, "@");
    snprintf(slug, sizeof slug, "%.*s", (int)(length < sizeof slug ? length : 0), text);
    const bool has_revision = text[length] == '@';
    if (!material_slug_is_valid(slug))
        return problem_set(problem, STATUS_USAGE,
                           "a material is named by 1 to %d lower-case letters, digits, underscores "
                           "and dashes%s, is \"%.80s\"",
                           MATERIAL_SLUG_MAX, may_have_revision ? ", perhaps with @REVISION" : "",
                           text);
    if (!has_revision)
        return STATUS_OK;
    if (!may_have_revision)
        return problem_set(problem, STATUS_USAGE,
                           "takes a material without a revision: %s, is %.80s", slug, text);
    return materials_number(text + length + 1, "the revision behind @", problem);
}

void materials_path(Bytes *path, const char *name, const char *rest) {
    *path = (Bytes){.most = 8000};
    bytes_format(path, "/v1/materials/%s%s", name, rest);
}

void materials_query(Bytes *path, const char *name, const char *value) {
    if (value == NULL)
        return;
    const bool is_first = path->at == NULL || strchr(path->at, '?') == NULL;
    bytes_format(path, "%s%s=", is_first ? "?" : "&", name);
    http_encode(path, value);
}

void materials_query_real(Bytes *path, const char *name, double value) {
    char text[32];
    if (!isnan(value))
        materials_query(path, name, text_real(text, value));
}

Status materials_ask(MaterialsCall *call, const char *method, Bytes *path, const Bytes *body,
                     const char *tag, HttpAnswer *answer, Problem *problem) {
    const HttpAsk ask = {.method = method, .path = path->at, .body = body, .if_match = tag};
    *answer = (HttpAnswer){0};
    const Status status = path->is_failed
                              ? problem_set(problem, STATUS_USAGE, "asks for too much at once")
                              : daemon_ask(call->daemon, &ask, answer, problem);
    bytes_clear(path);
    return status;
}

Status materials_print(const MaterialsCall *call, const HttpAnswer *answer,
                       const OutlineTable *tables, Problem *problem) {
    static const char *const besides[] = {"links", "test", NULL};
    const Field *const fields[] = {material_fields, pair_parameters_fields, evaluation_fields,
                                   buffer_fields, NULL};
    const OutlineWay way = {besides, tables, fields};
    Outline outline;
    if (call->settings->json) {
        (void)fwrite(answer->body.at, 1, answer->body.count, stdout);
        return STATUS_OK;
    }
    Status status = outline_read(answer->body.at, answer->body.count, &way, &outline, NULL);
    for (size_t i = 0; i < outline.count; i++)
        if (outline.at[i].has_heads && outline.at[i].rows == MATERIALS_MAX + 1)
            fprintf(stderr, "impactd materials: the first %d; narrow it down to see others\n",
                    MATERIALS_MAX);
    if (status == STATUS_OK && outline.count == 0)
        fputs("impactd materials: nothing fits\n", stderr);
    else if (status == STATUS_OK)
        sheet_print(&outline);
    else if (status == STATUS_UNREADABLE)
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer is no document: what answers there is no impactd");
    outline_clear(&outline);
    return status;
}

typedef struct ReviewTold {
    bool self_approved;
} ReviewTold;
typedef struct RevisionTold {
    char *slug, *status;
    uint64_t revision;
    ReviewTold review;
} RevisionTold;

// clang-format off
static const Field review_told_fields[] = {
    FIELD_FLAG(ReviewTold, self_approved, false, "by whoever wrote the revision"),
    FIELD_END,
};
static const Field revision_told_fields[] = {
    FIELD_TEXT(RevisionTold, slug, 0, PRESENCE_OPTIONAL, 0, "slug"),
    FIELD_TEXT(RevisionTold, status, 0, PRESENCE_OPTIONAL, 0, "status"),
    FIELD_COUNT(RevisionTold, revision, NULL, ANY, OPTIONAL, "revision"),
    FIELD_ITEM_OR_NULL(RevisionTold, review, review_told_fields, PRESENCE_OPTIONAL, "last review"),
    FIELD_END,
};
// clang-format on

Status materials_print_revision(const MaterialsCall *call, const HttpAnswer *answer,
                                Problem *problem) {
    RevisionTold told = {0};
    Status status = STATUS_OK;
    if (call->settings->json) {
        (void)fwrite(answer->body.at, 1, answer->body.count, stdout);
        return STATUS_OK;
    }
    (void)read_json(answer->body.at, answer->body.count, revision_told_fields, &told, NULL);
    if (told.slug == NULL || told.status == NULL || told.revision == COUNT_ABSENT) {
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer is no revision: what answers there is no impactd");
    } else {
        told_tame(told.slug);
        told_tame(told.status);
        printf("%s@%llu %s%s\n", told.slug, (unsigned long long)told.revision, told.status,
               told.review.self_approved ? ", by its own author" : "");
    }
    fields_clear(revision_told_fields, &told);
    return status;
}

Status materials_body(MaterialsCall *call, const char *path, Bytes *body, Problem *problem) {
    call->about = path;
    Status status = scene_file_read(path, body, problem);
    if (status == STATUS_OK && call->settings->comment != NULL)
        status = json_edit_set(body, "comment", call->settings->comment, problem);
    return status;
}
