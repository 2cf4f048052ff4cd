// Both kinds of files fill one staging list. A document is read material by material, so that there
// is never a tree of all of it. A cell of a table becomes the JSON value that its column's Field
// row takes, and is read and validated as in a document.
#include "server/materials/exchange.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/rfc3339.h"
#include "core/base/spelling.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/json/schema.h"
#include "server/materials/material.h"
#include "server/util/clock.h"
#include "server/util/csv.h"

enum { NAME_MAX = 64, COMMENT_MAX = 10000, COLUMNS_MAX = 64 };
enum { POINTER_SIZE = sizeof((Fault){0}.pointer) };

const char materials_format[] = "impactd-materials";
static const char *const kind_names[] = {
    [IMPORT_REVISION] = "revision", [IMPORT_MEASUREMENT] = "measurement", NULL};

// clang-format off
static const Field review_fields[] = {
    FIELD_CHOICE(ImportReview, status, material_verdicts, REQUIRED, "its verdict"),
    FIELD_TEXT(ImportReview, reason, COMMENT_MAX, PRESENCE_REQUIRED, 0, "why"),
    FIELD_TEXT(ImportReview, reviewer, NAME_MAX, PRESENCE_OPTIONAL, FIELD_NULL_IS_EMPTY, "null: unknown; if absent, the importer"),
    FIELD_TEXT(ImportReview, created, 40, PRESENCE_OPTIONAL, 0, "RFC 3339; if absent, now"),
    FIELD_END
};

#define NUMBER(name_, doc_) {.name = name_, .kind = FIELD_KIND_COUNT, .offset = offsetof(ImportRow, number), \
    .range = WITHIN(1, 1e9), .presence = PRESENCE_OPTIONAL, .doc = doc_}
#define MATERIAL FIELD_BASE(ImportRow, material, material_fields)
#define REVERTS FIELD_COUNT(ImportRow, reverts, NULL, WITHIN(1, 1e9), OPTIONAL, "the revision whose contents it has again")
#define AUTHOR FIELD_TEXT(ImportRow, author, NAME_MAX, PRESENCE_OPTIONAL, FIELD_NULL_IS_EMPTY, "null: unknown; if absent, the importer")
#define COMMENT FIELD_TEXT(ImportRow, comment, COMMENT_MAX, PRESENCE_OPTIONAL, 0, "why it was written")
#define CREATED FIELD_TEXT(ImportRow, created, 40, PRESENCE_OPTIONAL, 0, "RFC 3339; if absent, now")
#define REVIEWS FIELD_LIST(ImportRow, reviews, review_fields, 1000, PRESENCE_OPTIONAL, "in their order")
#define TEST(presence_) FIELD_ITEM(ImportRow, test, drop_test_fields, NULL, presence_, "the drop test")

const Field import_revision_fields[] = {
    NUMBER("revision", "its number; if absent, the next"),
    MATERIAL, REVERTS, AUTHOR, COMMENT, CREATED, REVIEWS,
    FIELD_END
};

const Field import_measurement_fields[] = {
    NUMBER("measurement", "its number; if absent, the next"),
    AUTHOR, COMMENT, CREATED, TEST(PRESENCE_REQUIRED),
    FIELD_END
};

const Field import_row_fields[] = {
    {.name = "row", .kind = FIELD_KIND_CHOICE, .offset = offsetof(ImportRow, kind), .choices = kind_names,
     .presence = PRESENCE_DEFAULT, .initial = IMPORT_REVISION, .doc = "what the row is"},
    FIELD_TEXT(ImportRow, slug, 0, PRESENCE_REQUIRED, 0, "of the material: a-z, 0-9, _ and -"),
    NUMBER("number", "of the revision or measurement; if absent, the next"),
    MATERIAL, REVERTS, AUTHOR, COMMENT, CREATED, REVIEWS, TEST(PRESENCE_OPTIONAL),
    FIELD_END
};

