// A cell becomes the JSON value that its column's row of exchange_row_fields takes, so that it is
// read and judged as in a document: texts are quoted, numbers brought to their shortest digits, and
// what is a list or a drop test is JSON in its cell already.
#include "server/materials/exchange_csv.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "server/json/parse.h"
#include "server/util/csv_reader.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer), COLUMNS_MAX = 64 };

// Of the header; `field` NULL: it is told already.
typedef struct Column {
    const Field *field;
    size_t offset; // of what the field counts from
} Column;

typedef struct Table {
    CsvReader scan;
    Column columns[COLUMNS_MAX];
    size_t count;
    bool lacks_name, lacks_source, lacks_restitution; // columns that revisions need
    bool is_lack_told;
    Problem *problem;
} Table;

static void place_of(char place[POINTER_SIZE], size_t row, const char *column) {
    char of_row[32];
    snprintf(of_row, sizeof of_row, "/%zu", row);
    json_pointer_join(place, POINTER_SIZE, of_row, column);
}

static void refuse(const Table *table, const char *column, const char *sentence) {
    char place[POINTER_SIZE];
    place_of(place, table->scan.row, column);
    (void)problem_add(table->problem, STATUS_INVALID, place, "%s", sentence);
}

static void decode_error_text(const Table *table, const char *column, const char *text,
                              const char *unit, const char *meant, const char *sentence) {
    Fault fault = {.row = 0};
    place_of(fault.pointer, table->scan.row, column);
    text_quote(fault.value, sizeof fault.value, text);
    text_fit(fault.detail, sizeof fault.detail, sentence);
    text_fit(fault.unit, sizeof fault.unit, unit != NULL ? unit : "");
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant != NULL ? meant : "");
    (void)problem_add_fault(table->problem, STATUS_INVALID, &fault);
}

// Without the blanks around it, cut to fit.
static void trim(char *target, size_t size, const char *text) {
    text += strspn(text, " \t");
    text_fit(target, size, text);
    size_t length = strlen(target);
    while (length > 0 && (target[length - 1] == ' ' || target[length - 1] == '\t'))
        target[--length] = '\0';
}

// "contact_time [s]" into its two parts; a unit that is not given is "".
static void split(char *name, size_t size, char unit[64]) {
    char *bracket = strchr(name, '[');
    unit[0] = '\0';
    if (bracket == NULL)
        return;
    text_fit(unit, 64, bracket + 1);
    char *end = strchr(unit, ']');
    if (end != NULL)
        *end = '\0';
    *bracket = '\0';
    char bare[256];
    trim(bare, sizeof bare, name);
    text_fit(name, size, bare);
}

static bool is_known(const Table *table, const Field *field) {
    for (size_t i = 0; i < table->count; i++)
        if (table->columns[i].field == field)
            return true;
    return false;
}

static void read_column(Table *table, const CsvCell *cell) {
    char name[256], unit[64], whole[256], sentence[160];
    Column column = {NULL, 0};
    trim(whole, sizeof whole, cell->text);
    memcpy(name, whole, sizeof name);
    split(name, sizeof name, unit);
    const Field *field = fields_find(exchange_row_fields, name, &column.offset);
    const char *wanted = field != NULL && field->unit != NULL ? field->unit : "";
    if (cell->fault != NULL) {
        refuse(table, whole, cell->fault);
    } else if (whole[0] != '\0' && field == NULL) {
        decode_error_text(table, whole, whole, NULL,
                          spelling_nearest_field(exchange_row_fields, name), "unknown column");
    } else if (field != NULL && is_known(table, field)) {
        refuse(table, name, "the column stands there twice");
    } else if (field != NULL && unit[0] != '\0' && strcmp(unit, wanted) != 0) {
        snprintf(sentence, sizeof sentence, "must be in [%s], is in [%.40s]",
                 wanted[0] != '\0' ? wanted : "-", unit);
        decode_error_text(table, name, whole, wanted, NULL, sentence);
    } else {
        column.field = field;
    }
    table->columns[table->count++] = column;
}

static bool has_column(const Table *table, const char *name) {
    return is_known(table, fields_find(exchange_row_fields, name, &(size_t){0}));
}

