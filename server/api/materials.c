// Materials: list, heads and revisions, new revisions, reviews, export and import. Each write adds
// rows and an audit entry. A writer names the version that it saw (If-Match); of two writers who
// saw the same version one is refused.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/http/header.h"
#include "server/json/parse.h"
#include "server/json/schema.h"
#include "server/materials/exchange.h"
#include "server/materials/material.h"
#include "server/util/bytes.h"
#include "server/util/clock.h"

enum { LIST_INITIAL = 100, LIST_MAX = 1000, HEADS_READ = 100 };
enum { EXPORT_WHOLE_MAX = 4 << 20 }; // a longer export is sent while it is made

// Shared.

void material_tag(const char *slug, uint64_t revision, uint64_t version, char tag[MATERIAL_TAG]) {
    snprintf(tag, MATERIAL_TAG, "%.63s@%llu-%llu", slug, (unsigned long long)revision,
             (unsigned long long)version);
}

bool material_is_cached(const Request *request, Reply *reply, const MaterialState *state) {
    char tag[MATERIAL_TAG];
    material_tag(request->parameters[0], state->latest, state->version, tag);
    return reply_tagged(reply, request, tag);
}

Status material_number(const char *text, const char *what, uint64_t *number, Problem *problem) {
    *number = 0;
    if (text == NULL) // the head
        return STATUS_OK;
    const size_t size = strlen(text);
    if (size <= 9 && strspn(text, "0123456789") == size)
        *number = strtoull(text, NULL, 10);
    return *number > 0 ? STATUS_OK
                       : problem_set(problem, STATUS_NOT_FOUND,
                                     "there is no %s \"%.20s\"; they count from 1", what, text);
}

Status material_page_read(const Request *request, size_t initial, size_t max, uint64_t newest,
                          MaterialPage *page, Problem *problem) {
    const size_t all = (size_t)newest + 1;
    TRY(request_count(request, "limit", 1, max, initial, &page->limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, all, &page->before, problem));
    page->before = page->before < all ? page->before : all;
    return STATUS_OK;
}

void material_page_link(const Request *request, Reply *reply, uint64_t last, Bytes *body) {
    char number[24];
    snprintf(number, sizeof number, "%llu", (unsigned long long)last);
    if (last > 1)
        reply_link_next(request, reply, "before", number, body);
}

Status material_body_read(const Request *request, const char *whose, const Field *fields,
                          void *item, Problem *problem) {
    TRY(request_require_json(request, problem));
    problem->whose = whose;
    const Status status = json_parse(request->body, request->body_size, fields, item, problem);
    const bool is_object = status == STATUS_INVALID && problem->faults[0].pointer[0] != '\0';
    if (status != STATUS_OK && !is_object)
        return status;
    (void)fields_validate(fields, item, "", problem);
    return STATUS_OK;
}

// A number of at most 18 digits; *text moves on.
static bool tag_read_count(const char **text, const char *end, uint64_t *count) {
    const char *from = *text;
    *count = 0;
    for (; *text < end && **text >= '0' && **text <= '9'; (*text)++)
        *count = 10 * *count + (uint64_t)(**text - '0');
    return *text > from && *text - from <= 18;
}

// The version in a tag of this material, with its quotes; that of a compressed body ends in a word.
static bool tag_read(const char *tag, size_t size, const char *slug, uint64_t *version) {
    const char *end = tag + size - 1, *text = tag + 1;
    const size_t length = strlen(slug);
    uint64_t revision;
    if (size < length + 6 || memcmp(text, slug, length) != 0 || text[length] != '@')
        return false;
    text += length + 1;
    return tag_read_count(&text, end, &revision) && *text++ == '-' &&
           tag_read_count(&text, end, version) && (text == end || *text == '-');
}

