// Numbers have the shortest digits that read back to the same double. Names and units are the
// program's own and hold neither comma nor quote.
#include "server/formats/csv.h"

#include <math.h>
#include <string.h>

#include "server/formats/format.h"
#include "server/util/dtoa.h"

static char *csv_put_real(char *at, double value) {
    if (isfinite(value))
        return at + dtoa_write(at, value);
    const char *text = isnan(value) ? "nan" : value < 0 ? "-inf" : "inf";
    const size_t length = strlen(text);
    memcpy(at, text, length);
    return at + length;
}

static void csv_put_name(Bytes *bytes, const char *name, const char *unit) {
    bytes_text(bytes, name);
    if (unit != NULL && unit[0] != '\0')
        bytes_format(bytes, " [%s]", unit);
}

static void csv_put_count(Bytes *bytes, uint64_t count) {
    bytes_format(bytes, "%llu", (unsigned long long)count);
}

// --- cells ---

static bool csv_is_number(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT;
}

void csv_cells_header_of(Bytes *bytes, const char *before, const Field *fields) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (!csv_is_number(field))
            continue;
        bytes_format(bytes, ",%s%s", before, *before != '\0' ? "." : "");
        csv_put_name(bytes, field->name, field->unit);
    }
}

void csv_cells_header(Bytes *bytes, const Field *fields) {
    csv_cells_header_of(bytes, "", fields);
}

void csv_cells_real(Bytes *bytes, double value) {
    char digits[SHORTEST_SIZE];
    bytes_put(bytes, digits, (size_t)(csv_put_real(digits, value) - digits));
}

void csv_cells_members(Bytes *bytes, const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (!csv_is_number(field))
            continue;
        bytes_text(bytes, ",");
        if (field->kind == FIELD_KIND_REAL)
            csv_cells_real(bytes, *(const double *)member);
        else if (*(const uint64_t *)member == COUNT_ABSENT)
            bytes_text(bytes, "nan");
        else
            csv_put_count(bytes, *(const uint64_t *)member);
    }
}

void csv_cells_text(Bytes *bytes, const char *text) {
    if (text == NULL)
        return;
    bytes_text(bytes, "\"");
    for (; *text != '\0'; text++)
        bytes_put(bytes, *text == '"' ? "\"\"" : text, *text == '"' ? 2 : 1);
    bytes_text(bytes, "\"");
}

// --- tables ---

static void csv_put_header(const Table *table, Bytes *bytes) {
    if (table->axis_name != NULL)
        csv_put_name(bytes, table->axis_name, table->axis_unit);
    for (size_t c = 0; c < table->column_count; c++) {
        bytes_text(bytes, c > 0 || table->axis_name != NULL ? "," : "");
        csv_put_name(bytes, table->columns[c]->name, table->columns[c]->unit);
    }
    for (const Field *field = table->fields; field != NULL && field->kind != FIELD_KIND_END;
         field++) {
        bytes_text(bytes, field != table->fields ? "," : "");
        csv_put_name(bytes, field->name, field->unit);
    }
    bytes_text(bytes, "\n");
}

// An absent member is an empty cell, a choice its word.
static void csv_put_record(Bytes *bytes, const Field *fields, const void *record) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)record + field->offset;
        bytes_text(bytes, field != fields ? "," : "");
        if (field_is_absent(field, record))
            continue;
        if (field->kind == FIELD_KIND_REAL)
            bytes_real(bytes, *(const double *)member);
        else if (field->kind == FIELD_KIND_COUNT)
            csv_put_count(bytes, *(const uint64_t *)member);
        else if (field->kind == FIELD_KIND_CHOICE)
            bytes_text(bytes, field->choices[*(const int *)member]);
    }
    bytes_text(bytes, "\n");
}

// Rows of columns, with room for all digits made before.
static void csv_put_rows(const Table *table, size_t from, size_t end, Bytes *bytes) {
    const size_t width = 1 + table->column_count, first = table->bucket > 0 ? 0 : table->first;
    if (!bytes_reserve(bytes, (end - from) * width * (SHORTEST_SIZE + 1)))
        return;
    char *at = bytes->at + bytes->count;
    for (size_t i = from; i < end; i++) {
        if (table->axis_name != NULL)
            at = csv_put_real(at,
                              table->axis != NULL ? table->axis[first + i] : table_time(table, i));
        for (size_t c = 0; c < table->column_count; c++) {
            if (c > 0 || table->axis_name != NULL)
                *at++ = ',';
            at = csv_put_real(at, table->columns[c]->values[first + i]);
        }
        *at++ = '\n';
    }
    *at = '\0';
    bytes->count = (size_t)(at - bytes->at);
}

static bool csv_next(const Table *table, TextPlace *place, Bytes *bytes) {
    if (place->part++ == 0) {
        csv_put_header(table, bytes);
        return table->count > 0;
    }
    const size_t rows = FORMAT_PIECE_NUMBERS / (1 + table->column_count) + 1;
    const size_t end = table->count - place->row < rows ? table->count : place->row + rows;
    if (table->fields == NULL)
        csv_put_rows(table, place->row, end, bytes);
    else
        for (size_t i = place->row; i < end; i++)
            csv_put_record(bytes, table->fields,
                           (const char *)table->records + i * table->record_size);
    place->row = end;
    return end < table->count;
}

const TableFormat format_csv = {
    .extension = "csv",
    .content_type = "text/csv; charset=utf-8",
    .is_binary = false,
    .next = csv_next,
};
