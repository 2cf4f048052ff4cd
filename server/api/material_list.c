// GET /v1/materials: the head of each, by slug, a page at a time, by what it is called, what it is,
// what was measured and what became of it. A lab has hundreds: all are looked at.
#include <string.h>

#include "server/api/app.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/materials/material.h"
#include "server/util/utf8_fold.h"

enum { LIST_INITIAL = 100, LIST_MAX = 1000, LOOKED_AT = 100 };
static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

typedef struct Search {
    Bytes words, kind; // in lower case
    const char *after;
    int status; // -1: any
    QueryRange restitution, contact_time;
    size_t limit;
} Search;

static Status read_folded(const Request *request, const char *name, Bytes *folded,
                          Problem *problem) {
    const char *text;
    TRY(query_text(request, name, &text, problem));
    if (text != NULL)
        utf8_fold(folded, text);
    return STATUS_OK;
}

static Status read_search(const Request *request, Search *search, Problem *problem) {
    TRY(read_folded(request, "q", &search->words, problem));
    TRY(read_folded(request, "kind", &search->kind, problem));
    TRY(query_choice(request, "status", statuses, -1, &search->status, problem));
    TRY(query_range(request, "e", &search->restitution, problem));
    TRY(query_range(request, "T_c", &search->contact_time, problem));
    TRY(query_text(request, "after", &search->after, problem));
    return request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &search->limit, problem);
}

// A line for each text: words that are searched for hold no line's end.
static void put_line(Bytes *bytes, const char *text) {
    if (text != NULL)
        utf8_fold(bytes, text);
    bytes_text(bytes, "\n");
}

static bool has_words(const MaterialRevision *revision, const char *words) {
    const Material *said = &revision->material;
    const char *const texts[] = {revision->slug, said->name,   said->kind,
                                 said->supplier, said->source, said->notes};
    Bytes lines = {0};
    for (size_t i = 0; i < COUNT(texts); i++)
        put_line(&lines, texts[i]);
    for (size_t i = 0; i < said->tags.count; i++)
        put_line(&lines, said->tags.at[i]);
    const bool is_found = lines.at != NULL && strstr(lines.at, words) != NULL;
    bytes_clear(&lines);
    return is_found;
}

static bool is_of_kind(const Material *said, const char *kind) {
    Bytes own = {0};
    if (said->kind != NULL)
        utf8_fold(&own, said->kind);
    const bool is_same = own.at != NULL && strcmp(own.at, kind) == 0;
    bytes_clear(&own);
    return is_same;
}

// One row of a table is enough, and it has to lie in both ranges.
static bool is_in_ranges(const Material *said, const Search *search) {
    const QueryRange *restitution = &search->restitution, *contact_time = &search->contact_time;
    for (size_t i = 0; i < said->table.count; i++)
        if (query_range_has(restitution, said->table.at[i].restitution) &&
            query_range_has(contact_time, said->table.at[i].contact_time))
            return true;
    return said->table.count == 0 && query_range_has(restitution, said->restitution) &&
           query_range_has(contact_time, said->contact_time);
}

static bool is_meant(const MaterialRevision *revision, const Search *search) {
    const Material *said = &revision->material;
    if (search->status >= 0 && strcmp(revision->status, statuses[search->status]) != 0)
        return false;
    return (search->kind.at == NULL || is_of_kind(said, search->kind.at)) &&
           is_in_ranges(said, search) &&
           (search->words.at == NULL || has_words(revision, search->words.at));
}

typedef struct Listed {
    size_t count;
    char last[MATERIAL_SLUG_MAX + 1]; // shown
    bool is_more;
} Listed;

static Status put_some(MaterialRevisions *materials, const Search *search, Listed *list,
                       Bytes *bytes, Problem *problem) {
    for (size_t i = 0; i < materials->count && !list->is_more; i++) {
        MaterialRevision *material = &materials->at[i];
        TRY(material_read_lists(material, problem));
        if (!is_meant(material, search))
            continue;
        list->is_more = list->count == search->limit;
        if (list->is_more)
            break;
        bytes_text(bytes, list->count++ > 0 ? ",\n " : "");
        material_write(bytes, material);
        text_fit(list->last, sizeof list->last, material->slug);
    }
    return STATUS_OK;
}

// At most search->limit of them.
static Status put_list(Db *db, const Search *search, Listed *list, Bytes *bytes, Problem *problem) {
    char after[QUERY_TEXT_MAX + 1] = "";
    bool is_end = false;
    if (search->after != NULL)
        text_fit(after, sizeof after, search->after);
    while (!is_end && !list->is_more) {
        MaterialRevisions materials = {0};
        Status status = db_material_heads(db, after, LOOKED_AT, &materials, problem);
        if (status == STATUS_OK)
            status = put_some(&materials, search, list, bytes, problem);
        is_end = materials.count < LOOKED_AT;
        if (!is_end)
            text_fit(after, sizeof after, materials.at[materials.count - 1].slug);
        material_revisions_clear(&materials);
        TRY(status);
    }
    return STATUS_OK;
}

static Status answer(App *app, const Request *request, const Search *search, Reply *reply,
                     Problem *problem) {
    Listed list = {0};
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{\"materials\": [");
    const Status status = put_list(app->db, search, &list, &bytes, problem);
    bytes_text(&bytes, "]}\n");
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    if (list.is_more)
        query_link_next(request, reply, "after", list.last);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status materials_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    Search search = {0};
    Status status = read_search(request, &search, problem);
    if (status == STATUS_OK)
        status = answer(app, request, &search, reply, problem);
    bytes_clear(&search.words);
    bytes_clear(&search.kind);
    return status;
}