Status material_condition(App *app, const Request *request, bool is_required, uint64_t *version,
                          MaterialState *state, Problem *problem) {
    const char *slug = request->parameters[0], *list = request->if_match, *tag;
    uint64_t seen = 0, newest = 0;
    char now[MATERIAL_TAG];
    size_t size;
    *version = ANY_VERSION;
    TRY(db_material_state(app->db, slug, state, problem));
    material_tag(slug, state->latest, state->version, now);
    if (list == NULL)
        return !is_required ? STATUS_OK
                            : problem_set(problem, STATUS_UNCONDITIONAL,
                                          "If-Match is required: the ETag of GET "
                                          "/v1/materials/%.63s when you read it; now it is \"%s\"",
                                          slug, now);
    while (header_etag_next(&list, &tag, &size)) {
        if (*tag == '*')
            return STATUS_OK;
        if (!tag_read(tag, size, slug, &seen))
            continue;
        if (seen == state->version) {
            *version = seen;
            return STATUS_OK;
        }
        newest = seen > newest ? seen : newest;
    }
    if (newest == 0)
        return problem_set(problem, STATUS_STALE,
                           "If-Match has no ETag of the material \"%.63s\": now it is \"%s\", you "
                           "sent %.80s",
                           slug, now, request->if_match);
    return problem_set(
        problem, STATUS_STALE,
        "the material \"%.63s\" has changed: it is at version %llu, you read version "
        "%llu; read it again",
        slug, (unsigned long long)state->version, (unsigned long long)newest);
}

// List.

// "0.4..0.7", "0.4..", "..0.7" or "0.4", both ends included; without it everything, also NAN.
typedef struct SearchRange {
    double least, most;
    bool is_asked;
} SearchRange;

static Status search_range(const Request *request, const char *name, SearchRange *range,
                           Problem *problem) {
    const char *text;
    *range = (SearchRange){(double)-INFINITY, (double)INFINITY, false};
    TRY(request_text(request, name, &text, problem));
    if (text == NULL)
        return STATUS_OK;
    const char *dots = strstr(text, "..");
    const size_t first = dots != NULL ? (size_t)(dots - text) : strlen(text);
    const char *second = dots != NULL ? dots + 2 : text;
    // Either end may be left out.
    const bool is_read =
        (first == 0 || request_read_real(text, first, &range->least)) &&
        (*second == '\0' || request_read_real(second, strlen(second), &range->most)) &&
        strcmp(text, "..") != 0;
    if (!is_read || range->least > range->most)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" must be a number or a rising range, as "
                           "0.4..0.7, 0.4.. or ..0.7, is \"%.40s\"",
                           name, text);
    range->is_asked = true;
    return STATUS_OK;
}

static bool search_range_has(const SearchRange *range, double value) {
    return !range->is_asked || (value >= range->least && value <= range->most);
}

typedef struct MaterialSearch {
    Bytes words, kind; // case folded; empty: any
    const char *after;
    int status; // CHOICE_ABSENT: any
    SearchRange restitution, contact_time;
    size_t limit;
} MaterialSearch;

static Status search_read_folded(const Request *request, const char *name, Bytes *folded,
                                 Problem *problem) {
    const char *text;
    TRY(request_text(request, name, &text, problem));
    if (text != NULL)
        bytes_folded(folded, text);
    return STATUS_OK;
}

static const char *const search_statuses[] = {"draft", "approved", "deprecated", NULL};

static Status search_read(const Request *request, MaterialSearch *search, Problem *problem) {
    TRY(search_read_folded(request, "q", &search->words, problem));
    TRY(search_read_folded(request, "kind", &search->kind, problem));
    TRY(request_choice(request, "status", search_statuses, CHOICE_ABSENT, &search->status,
                       problem));
    TRY(search_range(request, "e", &search->restitution, problem));
    TRY(search_range(request, "T_c", &search->contact_time, problem));
    TRY(request_text(request, "after", &search->after, problem));
    return request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &search->limit, problem);
}

