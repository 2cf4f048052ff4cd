// Materials are read one by one as they stand in the text, so that no tree of them all is built.
#include "server/materials/exchange_json.h"

#include <stdio.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/json/parse.h"
#include "server/util/bytes.h"

typedef struct Envelope {
    char *format;
    uint64_t version;
    Texts materials; // none: they stand in a text of their own
} Envelope;

typedef struct ExchangeRows {
    ExchangeRow *at;
    size_t count;
} ExchangeRows;

typedef struct One {
    char *slug;
    ExchangeRows revisions, measurements;
} One;

// clang-format off
static const Field envelope_fields[] = {
    FIELD_TEXT(Envelope, format, 100, PRESENCE_REQUIRED, 0, "\"impactd-materials\""),
    FIELD_COUNT(Envelope, version, NULL, AT_MIN(1), REQUIRED, "of the format"),
    FIELD_TEXTS(Envelope, materials, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "all of them"),
    FIELD_END
};

static const Field one_fields[] = {
    FIELD_TEXT(One, slug, 0, PRESENCE_REQUIRED, 0, "of a-z, 0-9, _ and -"),
    FIELD_LIST(One, revisions, exchange_revision_fields, EXCHANGE_ROWS_MAX, PRESENCE_OPTIONAL, "by number"),
    FIELD_LIST(One, measurements, exchange_measurement_fields, EXCHANGE_ROWS_MAX, PRESENCE_OPTIONAL, "by number"),
    FIELD_END
};
// clang-format on

// The document without its materials, its lines where they were.
static Status read_envelope(const char *text, size_t size, const ScanList *list, bool has_list,
                            Problem *problem) {
    Bytes outer = {.most = 0};
    Envelope envelope;
    const size_t begin = has_list ? list->begin : size;
    bytes_put(&outer, text, begin);
    for (size_t i = begin; has_list && i < list->end; i++)
        if (text[i] == '\n')
            bytes_put(&outer, "\n", 1);
    if (has_list)
        bytes_put(&outer, text + list->end, size - list->end);
    if (outer.is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
    const Status status = json_parse(outer.at, outer.count, envelope_fields, &envelope, problem);
    if (status == STATUS_OK || status == STATUS_INVALID) {
        (void)fields_validate(envelope_fields, &envelope, "", problem);
        if (envelope.format != NULL && strcmp(envelope.format, exchange_format) != 0)
            (void)problem_add(problem, STATUS_INVALID, "/format", "must be \"%s\"",
                              exchange_format);
        if (envelope.version != COUNT_ABSENT && envelope.version != EXCHANGE_VERSION)
            (void)problem_add_real(problem, STATUS_INVALID, "/version", (double)envelope.version,
                                   NULL, "must be %d, which this program reads", EXCHANGE_VERSION);
        if (!has_list)
            (void)problem_add(problem, STATUS_INVALID, "/materials",
                              "is required: an array of materials");
    }
    fields_clear(envelope_fields, &envelope);
    bytes_clear(&outer);
    return status == STATUS_INVALID ? STATUS_OK : status;
}

static Status take_rows(Exchange *exchange, const One *one, ExchangeKind kind, ExchangeRows *rows,
                        const char *pointer, const char *name, size_t faults, Problem *problem) {
    char list[sizeof((Fault){0}.pointer)], place[sizeof list], slug[sizeof list];
    json_pointer_join(slug, sizeof slug, pointer, "slug");
    json_pointer_join(list, sizeof list, pointer, name);
    for (size_t i = 0; i < rows->count; i++) {
        json_pointer_index(place, sizeof place, list, i);
        // A fault of this row alone makes it a faulty one.
        const size_t before = problem_concerns(problem, place) ? faults : problem->count;
        TRY(exchange_take(exchange, one->slug, kind, &rows->at[i], place, slug, before, problem));
    }
    return STATUS_OK;
}

static Status take_one(Exchange *exchange, One *one, const char *pointer, size_t faults,
                       Problem *problem) {
    if (one->revisions.count == 0 && one->measurements.count == 0 &&
        !problem_concerns(problem, pointer))
        (void)problem_add(problem, STATUS_INVALID, pointer,
                          "has neither revisions nor measurements: give it one, or leave it out");
    TRY(take_rows(exchange, one, EXCHANGE_REVISION, &one->revisions, pointer, "revisions", faults,
                  problem));
    return take_rows(exchange, one, EXCHANGE_MEASUREMENT, &one->measurements, pointer,
                     "measurements", faults, problem);
}

static Status read_one(Exchange *exchange, const char *text, size_t size, const ScanList *list,
                       size_t index, Problem *problem) {
    char pointer[sizeof((Fault){0}.pointer)];
    One one;
    const size_t faults = problem->count;
    json_pointer_index(pointer, sizeof pointer, "/materials", index);
    Status status =
        json_parse_part(text, size, list->first, list->count, pointer, one_fields, &one, problem);
    if (status == STATUS_OK || status == STATUS_INVALID)
        status = take_one(exchange, &one, pointer, faults, problem);
    fields_clear(one_fields, &one);
    return status;
}

static Status read_all(const char *text, size_t size, Exchange *exchange, Problem *problem) {
    ScanList list;
    const bool has_list = scan_list(text, size, "materials", &list);
    // Of a document that is cut off the last material tells where.
    const bool is_whole = !has_list || list.end < size;
    if (is_whole)
        TRY(read_envelope(text, size, &list, has_list, problem));
    for (size_t i = 0; has_list && scan_element(&list); i++)
        TRY(i >= EXCHANGE_ROWS_MAX ? exchange_refuse_many(problem)
                                   : read_one(exchange, text, size, &list, i, problem));
    if (!is_whole)
        TRY(read_envelope(text, size, &list, has_list, problem));
    return problem->count > 0 ? STATUS_INVALID : STATUS_OK;
}

Status exchange_read_json(const char *text, size_t size, Exchange *exchange, Problem *problem) {
    const size_t mark = scan_mark(text, size);
    exchange->import.revision_name = "revision";
    exchange->import.measurement_name = "measurement";
    const Status status = read_all(text + mark, size - mark, exchange, problem);
    // Whatever was found before it was met: the text is no document.
    if (status == STATUS_UNREADABLE)
        problem->status = status;
    return status;
}
