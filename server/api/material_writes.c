// Writing materials: a new one, a revision, a revert, a review. Nothing is ever changed: each adds
// a row, and an entry to the trail. Whoever writes says which state they have seen (If-Match), and
// of two who saw the same one alone goes on; the other is told, and has lost nothing.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/http/reply.h"
#include "server/json/material_bodies.h"
#include "server/json/parse.h"
#include "server/materials/material.h"
#include "server/materials/slug.h"
#include "server/util/clock.h"

// Whether a body was an object at all, so that more may be said of it than that.
static bool is_object(Status status, const Problem *problem) {
    return status == STATUS_OK || (status == STATUS_INVALID && problem->count > 0 &&
                                   problem->faults[0].pointer[0] != '\0');
}

// The body into `item`, whose ranges are judged too. Cleared by fields_clear in any case.
static Status read_body(const Request *request, const char *whose, const Field *fields, void *item,
                        Problem *problem) {
    TRY(request_require_json(request, problem));
    problem->whose = whose;
    const Status status = json_parse(request->body, request->body_size, fields, item, problem);
    if (!is_object(status, problem))
        return status;
    const Status judged = fields_validate(fields, item, "", problem);
    return status != STATUS_OK ? status : judged;
}

// Blanks are no reason.
static Status check_why(const char *text, const char *pointer, Problem *problem) {
    if (text == NULL || text[strspn(text, " \t\r\n")] != '\0')
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, pointer,
                       "must not be empty: whoever reads the trail wants to know why");
}

// What numbers were taken from has to be there; that it is a number at all is judged elsewhere.
static Status check_measurements(const Material *material, uint64_t count, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < material->measurements.count; i++) {
        const double number = material->measurements.at[i];
        char place[64];
        if (number <= (double)count)
            continue;
        snprintf(place, sizeof place, "/measurements/%zu", i);
        status = problem_add_real(problem, STATUS_INVALID, place, number, NULL,
                                  count == 0 ? "the material has no measurements yet"
                                             : "must be one of its measurements, 1 to %llu",
                                  (unsigned long long)count);
    }
    return status;
}

// All faults of what is said, `status` among them.
static Status judge(const MaterialBody *body, uint64_t measurements, Status status,
                    Problem *problem) {
    if (!is_object(status, problem))
        return status;
    const Status all[] = {status, material_validate(&body->material, "", problem),
                          check_measurements(&body->material, measurements, problem),
                          check_why(body->comment, "/comment", problem)};
    for (size_t i = 0; i < COUNT(all); i++)
        TRY(all[i]);
    return STATUS_OK;
}

// The revision as its writer left it. With the version that they saw the tag is that of their own
// write, even if somebody else has written since: then their next one is refused, not done unseen.
static Status tell(App *app, const char *slug, uint64_t revision, uint64_t seen, int code,
                   Reply *reply, Problem *problem) {
    MaterialRevision written = {0};
    const Status status = material_find(app->db, slug, revision, &written, problem);
    if (status == STATUS_OK) {
        char tag[MATERIAL_TAG];
        Bytes bytes = {.most = app->reply_most};
        if (seen != ANY_VERSION)
            written.version = seen + 1;
        material_write(&bytes, &written);
        bytes_text(&bytes, "\n");
        material_tag(slug, revision, written.version, tag);
        snprintf(reply->etag, sizeof reply->etag, "\"%s\"", tag);
        snprintf(reply->cache_control, sizeof reply->cache_control, "no-cache");
        if (code == 201)
            snprintf(reply->location, sizeof reply->location, "/v1/materials/%.63s@%llu", slug,
                     (unsigned long long)revision);
        material_revision_clear(&written);
        return reply_bytes(reply, code, type_json, &bytes, problem);
    }
    material_revision_clear(&written);
    return status;
}

