// A row of the database becomes an ExchangeRow, which borrows it, and that is written by the rows
// that it is read by.
//
//     {"format": "impactd-materials", "version": 1, "materials": [
//     {"slug": "sponge", "revisions": [
//     {"revision": 1, ...}],
//     "measurements": [
//     {"measurement": 1, ..., "test": {...}}]}]}
#include "server/formats/material_export.h"

#include <stdlib.h>
#include <string.h>

#include "server/formats/csv.h"
#include "server/json/encode.h"
#include "server/json/material_bodies.h"
#include "server/materials/exchange.h"
#include "server/materials/material.h"
#include "server/util/clock.h"

// RFC 3339.
typedef struct Created {
    char text[32];
} Created;

static char *known(char *name) {
    static char nobody[] = "";
    return name != NULL ? name : nobody;
}

static int verdict(const char *status) {
    for (int i = 0; material_verdicts[i] != NULL; i++)
        if (strcmp(material_verdicts[i], status) == 0)
            return i;
    return CHOICE_ABSENT;
}

// Quotes where they are needed or tell that there is an empty text.
static void put_cell(Bytes *bytes, const char *text) {
    if (text[0] == '\0' || strpbrk(text, ",\"\r\n") != NULL || text[0] == ' ' || text[0] == '\t')
        csv_cells_text(bytes, text);
    else
        bytes_text(bytes, text);
}

// A list or an item as JSON.
static void put_json_cell(Bytes *bytes, const Field *field, const void *item) {
    Bytes json = {.most = 0};
    const Field alone[] = {*field, FIELD_END};
    static const size_t around = sizeof "{\"\": " - 1;
    encode_item(&json, alone, item, WRITE_SCENE);
    const size_t before = around + strlen(field->name);
    if (json.is_failed || json.count <= before) {
        bytes->is_failed = bytes->is_failed || json.is_failed;
    } else {
        json.at[json.count - 1] = '\0'; // the object's end
        put_cell(bytes, json.at + before);
    }
    bytes_clear(&json);
}

// `document`: the test, which is JSON already; NULL: it has none.
static void put_cells(Bytes *bytes, const Field *fields, const void *item, const char *document,
                      size_t *count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (field->kind == FIELD_KIND_BASE) {
            put_cells(bytes, field->fields, member, document, count);
            continue;
        }
        if ((*count)++ > 0)
            bytes_text(bytes, ",");
        if (field->kind == FIELD_KIND_ITEM) {
            if (document != NULL)
                put_cell(bytes, document);
            continue;
        }
        if (field_is_absent(field, item))
            continue;
        switch (field->kind) {
        case FIELD_KIND_TEXT: {
            const char *text = *(char *const *)member;
            // An empty cell is nobody known; quoted it is an empty text.
            if (text[0] != '\0' || (field->flags & FIELD_NULL_IS_EMPTY) == 0)
                put_cell(bytes, text);
            break;
        }
        case FIELD_KIND_REAL:
            bytes_real(bytes, *(const double *)member);
            break;
        case FIELD_KIND_COUNT:
            bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)member);
            break;
        case FIELD_KIND_CHOICE:
            bytes_text(bytes, field->choices[*(const int *)member]);
            break;
        default:
            put_json_cell(bytes, field, item);
            break;
        }
    }
}

static void put_header(Bytes *bytes, const Field *fields, size_t *count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            put_header(bytes, field->fields, count);
            continue;
        }
        bytes_text(bytes, (*count)++ > 0 ? "," : "");
        bytes_text(bytes, field->name);
        if (field->unit != NULL)
            bytes_format(bytes, " [%s]", field->unit);
    }
}

static void put_row(const MaterialExport *text, Bytes *bytes, const ExchangeRow *row,
                    const char *document) {
    size_t count = 0;
    if (text->is_table) {
        put_cells(bytes, exchange_row_fields, row, document, &count);
        bytes_text(bytes, "\r\n");
    } else if (document == NULL) {
        encode_item(bytes, exchange_revision_fields, row, WRITE_SCENE);
    } else {
        bytes_text(bytes, "{");
        encode_members(bytes, exchange_measurement_fields, row, WRITE_SCENE);
        bytes_format(bytes, ", \"test\": ");
        bytes_text(bytes, document);
        bytes_text(bytes, "}");
    }
}

// All zero but for what makes a member absent.
static bool row_default(ExchangeRow *row) {
    return fields_default(exchange_row_fields, row) == STATUS_OK;
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
}

static Status put_reviewed(MaterialExport *text, Bytes *bytes, MaterialRevision *revision,
                           const MaterialReviews *reviews, Problem *problem) {
    ExchangeRow row;
    const size_t count = reviews->count;
    char created[32];
    ExchangeReview *shown = calloc(count + 1, sizeof *shown);
    Created *times = calloc(count + 1, sizeof *times);
    Status status = shown != NULL && times != NULL && row_default(&row)
                        ? material_read_lists(revision, problem)
                        : no_memory(problem);
    for (size_t i = 0; status == STATUS_OK && i < count; i++) {
        const MaterialReview *review = &reviews->at[i];
        clock_rfc3339(review->created_unix_ms, times[i].text);
        shown[i] = (ExchangeReview){verdict(review->status), review->reason,
                                    known(review->reviewer), times[i].text};
    }
    if (status == STATUS_OK) {
        clock_rfc3339(revision->created_unix_ms, created);
        row.row = EXCHANGE_REVISION;
        row.slug = revision->slug;
        row.number = text->number = revision->revision;
        row.material = revision->material;
        row.reverts = revision->reverts > 0 ? revision->reverts : COUNT_ABSENT;
        row.author = known(revision->author);
        row.comment = revision->comment;
        row.created = created;
        row.reviews = (ExchangeReviews){shown, count};
        put_row(text, bytes, &row, NULL);
    }
    free(times);
    free(shown);
    return status;
}

