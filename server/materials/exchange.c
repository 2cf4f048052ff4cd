// The same rows stand in both kinds of files: in a document below their material, in a table with
// its slug.
#include "server/materials/exchange.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/rfc3339.h"
#include "server/json/encode.h"
#include "server/json/material_bodies.h"
#include "server/materials/material.h"
#include "server/materials/slug.h"

enum { NAME_MAX = 64, WORDS_MAX = 10000, POINTER_SIZE = sizeof((Fault){0}.pointer) };

const char exchange_format[] = "impactd-materials";
static const char *const kind_names[] = {
    [EXCHANGE_REVISION] = "revision", [EXCHANGE_MEASUREMENT] = "measurement", NULL};

// clang-format off
static const Field review_fields[] = {
    FIELD_CHOICE(ExchangeReview, status, material_verdicts, REQUIRED, "what was found"),
    FIELD_TEXT(ExchangeReview, reason, WORDS_MAX, PRESENCE_REQUIRED, 0, "why"),
    FIELD_TEXT(ExchangeReview, reviewer, NAME_MAX, PRESENCE_OPTIONAL, FIELD_NULL_IS_EMPTY, "whose review it is; null: nobody known; if absent, the importer's"),
    FIELD_TEXT(ExchangeReview, created, 40, PRESENCE_OPTIONAL, 0, "when; if absent, now"),
    FIELD_END
};

#define NUMBER(name_, doc_) {.name = name_, .kind = FIELD_KIND_COUNT, .offset = offsetof(ExchangeRow, number), \
    .range = WITHIN(1, 1e9), .presence = PRESENCE_OPTIONAL, .doc = doc_}
#define MATERIAL FIELD_BASE(ExchangeRow, material, material_fields)
#define REVERTS FIELD_COUNT(ExchangeRow, reverts, NULL, WITHIN(1, 1e9), OPTIONAL, "the revision that it says again")
#define AUTHOR FIELD_TEXT(ExchangeRow, author, NAME_MAX, PRESENCE_OPTIONAL, FIELD_NULL_IS_EMPTY, "who wrote it; null: nobody known; if absent, the importer")
#define COMMENT FIELD_TEXT(ExchangeRow, comment, WORDS_MAX, PRESENCE_OPTIONAL, 0, "why it was written")
#define CREATED FIELD_TEXT(ExchangeRow, created, 40, PRESENCE_OPTIONAL, 0, "when, RFC 3339; if absent, now")
#define REVIEWS FIELD_LIST(ExchangeRow, reviews, review_fields, 1000, PRESENCE_OPTIONAL, "what others think of it, in their order")
#define TEST(presence_) FIELD_ITEM(ExchangeRow, test, drop_test_fields, NULL, presence_, "the drop test as it was done")

const Field exchange_revision_fields[] = {
    NUMBER("revision", "its number; if absent, the next"),
    MATERIAL, REVERTS, AUTHOR, COMMENT, CREATED, REVIEWS,
    FIELD_END
};

const Field exchange_measurement_fields[] = {
    NUMBER("measurement", "its number; if absent, the next"),
    AUTHOR, COMMENT, CREATED, TEST(PRESENCE_REQUIRED),
    FIELD_END
};

// What is not the material's own and not its number.
static const Field mark_fields[] = {AUTHOR, COMMENT, CREATED, FIELD_END};
static const Field revision_mark_fields[] = {REVERTS, REVIEWS, FIELD_END};

const Field exchange_row_fields[] = {
    FIELD_CHOICE(ExchangeRow, row, kind_names, EXCHANGE_REVISION, "what stands in the row"),
    FIELD_TEXT(ExchangeRow, slug, 0, PRESENCE_REQUIRED, 0, "the material's, of a-z, 0-9, _ and -"),
    NUMBER("number", "of the revision or measurement; if absent, the next"),
    MATERIAL, REVERTS, AUTHOR, COMMENT, CREATED, REVIEWS, TEST(PRESENCE_OPTIONAL),
    FIELD_END
};
// clang-format on

void exchange_clear(Exchange *exchange) {
    MaterialImport *import = &exchange->import;
    for (size_t i = 0; i < import->revision_count; i++)
        import_revision_clear(&import->revisions[i]);
    for (size_t i = 0; i < import->measurement_count; i++)
        import_measurement_clear(&import->measurements[i]);
    free(import->revisions);
    free(import->measurements);
    *exchange = (Exchange){.revision_room = 0};
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
}

// Room for one more of `size` bytes behind `count`.
static bool grow(void **at, size_t *room, size_t count, size_t size) {
    if (count < *room)
        return true;
    const size_t wanted = *room > 0 ? 2 * *room : 64;
    void *grown = realloc(*at, wanted * size);
    if (grown == NULL)
        return false;
    *at = grown;
    *room = wanted;
    return true;
}