// Without memory for a search the answer `bytes` fails.
static bool search_has_words(const MaterialRevision *revision, const char *words, Bytes *bytes) {
    const Material *material = &revision->material;
    const char *const texts[] = {revision->slug,     material->name,   material->kind,
                                 material->supplier, material->source, material->notes};
    Bytes lines = {0}; // a query has no line breaks
    for (size_t i = 0; i < COUNT(texts) + material->tags.count; i++) {
        const char *text = i < COUNT(texts) ? texts[i] : material->tags.at[i - COUNT(texts)];
        if (text != NULL)
            bytes_folded(&lines, text);
        bytes_text(&lines, "\n");
    }
    bytes->is_failed = bytes->is_failed || lines.is_failed;
    const bool is_found = lines.at != NULL && strstr(lines.at, words) != NULL;
    bytes_clear(&lines);
    return is_found;
}

static bool search_has_kind(const Material *material, const char *kind, Bytes *bytes) {
    Bytes own = {0};
    if (material->kind != NULL)
        bytes_folded(&own, material->kind);
    bytes->is_failed = bytes->is_failed || own.is_failed;
    const bool is_same = own.at != NULL && strcmp(own.at, kind) == 0;
    bytes_clear(&own);
    return is_same;
}

// One row of a table in both ranges is enough.
static bool search_in_ranges(const MaterialSearch *search, const Material *material) {
    const SearchRange *restitution = &search->restitution, *contact_time = &search->contact_time;
    for (size_t i = 0; i < material->table.count; i++)
        if (search_range_has(restitution, material->table.at[i].restitution) &&
            search_range_has(contact_time, material->table.at[i].contact_time))
            return true;
    return material->table.count == 0 && search_range_has(restitution, material->restitution) &&
           search_range_has(contact_time, material->contact_time);
}

static bool search_matches(const MaterialSearch *search, const MaterialRevision *revision,
                           Bytes *bytes) {
    const Material *material = &revision->material;
    return (search->status == CHOICE_ABSENT ||
            strcmp(revision->status, search_statuses[search->status]) == 0) &&
           (search->kind.at == NULL || search_has_kind(material, search->kind.at, bytes)) &&
           search_in_ranges(search, material) &&
           (search->words.at == NULL || search_has_words(revision, search->words.at, bytes));
}

// Writes at most search->limit heads; *is_more: there is another after `last`.
static Status search_run(Db *db, const MaterialSearch *search, Bytes *bytes,
                         char last[MATERIAL_SLUG_MAX + 1], bool *is_more, Problem *problem) {
    char after[REQUEST_TEXT_MAX + 1];
    size_t count = 0;
    bool is_end = false;
    text_fit(after, sizeof after, search->after != NULL ? search->after : "");
    for (*is_more = false; !is_end && !*is_more;) {
        MaterialRevisions heads;
        TRY(db_material_heads(db, after, HEADS_READ, &heads, problem));
        for (size_t i = 0; i < heads.count && !*is_more; i++) {
            const MaterialRevision *head = &heads.at[i];
            if (!search_matches(search, head, bytes))
                continue;
            if ((*is_more = count == search->limit))
                break;
            bytes_text(bytes, count++ > 0 ? ",\n " : "");
            material_write(bytes, head);
            text_fit(last, MATERIAL_SLUG_MAX + 1, head->slug);
        }
        is_end = heads.count < HEADS_READ;
        if (!is_end)
            text_fit(after, sizeof after, heads.at[heads.count - 1].slug);
        material_revisions_clear(&heads);
    }
    return STATUS_OK;
}

Status materials_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialSearch search = {0};
    Bytes bytes = {.most = app->reply_most};
    char last[MATERIAL_SLUG_MAX + 1] = "";
    bool is_more;
    bytes_text(&bytes, "{\"materials\": [");
    Status status = search_read(request, &search, problem);
    if (status == STATUS_OK)
        status = search_run(app->db, &search, &bytes, last, &is_more, problem);
    if (status == STATUS_OK && is_more)
        reply_link_next(request, reply, "after", last, &bytes);
    bytes_clear(&search.words);
    bytes_clear(&search.kind);
    bytes_text(&bytes, "]}\n");
    return reply_json(reply, 200, &bytes, status, problem);
}

// One revision.

static Bytes revision_body(const App *app, const MaterialRevision *revision) {
    Bytes bytes = {.most = app->reply_most};
    material_write(&bytes, revision);
    bytes_text(&bytes, "\n");
    return bytes;
}

