// A row of the database becomes an ImportRow, which borrows from it, and is written by the Field
// rows that read it.
//
//     {"format": "impactd-materials", "version": 1, "materials": [
//     {"slug": "sponge", "revisions": [
//     {"revision": 1, ...}],
//     "measurements": [
//     {"measurement": 1, ..., "test": {...}}]}]}
#include "server/materials/exchange.h"

#include <stdlib.h>
#include <string.h>

#include "server/json/encode.h"
#include "server/json/schema.h"
#include "server/util/clock.h"
#include "server/util/csv.h"

static Status export_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
}

// An unknown name is empty in a file.
static char *export_name(char *name) {
    static char unknown[] = "";
    return name != NULL ? name : unknown;
}

// The size of a control character at `text`: C0, DEL and C1 (U+0080 to U+009F, as CSI). 0: it is
// none, or one that tables have: tab, LF, CR LF.
static size_t control_size(const char *text) {
    const unsigned char c = (unsigned char)text[0], next = (unsigned char)text[c != '\0'];
    if (c == 0xC2 && next >= 0x80 && next <= 0x9F)
        return 2;
    return (c < ' ' && c != '\t' && c != '\n' && !(c == '\r' && next == '\n')) || c == 0x7F;
}

// Whether a cell of this text could be a formula to a spreadsheet or a command to a terminal.
static bool text_is_unsafe(const char *text) {
    if (text[0] != '\0' && strchr("=+-@\t\r", text[0]) != NULL)
        return true;
    for (; *text != '\0'; text++)
        if (control_size(text) > 0)
            return true;
    return false;
}

// Of JSON, DEL and C1, which it allows within strings, are escaped.
static void export_cell(Bytes *bytes, const char *text, bool is_json) {
    Bytes json = {.most = 0}, safe = {.most = 0};
    if (!is_json && (text_is_unsafe(text) || import_is_json_text(text))) {
        bytes_json_string(&json, text);
        text = json.at != NULL ? json.at : "";
        is_json = true;
    }
    for (size_t size; is_json && *text != '\0'; text += size) {
        const size_t control = control_size(text);
        size = control > 0 ? control : 1;
        if (control > 0)
            bytes_format(&safe, "\\u00%02x", (unsigned char)text[control - 1]);
        else
            bytes_put(&safe, text, 1);
    }
    if (is_json)
        text = safe.at != NULL ? safe.at : "";
    if (text[0] == '\0' || strpbrk(text, ",\"\r\n") != NULL || text[0] == ' ' || text[0] == '\t')
        csv_cells_text(bytes, text, strlen(text));
    else
        bytes_text(bytes, text);
    bytes->is_failed = bytes->is_failed || json.is_failed || safe.is_failed;
    bytes_clear(&json);
    bytes_clear(&safe);
}

// The value of a member as a cell. An empty cell is an unknown name; quotes make it an empty text.
static void export_member(Bytes *bytes, const Field *field, const void *item) {
    const void *member = (const char *)item + field->offset;
    const Field alone[] = {*field, FIELD_END};
    Bytes json = {.most = 0};
    if (field_is_absent(field, item))
        return;
    if (field->kind == FIELD_KIND_TEXT) {
        const char *text = *(char *const *)member;
        if (text[0] != '\0' || (field->flags & FIELD_NULL_IS_EMPTY) == 0)
            export_cell(bytes, text, false);
    } else if (field->kind == FIELD_KIND_CHOICE) {
        bytes_text(bytes, field->choices[*(const int *)member]);
    } else {
        (void)encode_members(&json, alone, item, WRITE_SCENE);
        const char *colon = json.at != NULL ? strstr(json.at, ": ") : NULL;
        if (colon != NULL)
            export_cell(bytes, colon + 2, true);
        bytes->is_failed = bytes->is_failed || json.is_failed;
        bytes_clear(&json);
    }
}

// The cells of a row; `row` NULL: the header.
static void export_cells(Bytes *bytes, const Field *fields, const void *row, const char *document,
                         size_t *count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (field->kind == FIELD_KIND_BASE) {
            const char *base = row != NULL ? (const char *)row + field->offset : NULL;
            export_cells(bytes, field->fields, base, document, count);
            continue;
        }
        bytes_text(bytes, (*count)++ > 0 ? "," : "");
        if (row == NULL)
            csv_put_name(bytes, field->name, field->unit);
        else if (field->kind != FIELD_KIND_ITEM)
            export_member(bytes, field, row);
        else if (document != NULL)
            export_cell(bytes, document, true);
    }
}

static void export_row(const MaterialExport *export, Bytes *bytes, const ImportRow *row) {
    size_t count = 0;
    if (export->is_table) {
        export_cells(bytes, import_row_fields, row, row->document, &count);
        bytes_text(bytes, "\r\n");
    } else if (row->kind == IMPORT_REVISION) {
        encode_item(bytes, import_revision_fields, row, WRITE_SCENE);
    } else {
        // The test is JSON already.
        bytes_text(bytes, "{");
        encode_members(bytes, import_measurement_fields, row, WRITE_SCENE);
        bytes_text(bytes, ", \"test\": ");
        bytes_text(bytes, row->document);
        bytes_text(bytes, "}");
    }
}