// What is validated by the ranges of its rows alone.
static const Field revision_own_fields[] = {AUTHOR, COMMENT, CREATED, REVERTS, REVIEWS, FIELD_END};
static const Field measurement_own_fields[] = {AUTHOR, COMMENT, CREATED, FIELD_END};
// clang-format on

bool import_is_json_text(const char *text) {
    if (*text != '"')
        return false;
    for (text++; *text != '\0' && *text != '"'; text++)
        if (*text == '\\' && text[1] != '\0')
            text++;
    return text[0] == '"' && text[1] == '\0';
}

static Status import_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
}

// The staging list.

static void import_row_clear(ImportRow *row) {
    fields_clear(import_row_fields, row);
    free(row->document);
    row->document = NULL;
}

static void import_clear(MaterialImport *import) {
    for (size_t i = 0; i < import->count; i++)
        import_row_clear(&import->rows[i]);
    free(import->rows);
}

static Status import_error_rows(Problem *problem) {
    return problem_set(problem, STATUS_LIMIT,
                       "there are more than %d revisions and measurements; import them in several "
                       "files",
                       IMPORT_ROWS_MAX);
}

// Takes ownership of what the row has, which is left empty.
static Status import_append(MaterialImport *import, ImportRow *row, Problem *problem) {
    if (import->count >= IMPORT_ROWS_MAX)
        return import_error_rows(problem);
    if (import->count == import->capacity) {
        const size_t capacity = import->capacity > 0 ? 2 * import->capacity : 64;
        ImportRow *grown = realloc(import->rows, capacity * sizeof *grown);
        if (grown == NULL)
            return import_no_memory(problem);
        import->rows = grown;
        import->capacity = capacity;
    }
    row->order = import->count;
    import->rows[import->count++] = *row;
    memset(row, 0, sizeof *row);
    return STATUS_OK;
}

// Milliseconds, from 1970 on; 0: absent, or a fault at "created" below `place`.
static int64_t import_read_time(const char *text, const char *place, Problem *problem) {
    int64_t unix_ms = 0;
    if (text == NULL || (rfc3339_read(text, &unix_ms) && unix_ms > 0))
        return unix_ms;
    Fault fault = {.row = 0};
    json_pointer_join(fault.pointer, sizeof fault.pointer, place, "created");
    text_quote(fault.value, sizeof fault.value, text);
    text_fit(fault.detail, sizeof fault.detail,
             "must be a date or time after 1970, as 2026-11-21 or 2026-11-21T09:30:00.000Z");
    (void)problem_add_fault(problem, STATUS_INVALID, &fault);
    return 0;
}

static void import_validate_revision(ImportRow *row, Problem *problem) {
    char list[POINTER_SIZE], place[POINTER_SIZE];
    (void)material_validate(&row->material, row->place, problem);
    (void)fields_validate(revision_own_fields, row, row->place, problem);
    json_pointer_join(list, sizeof list, row->place, "reviews");
    for (size_t i = 0; i < row->reviews.count; i++) {
        ImportReview *review = &row->reviews.at[i];
        json_pointer_index(place, sizeof place, list, i);
        review->created_unix_ms = import_read_time(review->created, place, problem);
    }
}

static void import_validate_measurement(const ImportRow *row, Problem *problem) {
    char test[POINTER_SIZE];
    (void)fields_validate(measurement_own_fields, row, row->place, problem);
    json_pointer_join(test, sizeof test, row->place, "test");
    if (!problem_concerns(problem, test))
        (void)drop_test_validate(&row->test, test, problem);
}

// The test of a measurement becomes a document, as it is stored and compared.
static Status import_make_document(ImportRow *row) {
    Bytes bytes = {.most = 0};
    encode_item(&bytes, drop_test_fields, &row->test, WRITE_SCENE);
    row->document = bytes_take(&bytes, NULL);
    fields_clear(drop_test_fields, &row->test);
    return status_made(row->document != NULL);
}