// Milliseconds, from 1970 on; 0 where there is no such time, which is told.
static int64_t read_time(const char *text, const char *place, Problem *problem) {
    int64_t unix_ms = 0;
    char pointer[POINTER_SIZE];
    if (text == NULL || (rfc3339_read(text, &unix_ms) && unix_ms > 0))
        return unix_ms;
    Fault fault = {.row = 0};
    json_pointer_join(pointer, sizeof pointer, place, "created");
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, text);
    text_fit(fault.detail, sizeof fault.detail,
             "must be a date or a time after 1970, as 2026-11-21 or 2026-11-21T09:30:00.000Z");
    (void)problem_add_fault(problem, STATUS_INVALID, &fault);
    return 0;
}

// Takes a text over; what is empty is nobody known.
static char *take_name(char **text) {
    char *taken = *text;
    *text = NULL;
    if (taken == NULL || taken[0] != '\0')
        return taken;
    free(taken);
    return NULL;
}

static char *take_text(char **text) {
    char *taken = *text;
    *text = NULL;
    return taken;
}

static bool take_reviews(ImportRevision *revision, ExchangeReviews *reviews, Problem *problem) {
    char list[POINTER_SIZE], place[POINTER_SIZE];
    if (reviews->count == 0)
        return true;
    revision->reviews = calloc(reviews->count, sizeof *revision->reviews);
    if (revision->reviews == NULL)
        return false;
    json_pointer_join(list, sizeof list, revision->mark.place, "reviews");
    for (size_t i = 0; i < reviews->count; i++) {
        ExchangeReview *review = &reviews->at[i];
        ImportReview *taken = &revision->reviews[revision->review_count++];
        json_pointer_index(place, sizeof place, list, i);
        taken->has_reviewer = review->reviewer != NULL;
        taken->has_created = review->created != NULL;
        taken->review.created_unix_ms = read_time(review->created, place, problem);
        taken->review.reason = take_text(&review->reason);
        taken->review.reviewer = take_name(&review->reviewer);
        taken->review.status = strdup(review->status >= 0 ? material_verdicts[review->status] : "");
        if (taken->review.status == NULL)
            return false;
    }
    return true;
}

// What both kinds of rows have.
static void mark_row(RowInfo *mark, const ExchangeRow *row, const char *place, const char *name,
                     size_t order, Problem *problem) {
    char number[POINTER_SIZE];
    json_pointer_join(number, sizeof number, place, name);
    if (row->number == 0)
        (void)problem_add_real(problem, STATUS_INVALID, number, 0, NULL,
                               "must be at least 1, is 0: numbers count from 1");
    (void)fields_validate(mark_fields, row, place, problem);
    text_fit(mark->place, sizeof mark->place, place);
    mark->order = order;
    mark->is_adrift = problem_concerns(problem, number);
    mark->has_author = row->author != NULL;
    mark->has_comment = row->comment != NULL;
    mark->has_created = row->created != NULL;
}

static uint64_t number_of(const ExchangeRow *row) {
    return row->number != COUNT_ABSENT ? row->number : 0;
}

static Status take_revision(ImportRevision *revision, char *slug, ExchangeRow *row, size_t faults,
                            Problem *problem) {
    RowInfo *mark = &revision->mark;
    MaterialRevision *said = &revision->said;
    said->slug = slug;
    (void)material_validate(&row->material, mark->place, problem);
    (void)fields_validate(revision_mark_fields, row, mark->place, problem);
    said->revision = number_of(row);
    said->reverts = row->reverts != COUNT_ABSENT ? row->reverts : 0;
    said->created_unix_ms = read_time(row->created, mark->place, problem);
    mark->has_created = mark->has_created && said->created_unix_ms > 0;
    said->author = take_name(&row->author);
    said->comment = take_text(&row->comment);
    said->material = row->material;
    memset(&row->material, 0, sizeof row->material);
    const bool is_taken = take_reviews(revision, &row->reviews, problem);
    mark->is_faulty = problem->count > faults;
    return is_taken ? material_write_lists(said, problem) : no_memory(problem);
}

static Status take_measurement(ImportMeasurement *measurement, char *slug, ExchangeRow *row,
                               size_t faults, Problem *problem) {
    RowInfo *mark = &measurement->mark;
    MaterialMeasurement *made = &measurement->made;
    char test[POINTER_SIZE];
    made->slug = slug;
    json_pointer_join(test, sizeof test, mark->place, "test");
    if (!problem_concerns(problem, test))
        (void)drop_test_validate(&row->test, test, problem);
    made->measurement = number_of(row);
    made->created_unix_ms = read_time(row->created, mark->place, problem);
    mark->has_created = mark->has_created && made->created_unix_ms > 0;
    made->author = take_name(&row->author);
    made->comment = take_text(&row->comment);
    mark->is_faulty = problem->count > faults;
    if (mark->is_faulty)
        return STATUS_OK;
    Bytes bytes = {.most = 0};
    encode_item(&bytes, drop_test_fields, &row->test, WRITE_SCENE);
    made->document = bytes_take(&bytes, NULL);
    return made->document != NULL ? STATUS_OK : no_memory(problem);
}