// Whether it is worth to read on.
static bool read_header(Table *table) {
    const CsvReader *scan = &table->scan;
    if (!csv_reader_next(&table->scan)) {
        (void)problem_add(table->problem, STATUS_INVALID, "", "there is no header of names");
        return false;
    }
    if (scan->count > COLUMNS_MAX) {
        refuse(table, "", "there are more columns than a table of materials has");
        return false;
    }
    if (scan->count == 1 && strpbrk(scan->cells[0].text, ";\t") != NULL) {
        decode_error_text(table, "1", scan->cells[0].text, NULL, NULL,
                          "cells must be parted by commas, and decimals by points");
        return false;
    }
    for (size_t i = 0; i < scan->count; i++)
        read_column(table, &scan->cells[i]);
    if (!problem_concerns(table->problem, "/1/slug") && !has_column(table, "slug")) {
        refuse(table, "slug", "the column is missing: which material a row is of");
        return false;
    }
    table->lacks_name = !has_column(table, "name");
    table->lacks_source = !has_column(table, "source");
    table->lacks_restitution = !has_column(table, "restitution") && !has_column(table, "table");
    return true;
}

static bool is_number(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT;
}

// False, and told, where it is none.
static bool put_number(const Table *table, const Field *field, const char *text, Bytes *json) {
    char number[128], sentence[96];
    char *end;
    trim(number, sizeof number, text);
    const double value = strtod(number, &end);
    if (*end == '\0' && end != number && isfinite(value) &&
        strspn(number, "+-.0123456789eE") == strlen(number)) {
        bytes_real(json, value);
        return true;
    }
    snprintf(sentence, sizeof sentence, "must be a number%s%s%s", field->unit != NULL ? " [" : "",
             field->unit != NULL ? field->unit : "", field->unit != NULL ? "]" : "");
    decode_error_text(table, field->name, text, field->unit, NULL, sentence);
    return false;
}

static bool put_value(const Table *table, const Field *field, const char *text, Bytes *json) {
    char word[256];
    if (is_number(field))
        return put_number(table, field, text, json);
    if (field->kind == FIELD_KIND_TEXT) {
        bytes_json_string(json, text);
    } else if (field->kind == FIELD_KIND_CHOICE) {
        trim(word, sizeof word, text);
        bytes_json_string(json, word);
    } else {
        bytes_text(json, text);
    }
    return true;
}

static Status read_cell(const Table *table, const Column *column, const CsvCell *cell,
                        ExchangeRow *row) {
    const Field *field = column->field;
    char place[POINTER_SIZE];
    Bytes json = {.most = 0};
    Status status = STATUS_OK;
    place_of(place, table->scan.row, field->name);
    if (cell->fault != NULL)
        refuse(table, field->name, cell->fault);
    else if (put_value(table, field, cell->text, &json))
        status = json.is_failed
                     ? STATUS_NO_MEMORY
                     : json_parse_value(json.at, json.count, field, (char *)row + column->offset,
                                        place, table->problem);
    bytes_clear(&json);
    return status == STATUS_INVALID ? STATUS_OK : status;
}

// Nothing in a cell is not known; of whose name a column is, nobody.
static bool is_empty(const CsvCell *cell) {
    return cell->text[0] == '\0' && !cell->is_quoted && cell->fault == NULL;
}

static bool takes_empty(const Field *field) {
    return field->kind == FIELD_KIND_TEXT && (field->flags & FIELD_NULL_IS_EMPTY) != 0;
}

static Status read_cells(const Table *table, ExchangeRow *row) {
    for (size_t i = 0; i < table->scan.count; i++) {
        const CsvCell *cell = &table->scan.cells[i];
        const Field *field = i < table->count ? table->columns[i].field : NULL;
        char number[32];
        snprintf(number, sizeof number, "%zu", i + 1);
        if (i >= table->count && !is_empty(cell))
            refuse(table, number, "the header has no column here: is a comma not quoted?");
        else if (field != NULL && (!is_empty(cell) || takes_empty(field)))
            TRY(read_cell(table, &table->columns[i], cell, row));
    }
    return STATUS_OK;
}