// Validates the row at `place` and adds it to the list, unless it has no valid slug. `faults` were
// there before the row was read: with more it is faulty. Takes ownership of what it has.
static Status import_take(MaterialImport *import, ImportRow *row, const char *place,
                          const char *slug_place, size_t faults, Problem *problem) {
    char number[POINTER_SIZE];
    const bool has_slug =
        slug_validate(row->slug != NULL ? row->slug : "", slug_place, problem) == STATUS_OK;
    json_pointer_join(number, sizeof number, place, import->number_names[row->kind]);
    if (row->number == 0)
        (void)problem_add_real(problem, STATUS_INVALID, number, 0, NULL,
                               "must be at least 1, is 0: numbers count from 1");
    row->number_unknown = problem_concerns(problem, number);
    text_fit(row->place, sizeof row->place, place);
    if (row->kind == IMPORT_REVISION)
        import_validate_revision(row, problem);
    else
        import_validate_measurement(row, problem);
    row->created_unix_ms = import_read_time(row->created, place, problem);
    row->is_faulty = problem->count > faults;
    Status status = STATUS_OK;
    if (row->kind == IMPORT_MEASUREMENT && !row->is_faulty)
        status = import_make_document(row);
    if (status == STATUS_OK && has_slug)
        status = import_append(import, row, problem);
    import_row_clear(row);
    return status == STATUS_NO_MEMORY ? import_no_memory(problem) : status;
}

// JSON.

typedef struct Envelope {
    char *format;
    uint64_t version;
    Texts materials; // none: they are read from a text of their own
} Envelope;

typedef struct DocumentRows {
    ImportRow *at;
    size_t count;
} DocumentRows;

typedef struct DocumentMaterial {
    char *slug;
    DocumentRows revisions, measurements;
} DocumentMaterial;

// clang-format off
static const Field envelope_fields[] = {
    FIELD_TEXT(Envelope, format, 100, PRESENCE_REQUIRED, 0, "\"impactd-materials\""),
    FIELD_COUNT(Envelope, version, NULL, AT_MIN(1), REQUIRED, "of the format"),
    FIELD_TEXTS(Envelope, materials, NULL, NULL, 0, PRESENCE_OPTIONAL, 0, "all of them"),
    FIELD_END
};

static const Field document_material_fields[] = {
    FIELD_TEXT(DocumentMaterial, slug, 0, PRESENCE_REQUIRED, 0, "of a-z, 0-9, _ and -"),
    FIELD_LIST(DocumentMaterial, revisions, import_revision_fields, IMPORT_ROWS_MAX, PRESENCE_OPTIONAL, "by number"),
    FIELD_LIST(DocumentMaterial, measurements, import_measurement_fields, IMPORT_ROWS_MAX, PRESENCE_OPTIONAL, "by number"),
    FIELD_END
};
// clang-format on

// The document without its materials; line breaks stay, so that lines count the same.
static Status envelope_read(const char *text, size_t size, const ScanList *list, bool has_list,
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
        return import_no_memory(problem);
    const Status status = json_parse(outer.at, outer.count, envelope_fields, &envelope, problem);
    if (status == STATUS_OK || status == STATUS_INVALID) {
        (void)fields_validate(envelope_fields, &envelope, "", problem);
        if (envelope.format != NULL && strcmp(envelope.format, materials_format) != 0)
            (void)problem_add(problem, STATUS_INVALID, "/format", "must be \"%s\"",
                              materials_format);
        if (envelope.version != COUNT_ABSENT && envelope.version != MATERIALS_FORMAT_VERSION)
            (void)problem_add_real(problem, STATUS_INVALID, "/version", (double)envelope.version,
                                   NULL, "must be %d", MATERIALS_FORMAT_VERSION);
        if (!has_list)
            (void)problem_add(problem, STATUS_INVALID, "/materials",
                              "is required: an array of materials");
    }
    fields_clear(envelope_fields, &envelope);
    bytes_clear(&outer);
    return status == STATUS_INVALID ? STATUS_OK : status;
}