Status materials_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialRevision revision;
    uint64_t number;
    TRY(material_number(request->parameters[1], "revision", &number, problem));
    Status status = db_material(app->db, request->parameters[0], number, &revision, problem);
    if (status == STATUS_OK) {
        char tag[MATERIAL_TAG];
        material_tag(revision.slug, revision.revision, revision.version, tag);
        if (!reply_tagged(reply, request, tag)) {
            Bytes bytes = revision_body(app, &revision);
            status = reply_bytes(reply, 200, type_json, &bytes, problem);
        }
    }
    material_revision_clear(&revision);
    return status;
}

// Writing.

static void validate_reason(const char *text, const char *pointer, Problem *problem) {
    if (text != NULL && text[strspn(text, " \t\r\n")] == '\0')
        (void)problem_add(problem, STATUS_INVALID, pointer,
                          "must not be empty: the history shows it");
}

static void validate_measurements(const Material *material, uint64_t count, Problem *problem) {
    for (size_t i = 0; i < material->measurements.count; i++) {
        const double number = material->measurements.at[i];
        char place[64];
        if (number <= (double)count)
            continue;
        snprintf(place, sizeof place, "/measurements/%zu", i);
        (void)problem_add_real(problem, STATUS_INVALID, place, number, NULL,
                               count == 0 ? "the material has no measurements yet"
                                          : "must be one of its measurements, 1 to %llu",
                               (unsigned long long)count);
    }
}

// The reply of a write, whose body was made before it. The tag is that of the client's own write,
// even if another has followed: the client's next write is then refused.
static Status revision_reply(const MaterialRevision *revision, int code, Bytes *body, Reply *reply,
                             Problem *problem) {
    char tag[MATERIAL_TAG];
    material_tag(revision->slug, revision->revision, revision->version, tag);
    snprintf(reply->etag, sizeof reply->etag, "\"%s\"", tag);
    snprintf(reply->cache_control, sizeof reply->cache_control, "no-cache");
    if (code == 201)
        snprintf(reply->location, sizeof reply->location, "/v1/materials/%.63s@%llu",
                 revision->slug, (unsigned long long)revision->revision);
    return reply_json(reply, code, body, STATUS_OK, problem);
}

// Writes a revision of the client's and shows it. The body of the reply is made first: if that
// fails nothing is written.
static Status revision_save(App *app, const Request *request, MaterialRevision *revision,
                            const MaterialState *state, uint64_t seen, Reply *reply,
                            Problem *problem) {
    revision->author = (char *)request->client;
    revision->created_unix_ms = clock_unix_ms();
    revision->status = "draft";
    revision->revision = revision->latest = state->latest + 1;
    revision->version = state->version + 1;
    Bytes body = revision_body(app, revision);
    Status status = body.is_failed        ? reply_json(reply, 201, &body, STATUS_OK, problem)
                    : state->version == 0 ? db_material_add(app->db, revision, problem)
                                          : db_material_revise(app->db, revision, seen, problem);
    if (status == STATUS_OK &&
        revision->revision != state->latest + 1) { // another client was first
        revision->latest = revision->revision;
        bytes_clear(&body);
        body = revision_body(app, revision);
    }
    if (status == STATUS_OK)
        return revision_reply(revision, 201, &body, reply, problem);
    bytes_clear(&body);
    return status;
}

// What a change of the material in the path brings: its condition and its body.
static Status change_read(App *app, const Request *request, const char *whose, const Field *fields,
                          void *body, MaterialState *state, uint64_t *seen, Problem *problem) {
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, true, seen, state, problem));
    return material_body_read(request, whose, fields, body, problem);
}