// What stands in the row but belongs to the other kind.
static void check_kind(const Table *table, ExchangeKind kind) {
    static const char *const of_both[] = {"row",     "slug",    "number", "author",
                                          "comment", "created", NULL};
    for (size_t i = 0; i < table->count && i < table->scan.count; i++) {
        const Field *field = table->columns[i].field;
        bool is_own = field == NULL || is_empty(&table->scan.cells[i]) ||
                      (strcmp(field->name, "test") == 0) == (kind == EXCHANGE_MEASUREMENT);
        for (size_t k = 0; !is_own && of_both[k] != NULL; k++)
            is_own = strcmp(field->name, of_both[k]) == 0;
        if (!is_own)
            refuse(table, field->name,
                   kind == EXCHANGE_MEASUREMENT
                       ? "belongs to a revision, and this row is a measurement"
                       : "belongs to a measurement, and this row is a revision");
    }
}

// Told once, in the header.
static void tell_lack(Table *table) {
    char place[POINTER_SIZE];
    static const char *const names[] = {"name", "source", "restitution"};
    const bool lacks[] = {table->lacks_name, table->lacks_source, table->lacks_restitution};
    for (size_t i = 0; i < COUNT(names) && !table->is_lack_told; i++) {
        place_of(place, 1, names[i]);
        if (lacks[i] && !problem_concerns(table->problem, place))
            (void)problem_add(table->problem, STATUS_INVALID, place,
                              "the column is missing; a revision needs name, source, and "
                              "restitution or table");
    }
    table->is_lack_told = true;
}

// So that it is not told in every row.
static bool fill_lack(Table *table, Material *material) {
    tell_lack(table);
    if (table->lacks_restitution)
        material->restitution = 0;
    if (table->lacks_name)
        material->name = strdup("-");
    if (table->lacks_source)
        material->source = strdup("-");
    return (material->name != NULL || !table->lacks_name) &&
           (material->source != NULL || !table->lacks_source);
}

static Status read_row(Table *table, Exchange *exchange) {
    char place[32], slug[POINTER_SIZE], kind[POINTER_SIZE];
    ExchangeRow row;
    const size_t faults = table->problem->count;
    snprintf(place, sizeof place, "/%zu", table->scan.row);
    place_of(slug, table->scan.row, "slug");
    place_of(kind, table->scan.row, "row");
    if (fields_default(exchange_row_fields, &row) != STATUS_OK)
        return STATUS_NO_MEMORY;
    Status status = read_cells(table, &row);
    // What kind of row it is has to be known, for the rest to be judged.
    if (status != STATUS_OK || problem_concerns(table->problem, kind)) {
        if (status == STATUS_OK)
            status = exchange_drift(exchange, row.slug, place, table->problem);
        fields_clear(exchange_row_fields, &row);
        return status;
    }
    const ExchangeKind is = (ExchangeKind)row.row;
    check_kind(table, is);
    if (is == EXCHANGE_REVISION && !fill_lack(table, &row.material)) {
        fields_clear(exchange_row_fields, &row);
        return STATUS_NO_MEMORY;
    }
    return exchange_take(exchange, row.slug, is, &row, place, slug, faults, table->problem);
}

Status exchange_read_csv(const char *text, size_t size, Exchange *exchange, Problem *problem) {
    const size_t mark = scan_mark(text, size);
    Table table = {.scan = {.text = text + mark, .size = size - mark}, .problem = problem};
    Status status = STATUS_OK;
    exchange->import.revision_name = exchange->import.measurement_name = "number";
    const bool goes_on = read_header(&table);
    exchange->import.is_partial = table.lacks_name || table.lacks_source || table.lacks_restitution;
    while (goes_on && status == STATUS_OK && csv_reader_next(&table.scan))
        status = table.scan.row > EXCHANGE_ROWS_MAX + 1 ? exchange_refuse_many(problem)
                                                        : read_row(&table, exchange);
    if (table.scan.is_failed && table.scan.count >= CSV_CELLS_MAX)
        refuse(&table, "", "there are more than 1000 cells in a row");
    else if (table.scan.is_failed || status == STATUS_NO_MEMORY)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the materials");
    csv_reader_clear(&table.scan);
    return status != STATUS_OK ? status : problem->count > 0 ? STATUS_INVALID : STATUS_OK;
}
_Static_assert(CSV_CELLS_MAX == 1000, "the sentence names this number");

void exchange_place_faults(Problem *problem) {
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