static Status document_take(MaterialImport *import, const DocumentMaterial *material,
                            ImportKind kind, const char *pointer, size_t faults, Problem *problem) {
    static const char *const names[] = {"revisions", "measurements"};
    const DocumentRows *rows =
        kind == IMPORT_REVISION ? &material->revisions : &material->measurements;
    char list[POINTER_SIZE], place[POINTER_SIZE], slug[POINTER_SIZE];
    json_pointer_join(slug, sizeof slug, pointer, "slug");
    json_pointer_join(list, sizeof list, pointer, names[kind]);
    for (size_t i = 0; i < rows->count; i++) {
        ImportRow *row = &rows->at[i];
        json_pointer_index(place, sizeof place, list, i);
        // Faults of this row make it faulty, not those of others of the material.
        const size_t before = problem_concerns(problem, place) ? faults : problem->count;
        row->kind = (int)kind;
        row->slug = material->slug != NULL ? strdup(material->slug) : NULL;
        if (material->slug != NULL && row->slug == NULL)
            return import_no_memory(problem);
        TRY(import_take(import, row, place, slug, before, problem));
    }
    return STATUS_OK;
}

static Status document_read_material(MaterialImport *import, const char *text, const ScanList *list,
                                     size_t index, Problem *problem) {
    char pointer[POINTER_SIZE];
    DocumentMaterial material;
    const size_t faults = problem->count;
    json_pointer_index(pointer, sizeof pointer, "/materials", index);
    Status status = json_parse_part(text, list->first, list->count, pointer,
                                    document_material_fields, &material, problem);
    if (status == STATUS_OK || status == STATUS_INVALID) {
        if (material.revisions.count + material.measurements.count == 0 &&
            !problem_concerns(problem, pointer))
            (void)problem_add(problem, STATUS_INVALID, pointer,
                              "has neither revisions nor measurements: add one, or leave it out");
        status = document_take(import, &material, IMPORT_REVISION, pointer, faults, problem);
        if (status == STATUS_OK)
            status = document_take(import, &material, IMPORT_MEASUREMENT, pointer, faults, problem);
    }
    fields_clear(document_material_fields, &material);
    return status;
}

static Status document_read(MaterialImport *import, const char *text, size_t size,
                            Problem *problem) {
    ScanList list;
    const bool has_list = scan_list(text, size, "materials", &list);
    Status status = STATUS_OK;
    import->number_names[IMPORT_REVISION] = "revision";
    import->number_names[IMPORT_MEASUREMENT] = "measurement";
    for (size_t i = 0; has_list && status == STATUS_OK && scan_element(&list); i++)
        status = i >= IMPORT_ROWS_MAX ? import_error_rows(problem)
                                      : document_read_material(import, text, &list, i, problem);
    // Last: if the text is cut off, its last material says where.
    if (status == STATUS_OK)
        status = envelope_read(text, size, &list, has_list, problem);
    if (status == STATUS_UNREADABLE) // whatever faults were found before
        problem->status = status;
    return status;
}

// CSV.

typedef struct Column {
    const Field *field; // NULL: the column has a fault
    size_t offset;      // of what the field counts from
} Column;

typedef struct Table {
    CsvReader csv;
    Column columns[COLUMNS_MAX];
    size_t count;
    bool lacks[3]; // columns that revisions need: name, source, restitution or table
    Problem *problem;
} Table;

static void table_place(char place[POINTER_SIZE], size_t row, const char *column) {
    char of_row[32];
    snprintf(of_row, sizeof of_row, "/%zu", row);
    json_pointer_join(place, POINTER_SIZE, of_row, column);
}

// A fault in the present row, with the cell's text if there is one.
static void table_fault(const Table *table, const char *column, const char *text, const char *unit,
                        const char *did_you_mean, const char *detail) {
    Fault fault = {.row = 0};
    table_place(fault.pointer, table->csv.row, column);
    if (text != NULL)
        text_quote(fault.value, sizeof fault.value, text);
    text_fit(fault.detail, sizeof fault.detail, detail);
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean,
             did_you_mean != NULL ? did_you_mean : "");
    (void)problem_add_fault(table->problem, STATUS_INVALID, &fault);
}