// `state` is that of the material; all zero: it is new.
static Status material_body_save(App *app, const Request *request, const char *slug,
                                 const MaterialBody *body, const MaterialState *state,
                                 uint64_t seen, Reply *reply, Problem *problem) {
    static char comment[] = "new material";
    (void)material_validate(&body->material, "", problem);
    validate_measurements(&body->material, state->measurements, problem);
    validate_reason(body->comment, "/comment", problem);
    if (problem->count > 0)
        return STATUS_INVALID;
    MaterialRevision revision = {.slug = (char *)slug,
                                 .material = body->material,
                                 .comment = body->comment != NULL ? body->comment : comment};
    return revision_save(app, request, &revision, state, seen, reply, problem);
}

Status materials_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    const MaterialState none = {0};
    MaterialBody body = {0};
    Status status = material_body_read(request, "material", new_material_fields, &body, problem);
    if (status == STATUS_OK && body.slug != NULL)
        (void)slug_validate(body.slug, "/slug", problem);
    if (status == STATUS_OK)
        status = material_body_save(app, request, body.slug, &body, &none, 0, reply, problem);
    fields_clear(new_material_fields, &body);
    return status;
}

Status materials_revise(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialBody body = {0};
    MaterialState state;
    uint64_t seen;
    Status status = change_read(app, request, "revision", material_revision_fields, &body, &state,
                                &seen, problem);
    if (status == STATUS_OK)
        status = material_body_save(app, request, request->parameters[0], &body, &state, seen,
                                    reply, problem);
    fields_clear(material_revision_fields, &body);
    return status;
}

Status materials_revert(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialRevertBody body = {0};
    MaterialState state;
    MaterialRevision old = {0};
    uint64_t seen;
    Status status =
        change_read(app, request, "revert", material_revert_fields, &body, &state, &seen, problem);
    if (status == STATUS_OK) {
        validate_reason(body.comment, "/comment", problem);
        if (body.to != COUNT_ABSENT && body.to > state.latest)
            (void)problem_add_real(problem, STATUS_INVALID, "/to", (double)body.to, NULL,
                                   "must be a revision of \"%.63s\", 1 to %llu, is %llu", slug,
                                   (unsigned long long)state.latest, (unsigned long long)body.to);
        status = problem->count > 0 ? STATUS_INVALID
                                    : db_material(app->db, slug, body.to, &old, problem);
    }
    if (status == STATUS_OK) {
        MaterialRevision next = {.slug = (char *)slug,
                                 .material = old.material,
                                 .reverts = body.to,
                                 .comment = body.comment};
        status = revision_save(app, request, &next, &state, seen, reply, problem);
    }
    material_revision_clear(&old);
    fields_clear(material_revert_fields, &body);
    return status;
}

// As for a revision, the body of the reply is made first.
static Status review_save(App *app, const MaterialReview *review, const MaterialState *state,
                          uint64_t seen, Reply *reply, Problem *problem) {
    MaterialRevision stored;
    Bytes body = {.most = 0};
    Status status = db_material(app->db, review->slug, review->revision, &stored, problem);
    MaterialRevision shown = stored; // borrows
    shown.status = review->status;
    shown.reason = review->reason;
    shown.reviewer = review->reviewer;
    shown.reviewed_unix_ms = review->created_unix_ms;
    shown.version = state->version + 1;
    if (status == STATUS_OK) {
        body = revision_body(app, &shown);
        status = body.is_failed ? reply_json(reply, 200, &body, STATUS_OK, problem)
                                : db_material_review(app->db, review, seen, problem);
    }
    if (status == STATUS_OK)
        status = revision_reply(&shown, 200, &body, reply, problem);
    bytes_clear(&body);
    material_revision_clear(&stored);
    return status;
}

Status materials_review(App *app, const Request *request, Reply *reply, Problem *problem) {
    MaterialReviewBody body = {0};
    MaterialState state;
    uint64_t seen, revision;
    TRY(material_number(request->parameters[1], "revision", &revision, problem));
    Status status =
        change_read(app, request, "review", material_review_fields, &body, &state, &seen, problem);
    if (status == STATUS_OK) {
        validate_reason(body.reason, "/reason", problem);
        status = problem->count > 0 ? STATUS_INVALID : STATUS_OK;
    }
    if (status == STATUS_OK) {
        const MaterialReview review = {.slug = (char *)request->parameters[0],
                                       .revision = revision,
                                       .status = (char *)material_verdicts[body.status],
                                       .reason = body.reason,
                                       .reviewer = (char *)request->client,
                                       .created_unix_ms = clock_unix_ms()};
        status = review_save(app, &review, &state, seen, reply, problem);
    }
    fields_clear(material_review_fields, &body);
    return status;
}