// Room for one more of a kind, all zero.
static void *add(Exchange *exchange, ExchangeKind kind) {
    MaterialImport *import = &exchange->import;
    const bool is_revision = kind == EXCHANGE_REVISION;
    const size_t size = is_revision ? sizeof *import->revisions : sizeof *import->measurements;
    size_t *room = is_revision ? &exchange->revision_room : &exchange->measurement_room,
           *count = is_revision ? &import->revision_count : &import->measurement_count;
    void *at = is_revision ? (void *)import->revisions : (void *)import->measurements;
    if (!grow(&at, room, *count, size))
        return NULL;
    if (is_revision)
        import->revisions = at;
    else
        import->measurements = at;
    return memset((char *)at + (*count)++ * size, 0, size);
}

static Status take(Exchange *exchange, char *slug, ExchangeKind kind, ExchangeRow *row,
                   const char *place, size_t faults, Problem *problem) {
    const MaterialImport *import = &exchange->import;
    const size_t order = import->revision_count + import->measurement_count;
    void *added = add(exchange, kind);
    if (added == NULL || slug == NULL) {
        free(slug);
        return no_memory(problem);
    }
    if (kind == EXCHANGE_REVISION) {
        mark_row(&((ImportRevision *)added)->mark, row, place, import->revision_name, order,
                 problem);
        return take_revision(added, slug, row, faults, problem);
    }
    mark_row(&((ImportMeasurement *)added)->mark, row, place, import->measurement_name, order,
             problem);
    return take_measurement(added, slug, row, faults, problem);
}

// Of which material it is cannot be known: it is judged and given up.
static Status pass(const MaterialImport *import, ExchangeKind kind, ExchangeRow *row,
                   const char *place, size_t faults, Problem *problem) {
    ImportRevision revision = {.reviews = NULL};
    ImportMeasurement measurement = {.made = {0}};
    Status status;
    if (kind == EXCHANGE_REVISION) {
        mark_row(&revision.mark, row, place, import->revision_name, 0, problem);
        status = take_revision(&revision, NULL, row, faults, problem);
    } else {
        mark_row(&measurement.mark, row, place, import->measurement_name, 0, problem);
        status = take_measurement(&measurement, NULL, row, faults, problem);
    }
    import_revision_clear(&revision);
    import_measurement_clear(&measurement);
    return status;
}

Status exchange_refuse_many(Problem *problem) {
    return problem_set(problem, STATUS_LIMIT,
                       "there are more than %d revisions and measurements; bring them in several "
                       "files",
                       EXCHANGE_ROWS_MAX);
}

static bool is_full(const Exchange *exchange) {
    return exchange->import.revision_count + exchange->import.measurement_count >=
           EXCHANGE_ROWS_MAX;
}

Status exchange_take(Exchange *exchange, const char *slug, ExchangeKind kind, ExchangeRow *row,
                     const char *place, const char *slug_place, size_t faults, Problem *problem) {
    const bool is_known = slug_check(slug != NULL ? slug : "", slug_place, problem) == STATUS_OK;
    Status status;
    if (is_full(exchange))
        status = exchange_refuse_many(problem);
    else if (is_known)
        status = take(exchange, strdup(slug), kind, row, place, faults, problem);
    else
        status = pass(&exchange->import, kind, row, place, faults, problem);
    fields_clear(exchange_row_fields, row);
    return status;
}

Status exchange_drift(Exchange *exchange, const char *slug, const char *place, Problem *problem) {
    if (is_full(exchange))
        return exchange_refuse_many(problem);
    if (slug == NULL || !material_slug_is_valid(slug))
        return STATUS_OK;
    ImportRevision *revision = add(exchange, EXCHANGE_REVISION);
    ImportMeasurement *measurement = add(exchange, EXCHANGE_MEASUREMENT);
    if (revision != NULL)
        revision->said.slug = strdup(slug);
    if (measurement != NULL)
        measurement->made.slug = strdup(slug);
    if (revision == NULL || measurement == NULL || revision->said.slug == NULL ||
        measurement->made.slug == NULL)
        return no_memory(problem);
    revision->mark.is_faulty = revision->mark.is_adrift = true;
    text_fit(revision->mark.place, sizeof revision->mark.place, place);
    measurement->mark = revision->mark;
    return STATUS_OK;
}