// Without blanks at its ends, cut to fit.
static void table_trim(char *target, size_t size, const char *text, size_t length) {
    while (length > 0 && (*text == ' ' || *text == '\t'))
        text++, length--;
    while (length > 0 && (text[length - 1] == ' ' || text[length - 1] == '\t'))
        length--;
    snprintf(target, size, "%.*s", (int)(length < size ? length : size - 1), text);
}

static bool table_has(const Table *table, const Field *field) {
    for (size_t i = 0; i < table->count; i++)
        if (table->columns[i].field == field)
            return true;
    return false;
}

static bool table_has_name(const Table *table, const char *name) {
    return table_has(table, fields_find(import_row_fields, name, &(size_t){0}));
}

// "contact_time [s]": the unit may be left out.
static void table_read_column(Table *table, const CsvCell *cell) {
    char whole[256], name[256], unit[64] = "", detail[160];
    Column column = {NULL, 0};
    table_trim(whole, sizeof whole, cell->text, strlen(cell->text));
    const char *bracket = strchr(whole, '[');
    table_trim(name, sizeof name, whole, strcspn(whole, "["));
    if (bracket != NULL)
        table_trim(unit, sizeof unit, bracket + 1, strcspn(bracket + 1, "]"));
    const Field *field = fields_find(import_row_fields, name, &column.offset);
    const char *wanted = field != NULL && field->unit != NULL ? field->unit : "";
    if (cell->fault != NULL) {
        table_fault(table, whole, NULL, NULL, NULL, cell->fault);
    } else if (whole[0] != '\0' && field == NULL) {
        table_fault(table, whole, whole, NULL, spelling_nearest_field(import_row_fields, name),
                    "unknown column");
    } else if (field != NULL && table_has(table, field)) {
        table_fault(table, name, NULL, NULL, NULL, "the table has this column twice");
    } else if (field != NULL && unit[0] != '\0' && strcmp(unit, wanted) != 0) {
        snprintf(detail, sizeof detail, "must be in [%s], is in [%.40s]",
                 wanted[0] != '\0' ? wanted : "-", unit);
        table_fault(table, name, whole, wanted, NULL, detail);
    } else {
        column.field = field;
    }
    table->columns[table->count++] = column;
}

// Whether the rows can be read.
static bool table_read_header(Table *table) {
    const CsvReader *csv = &table->csv;
    if (!csv_reader_next(&table->csv)) {
        if (!csv->is_failed)
            (void)problem_add(table->problem, STATUS_INVALID, "", "has no header of column names");
        return false;
    }
    if (csv->count > COLUMNS_MAX) {
        table_fault(table, "", NULL, NULL, NULL, "there are more columns than materials have");
        return false;
    }
    if (csv->count == 1 && csv->cells[0].fault == NULL &&
        strpbrk(csv->cells[0].text, ";\t") != NULL) {
        table_fault(table, "1", csv->cells[0].text, NULL, NULL,
                    "cells must be separated by commas, and decimals by points");
        return false;
    }
    for (size_t i = 0; i < csv->count; i++)
        table_read_column(table, &csv->cells[i]);
    if (!problem_concerns(table->problem, "/1/slug") && !table_has_name(table, "slug")) {
        table_fault(table, "slug", NULL, NULL, NULL,
                    "is required: the material that a row belongs to");
        return false;
    }
    table->lacks[0] = !table_has_name(table, "name");
    table->lacks[1] = !table_has_name(table, "source");
    table->lacks[2] = !table_has_name(table, "restitution") && !table_has_name(table, "table");
    return true;
}