// Export and import.

typedef struct ExportStream {
    MaterialExport export;
    Bytes made;
    size_t taken; // of it
    bool is_last;
} ExportStream;

static void export_stream_free(void *context) {
    ExportStream *stream = context;
    bytes_clear(&stream->made);
    free(stream);
}

static ptrdiff_t export_stream_next(void *context, char *target, size_t size) {
    ExportStream *stream = context;
    Bytes *made = &stream->made;
    size_t sent = 0;
    while (sent < size) {
        if (stream->taken == made->count) {
            if (stream->is_last)
                break;
            made->count = stream->taken = 0;
            if (material_export_next(&stream->export, made, &stream->is_last, NULL) != STATUS_OK)
                return STREAM_BROKEN;
            continue;
        }
        sent += bytes_hand(made, &stream->taken, target + sent, size - sent);
    }
    return sent > 0 ? (ptrdiff_t)sent : STREAM_END;
}

Status materials_export(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *format = request->parameters[0];
    const bool is_table = strcmp(format, format_csv.extension) == 0;
    const char *type = is_table ? format_csv.content_type : type_json;
    if (!is_table && strcmp(format, "json") != 0)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no materials.%.20s; there are materials.json and "
                           "materials.csv",
                           format);
    ExportStream *stream = calloc(1, sizeof *stream);
    if (stream == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
    // A short export is a whole body, which can be compressed.
    Status status = material_export_open(app->db, is_table, &stream->export, problem);
    while (status == STATUS_OK && !stream->is_last && stream->made.count < EXPORT_WHOLE_MAX)
        status = material_export_next(&stream->export, &stream->made, &stream->is_last, problem);
    if (status == STATUS_OK && !stream->is_last) {
        reply_borrow(reply, 200, type, NULL, 0);
        reply->stream = (Stream){.next = export_stream_next, .size = UINT64_MAX};
        reply->release = export_stream_free;
        reply->context = stream;
        return STATUS_OK;
    }
    if (status == STATUS_OK)
        status = reply_bytes(reply, 200, type, &stream->made, problem);
    export_stream_free(stream);
    return status;
}

static void import_put_count(Bytes *bytes, const char *name, const ImportCount *count) {
    bytes_json(bytes, ", \"%s\": {\"added\": %zu, \"same\": %zu}", name, count->added, count->same);
}

Status materials_import(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const char *const texts[] = {"text/csv", NULL};
    bool is_json;
    ImportOptions options = {.who = request->client,
                             .may_all = request->client == NULL || request->holder.is_admin};
    ImportTally tally;
    Bytes bytes = {.most = app->reply_most};
    TRY(request_flag(request, "dry_run", &options.is_dry, problem));
    TRY(request_require_type(
        request, texts, "application/json or text/csv",
        "; with curl use -H 'Content-Type: text/csv' --data-binary @materials.csv", &is_json,
        problem));
    options.is_table = !is_json;
    // First, so that the memory of a reply this short is there before anything is written.
    bytes_format(&bytes, "{\"dry_run\": %s", options.is_dry ? "true" : "false");
    Status status = bytes.is_failed ? STATUS_OK
                                    : import_file(app->db, request->body, request->body_size,
                                                  &options, &tally, problem);
    if (status == STATUS_OK && !bytes.is_failed) {
        bytes_format(&bytes, ", \"materials\": %zu", tally.materials);
        import_put_count(&bytes, "revisions", &tally.revisions);
        import_put_count(&bytes, "measurements", &tally.measurements);
        import_put_count(&bytes, "reviews", &tally.reviews);
        bytes_text(&bytes, "}\n");
    }
    return reply_json(reply, 200, &bytes, status, problem);
}