Status materials_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialBody body = {0};
    Status status = read_body(request, "material", new_material_fields, &body, problem);
    if (is_object(status, problem) && body.slug != NULL) {
        const Status slug = slug_check(body.slug, "/slug", problem);
        status = status != STATUS_OK ? status : slug;
    }
    status = judge(&body, 0, status, problem);
    MaterialRevision first = {.slug = body.slug,
                              .material = body.material,
                              .author = (char *)request->client,
                              .comment = body.comment != NULL ? body.comment : "new material",
                              .created_unix_ms = clock_unix_ms()};
    if (status == STATUS_OK)
        status = material_write_lists(&first, problem);
    if (status == STATUS_OK)
        status = db_material_add(app->db, &first, problem);
    if (status == STATUS_OK)
        status = tell(app, body.slug, 1, 0, 201, reply, problem);
    free(first.lists);
    fields_clear(new_material_fields, &body);
    return status;
}

Status materials_revise(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialBody body = {0};
    MaterialState state;
    uint64_t seen;
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, slug, true, &seen, &state, problem));
    Status status = read_body(request, "revision", material_revision_fields, &body, problem);
    status = judge(&body, state.measurements, status, problem);
    MaterialRevision next = {.slug = (char *)slug,
                             .material = body.material,
                             .author = (char *)request->client,
                             .comment = body.comment,
                             .created_unix_ms = clock_unix_ms()};
    if (status == STATUS_OK)
        status = material_write_lists(&next, problem);
    if (status == STATUS_OK)
        status = db_material_revise(app->db, &next, seen, problem);
    if (status == STATUS_OK)
        status = tell(app, slug, next.revision, seen, 201, reply, problem);
    free(next.lists);
    fields_clear(material_revision_fields, &body);
    return status;
}

static Status check_revert(const MaterialRevertBody *body, const char *slug, uint64_t latest,
                           Status status, Problem *problem) {
    if (!is_object(status, problem))
        return status;
    const Status why = check_why(body->comment, "/comment", problem);
    if (body->to != COUNT_ABSENT && body->to > latest)
        return problem_add_real(problem, STATUS_INVALID, "/to", (double)body->to, NULL,
                                "must be a revision of \"%.63s\", which has %llu, is %llu", slug,
                                (unsigned long long)latest, (unsigned long long)body->to);
    return status != STATUS_OK ? status : why;
}

// The old row once more, under its own lists to the byte.
static Status say_again(App *app, const Request *request, const MaterialRevertBody *body,
                        uint64_t seen, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevision old = {0};
    Status status = db_material(app->db, slug, body->to, &old, problem);
    MaterialRevision next = {.slug = (char *)slug,
                             .material = old.material,
                             .lists = old.lists,
                             .reverts = body->to,
                             .author = (char *)request->client,
                             .comment = body->comment,
                             .created_unix_ms = clock_unix_ms()};
    if (status == STATUS_OK)
        status = db_material_revise(app->db, &next, seen, problem);
    material_revision_clear(&old);
    return status != STATUS_OK ? status : tell(app, slug, next.revision, seen, 201, reply, problem);
}

Status materials_revert(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevertBody body = {0};
    MaterialState state;
    uint64_t seen;
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, slug, true, &seen, &state, problem));
    Status status = read_body(request, "revert", material_revert_fields, &body, problem);
    status = check_revert(&body, slug, state.latest, status, problem);
    if (status == STATUS_OK)
        status = say_again(app, request, &body, seen, reply, problem);
    fields_clear(material_revert_fields, &body);
    return status;
}

Status materials_review(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialReviewBody body = {0};
    MaterialState state;
    uint64_t seen, revision;
    TRY(material_revision_number(request->parameters[1], &revision, problem));
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, slug, true, &seen, &state, problem));
    Status status = read_body(request, "review", material_review_fields, &body, problem);
    if (is_object(status, problem)) {
        const Status why = check_why(body.reason, "/reason", problem);
        status = status != STATUS_OK ? status : why;
    }
    if (status == STATUS_OK) {
        const MaterialReview review = {.slug = (char *)slug,
                                       .revision = revision,
                                       .status = (char *)material_verdicts[body.status],
                                       .reason = body.reason,
                                       .reviewer = (char *)request->client,
                                       .created_unix_ms = clock_unix_ms()};
        status = db_material_review(app->db, &review, seen, problem);
    }
    if (status == STATUS_OK)
        status = tell(app, slug, revision, seen, 200, reply, problem);
    fields_clear(material_review_fields, &body);
    return status;
}