// The cell as a JSON value. False: it is none, which is reported.
static bool table_write_value(const Table *table, const Field *field, const char *text,
                              Bytes *json) {
    char word[256], detail[96], *end;
    table_trim(word, sizeof word, text, strlen(text));
    if (field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT) {
        const double value = strtod(word, &end);
        if (*end != '\0' || end == word || !isfinite(value) ||
            strspn(word, "+-.0123456789eE") != strlen(word)) {
            const bool has_unit = field->unit != NULL;
            snprintf(detail, sizeof detail, "must be a number%s%s%s", has_unit ? " [" : "",
                     has_unit ? field->unit : "", has_unit ? "]" : "");
            table_fault(table, field->name, text, field->unit, NULL, detail);
            return false;
        }
        bytes_real(json, value);
    } else if (field->kind == FIELD_KIND_CHOICE) {
        bytes_json_string(json, word);
    } else if (field->kind != FIELD_KIND_TEXT || import_is_json_text(text)) {
        bytes_text(json, text);
    } else {
        bytes_json_string(json, text);
    }
    return true;
}

static Status table_read_cell(const Table *table, const Column *column, const CsvCell *cell,
                              ImportRow *row) {
    char place[POINTER_SIZE];
    Bytes json = {.most = 0};
    Status status = STATUS_OK;
    table_place(place, table->csv.row, column->field->name);
    if (cell->fault != NULL)
        table_fault(table, column->field->name, NULL, NULL, NULL, cell->fault);
    else if (table_write_value(table, column->field, cell->text, &json))
        status = json.is_failed
                     ? STATUS_NO_MEMORY
                     : json_parse_value(json.at, json.count, column->field,
                                        (char *)row + column->offset, place, table->problem);
    bytes_clear(&json);
    return status == STATUS_INVALID ? STATUS_OK : status;
}

// An empty cell is an absent value; of a name it is an unknown user.
static bool cell_is_empty(const CsvCell *cell) {
    return cell->text[0] == '\0' && !cell->is_quoted && cell->fault == NULL;
}

static Status table_read_cells(const Table *table, ImportRow *row) {
    for (size_t i = 0; i < table->csv.count; i++) {
        const CsvCell *cell = &table->csv.cells[i];
        const Field *field = i < table->count ? table->columns[i].field : NULL;
        char number[32];
        snprintf(number, sizeof number, "%zu", i + 1);
        if (i >= table->count && !cell_is_empty(cell))
            table_fault(table, number, NULL, NULL, NULL,
                        "the header has no column here; a comma in a cell needs quotes");
        else if (field != NULL &&
                 (!cell_is_empty(cell) || (field->flags & FIELD_NULL_IS_EMPTY) != 0))
            TRY(table_read_cell(table, &table->columns[i], cell, row));
    }
    return STATUS_OK;
}

// Cells that belong to the other kind of row.
static void table_validate_kind(const Table *table, int kind) {
    static const char both[] = " row slug number author comment created ";
    for (size_t i = 0; i < table->count && i < table->csv.count; i++) {
        const Field *field = table->columns[i].field;
        char word[80];
        if (field == NULL || cell_is_empty(&table->csv.cells[i]) ||
            (strcmp(field->name, "test") == 0) == (kind == IMPORT_MEASUREMENT))
            continue;
        snprintf(word, sizeof word, " %s ", field->name);
        if (strstr(both, word) == NULL)
            table_fault(table, field->name, NULL, NULL, NULL,
                        kind == IMPORT_MEASUREMENT
                            ? "belongs to a revision, and this row is a measurement"
                            : "belongs to a measurement, and this row is a revision");
    }
}

// Columns that revisions need and the table lacks are reported once, in the header; the row gets
// valid values for them.
static Status table_fill_lacks(Table *table, Material *material) {
    static const char detail[] =
        "is required: a revision needs name, source, and restitution or table";
    char **const texts[] = {&material->name, &material->source};
    static const char *const names[] = {"name", "source", "restitution"};
    for (size_t i = 0; i < COUNT(names); i++) {
        char place[POINTER_SIZE];
        if (!table->lacks[i])
            continue;
        table_place(place, 1, names[i]);
        if (!problem_concerns(table->problem, place))
            (void)problem_add(table->problem, STATUS_INVALID, place, "%s", detail);
        if (i == COUNT(texts))
            material->restitution = 0;
        else if ((*texts[i] = strdup("-")) == NULL)
            return STATUS_NO_MEMORY;
    }
    return STATUS_OK;
}