static Status export_revision(const MaterialExport *export, Bytes *bytes,
                              const MaterialRevision *revision, Problem *problem) {
    MaterialReviews reviews;
    TRY(db_reviews(export->db, &export->moment, revision->slug, revision->revision, &reviews,
                   problem));
    ClockText created, *times = calloc(reviews.count + 1, sizeof *times);
    ImportReview *shown = calloc(reviews.count + 1, sizeof *shown);
    Status status = STATUS_OK;
    if (shown == NULL || times == NULL)
        status = export_no_memory(problem);
    for (size_t i = 0; status == STATUS_OK && i < reviews.count; i++) {
        const MaterialReview *review = &reviews.at[i];
        times[i] = clock_rfc3339(review->created_unix_ms);
        shown[i] = (ImportReview){.status = strcmp(review->status, material_verdicts[0]) != 0,
                                  .reason = review->reason,
                                  .reviewer = export_name(review->reviewer),
                                  .created = times[i].at};
    }
    if (status == STATUS_OK) {
        created = clock_rfc3339(revision->created_unix_ms);
        const ImportRow row = {.kind = IMPORT_REVISION,
                               .slug = revision->slug,
                               .number = revision->revision,
                               .material = revision->material,
                               .reverts = revision->reverts > 0 ? revision->reverts : COUNT_ABSENT,
                               .author = export_name(revision->author),
                               .comment = revision->comment,
                               .created = created.at,
                               .reviews = {shown, reviews.count}};
        export_row(export, bytes, &row);
    }
    free(times);
    free(shown);
    material_reviews_clear(&reviews);
    return status;
}

static Status export_measurement(const MaterialExport *export, Bytes *bytes,
                                 const MaterialMeasurement *measurement, Problem *problem) {
    ImportRow row;
    ClockText created = clock_rfc3339(measurement->created_unix_ms);
    if (fields_default(import_row_fields, &row) != STATUS_OK)
        return export_no_memory(problem);
    row.kind = IMPORT_MEASUREMENT;
    row.slug = measurement->slug;
    row.number = measurement->measurement;
    row.author = export_name(measurement->author);
    row.comment = measurement->comment;
    row.created = created.at;
    row.document = measurement->document;
    export_row(export, bytes, &row);
    return STATUS_OK;
}

static void export_start(MaterialExport *export, Bytes *bytes) {
    size_t count = 0;
    export->stage = EXPORT_REVISIONS;
    if (export->is_table) {
        export_cells(bytes, import_row_fields, NULL, NULL, &count);
        bytes_text(bytes, "\r\n");
    } else {
        bytes_format(bytes, "{\"format\": \"%s\", \"version\": %d, \"materials\": [\n",
                     materials_format, MATERIALS_FORMAT_VERSION);
    }
}

// The next revision of the material, or the first one of the next material.
static Status export_next_revision(MaterialExport *export, Bytes *bytes, bool *is_last,
                                   Problem *problem) {
    MaterialRevision revision;
    bool is_found;
    const bool is_first = export->number == 0;
    Status status = db_revision_after(export->db, &export->moment, export->slug, export->number,
                                      &revision, &is_found, problem);
    if (status == STATUS_OK && is_found) {
        if (!export->is_table && is_first)
            bytes_format(bytes, "%s{\"slug\": \"%s\", \"revisions\": [\n",
                         export->slug[0] != '\0' ? ",\n" : "", revision.slug);
        else if (!export->is_table)
            bytes_text(bytes, ",\n");
        text_fit(export->slug, sizeof export->slug, revision.slug);
        export->number = revision.revision;
        status = export_revision(export, bytes, &revision, problem);
    } else if (status == STATUS_OK) {
        *is_last = is_first;
        if (!export->is_table)
            bytes_text(bytes, is_first ? "]}\n" : "]");
        export->stage = EXPORT_MEASUREMENTS;
        export->number = 0;
    }
    material_revision_clear(&revision);
    return status;
}

static Status export_next_measurement(MaterialExport *export, Bytes *bytes, Problem *problem) {
    MaterialMeasurement measurement;
    bool is_found;
    Status status = db_measurement_after(export->db, &export->moment, export->slug, export->number,
                                         &measurement, &is_found, problem);
    if (status == STATUS_OK && is_found) {
        if (!export->is_table)
            bytes_text(bytes, export->number > 0 ? ",\n" : ", \"measurements\": [\n");
        export->number = measurement.measurement;
        status = export_measurement(export, bytes, &measurement, problem);
    } else if (status == STATUS_OK) {
        if (!export->is_table)
            bytes_text(bytes, export->number > 0 ? "]}" : "}");
        export->stage = EXPORT_REVISIONS;
        export->number = 0;
    }
    material_measurement_clear(&measurement);
    return status;
}

Status material_export_open(Db *db, bool is_table, MaterialExport *export, Problem *problem) {
    *export = (MaterialExport){.db = db, .is_table = is_table};
    return db_material_moment(db, &export->moment, problem);
}

Status material_export_next(MaterialExport *export, Bytes *bytes, bool *is_last, Problem *problem) {
    *is_last = false;
    if (export->stage == EXPORT_START)
        export_start(export, bytes);
    const Status status = export->stage == EXPORT_REVISIONS
                              ? export_next_revision(export, bytes, is_last, problem)
                              : export_next_measurement(export, bytes, problem);
    return status == STATUS_OK && bytes->is_failed ? export_no_memory(problem) : status;
}