static Status put_revision(MaterialExport *text, Bytes *bytes, MaterialRevision *revision,
                           Problem *problem) {
    MaterialReviews reviews;
    Status status = db_reviews_of(text->db, &text->moment, revision->slug, revision->revision,
                                  &reviews, problem);
    if (status == STATUS_OK)
        status = put_reviewed(text, bytes, revision, &reviews, problem);
    material_reviews_clear(&reviews);
    return status;
}

static Status put_measurement(MaterialExport *text, Bytes *bytes,
                              const MaterialMeasurement *measurement, Problem *problem) {
    ExchangeRow row;
    char created[32];
    if (!row_default(&row))
        return no_memory(problem);
    clock_rfc3339(measurement->created_unix_ms, created);
    row.row = EXCHANGE_MEASUREMENT;
    row.slug = measurement->slug;
    row.number = text->number = measurement->measurement;
    row.author = known(measurement->author);
    row.comment = measurement->comment;
    row.created = created;
    if (!text->is_table)
        bytes_text(bytes, text->measurements++ > 0 ? ",\n" : ", \"measurements\": [\n");
    put_row(text, bytes, &row, measurement->document);
    return STATUS_OK;
}

static Status next_material(MaterialExport *text, Bytes *bytes, bool *is_last, Problem *problem) {
    MaterialRevision first;
    bool is_found;
    Status status =
        db_material_behind(text->db, &text->moment, text->slug, &first, &is_found, problem);
    *is_last = status == STATUS_OK && !is_found;
    if (*is_last)
        bytes_text(bytes, text->is_table ? "" : "]}\n");
    if (status == STATUS_OK && is_found) {
        if (!text->is_table)
            bytes_format(bytes, "%s{\"slug\": \"%s\", \"revisions\": [\n",
                         text->slug[0] != '\0' ? ",\n" : "", first.slug);
        text_fit(text->slug, sizeof text->slug, first.slug);
        text->stage = EXCHANGE_REVISIONS;
        status = put_revision(text, bytes, &first, problem);
    }
    material_revision_clear(&first);
    return status;
}

static Status next_revision(MaterialExport *text, Bytes *bytes, Problem *problem) {
    MaterialRevision revision;
    bool is_found;
    Status status = db_revision_behind(text->db, &text->moment, text->slug, text->number, &revision,
                                       &is_found, problem);
    if (status == STATUS_OK && !text->is_table)
        bytes_text(bytes, is_found ? ",\n" : "]");
    if (status == STATUS_OK && is_found)
        status = put_revision(text, bytes, &revision, problem);
    if (status == STATUS_OK && !is_found) {
        text->stage = EXCHANGE_MEASUREMENTS;
        text->number = 0;
        text->measurements = 0;
    }
    material_revision_clear(&revision);
    return status;
}

static Status next_measurement(MaterialExport *text, Bytes *bytes, Problem *problem) {
    MaterialMeasurement measurement;
    bool is_found;
    Status status = db_measurement_behind(text->db, &text->moment, text->slug, text->number,
                                          &measurement, &is_found, problem);
    if (status == STATUS_OK && is_found)
        status = put_measurement(text, bytes, &measurement, problem);
    if (status == STATUS_OK && !is_found) {
        if (!text->is_table)
            bytes_text(bytes, text->measurements > 0 ? "]}" : "}");
        text->stage = EXCHANGE_BETWEEN;
    }
    material_measurement_clear(&measurement);
    return status;
}

static void begin(MaterialExport *text, Bytes *bytes) {
    size_t count = 0;
    text->has_begun = true;
    if (text->is_table) {
        put_header(bytes, exchange_row_fields, &count);
        bytes_text(bytes, "\r\n");
    } else {
        bytes_format(bytes, "{\"format\": \"%s\", \"version\": %d, \"materials\": [\n",
                     exchange_format, EXCHANGE_VERSION);
    }
}

Status material_export_open(Db *db, bool is_table, MaterialExport *text, Problem *problem) {
    *text = (MaterialExport){.db = db, .is_table = is_table};
    return db_material_moment(db, &text->moment, problem);
}

Status material_export_next(MaterialExport *text, Bytes *bytes, bool *is_last, Problem *problem) {
    *is_last = false;
    if (!text->has_begun)
        begin(text, bytes);
    const Status status =
        text->stage == EXCHANGE_BETWEEN     ? next_material(text, bytes, is_last, problem)
        : text->stage == EXCHANGE_REVISIONS ? next_revision(text, bytes, problem)
                                            : next_measurement(text, bytes, problem);
    return status == STATUS_OK && bytes->is_failed ? no_memory(problem) : status;
}