static Status table_read_row(Table *table, MaterialImport *import, ImportRow *row) {
    char place[32], slug[POINTER_SIZE], kind[POINTER_SIZE];
    const size_t faults = table->problem->count;
    snprintf(place, sizeof place, "/%zu", table->csv.row);
    table_place(slug, table->csv.row, "slug");
    table_place(kind, table->csv.row, "row");
    TRY(fields_default(import_row_fields, row));
    TRY(table_read_cells(table, row));
    if (problem_concerns(table->problem, kind)) { // the rest cannot be validated
        row->kind = IMPORT_UNKNOWN;
        text_fit(row->place, sizeof row->place, place);
        return row->slug != NULL && material_slug_is_valid(row->slug)
                   ? import_append(import, row, table->problem)
                   : STATUS_OK;
    }
    table_validate_kind(table, row->kind);
    if (row->kind == IMPORT_REVISION)
        TRY(table_fill_lacks(table, &row->material));
    return import_take(import, row, place, slug, faults, table->problem);
}

static Status table_read(MaterialImport *import, const char *text, size_t size, Problem *problem) {
    Table table = {.csv = {.text = text, .size = size}, .problem = problem};
    Status status = STATUS_OK;
    import->number_names[IMPORT_REVISION] = import->number_names[IMPORT_MEASUREMENT] = "number";
    const bool is_readable = table_read_header(&table);
    import->is_partial = table.lacks[0] || table.lacks[1] || table.lacks[2];
    while (is_readable && status == STATUS_OK && csv_reader_next(&table.csv)) {
        ImportRow row = {.kind = IMPORT_UNKNOWN};
        status = table.csv.row > IMPORT_ROWS_MAX + 1 ? import_error_rows(problem)
                                                     : table_read_row(&table, import, &row);
        import_row_clear(&row);
    }
    if (table.csv.is_failed && table.csv.count >= CSV_CELLS_MAX)
        table_fault(&table, "", NULL, NULL, NULL, "there are more than 1000 cells in a row");
    else if (table.csv.is_failed || status == STATUS_NO_MEMORY)
        status = import_no_memory(problem);
    csv_reader_clear(&table.csv);
    return status;
}
_Static_assert(CSV_CELLS_MAX == 1000, "the sentence names this number");

// Faults at "/ROW/COLUMN" get their row and column.
static void table_place_faults(Problem *problem) {
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        Fault *fault = &problem->faults[i];
        char *end;
        if (fault->pointer[0] != '/')
            continue;
        fault->row = strtoul(fault->pointer + 1, &end, 10);
        size_t length = 0;
        if (*end == '/')
            end++;
        for (; *end != '\0' && *end != '/' && length + 1 < sizeof fault->column; end++) {
            const bool is_escape = *end == '~' && (end[1] == '0' || end[1] == '1');
            fault->column[length++] = !is_escape ? *end : end[1] == '0' ? '~' : '/';
            end += is_escape;
        }
        fault->column[length] = '\0';
    }
    if (problem->count == 0 || problem->faults[0].row == 0)
        return;
    char detail[2 * sizeof problem->detail];
    snprintf(detail, sizeof detail, "row %zu, column %s: %s", problem->faults[0].row,
             problem->faults[0].column, problem->faults[0].detail);
    text_fit(problem->detail, sizeof problem->detail, detail);
}

Status import_file(Db *db, const char *text, size_t size, const ImportOptions *options,
                   ImportTally *tally, Problem *problem) {
    MaterialImport import = {
        .who = options->who, .may_all = options->may_all, .now_unix_ms = clock_unix_ms()};
    const size_t mark = scan_mark(text, size);
    Status status = (options->is_table ? table_read : document_read)(&import, text + mark,
                                                                     size - mark, problem);
    // Faulty rows are compared with the database too, so that all faults are reported at once.
    if (status == STATUS_OK || status == STATUS_INVALID)
        status = db_material_import(db, &import, options->is_dry, tally, problem);
    import_clear(&import);
    problem->whose = "file";
    if (options->is_table)
        table_place_faults(problem);
    return status;
}
