// Numbers have the shortest digits that read back to the same double. Names and units are the
// program's own and hold neither comma nor quote.
#include "server/util/csv.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/format.h"

// A cell, quoted if it must be.
static void csv_put_text(Bytes *bytes, const char *text, size_t length) {
    bool is_quoted = false;
    for (size_t i = 0; i < length; i++)
        is_quoted = is_quoted || strchr(",\"\n\r", text[i]) != NULL;
    if (is_quoted)
        csv_cells_text(bytes, text, length);
    else
        bytes_put(bytes, text, length);
}

static void csv_put_title(Bytes *bytes, const char *name, const char *unit) {
    char title[256];
    const bool has_unit = unit != NULL && *unit != '\0';
    snprintf(title, sizeof title, "%.220s%s%.23s%s", name, has_unit ? " [" : "",
             has_unit ? unit : "", has_unit ? "]" : "");
    csv_put_text(bytes, title, strlen(title));
}

static void csv_put_header(const Table *table, Bytes *bytes) {
    for (size_t c = 0; c < table_width(table); c++) {
        const TableColumn column = table_column(table, c);
        bytes_text(bytes, c > 0 ? "," : "");
        csv_put_title(bytes, column.name, column.unit);
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
            bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)member);
        else if (field->kind == FIELD_KIND_CHOICE)
            bytes_text(bytes, field->choices[*(const int *)member]);
    }
    bytes_text(bytes, "\n");
}

// Rows of columns; false: they cannot be read any more.
static bool csv_put_rows(const Table *table, size_t from, size_t count, Bytes *bytes) {
    const size_t width = table_width(table);
    double *cells = malloc((width * count + 1) * sizeof *cells);
    TableColumn *columns = malloc((width + 1) * sizeof *columns);
    bool is_read = true;
    bytes->is_failed = bytes->is_failed || cells == NULL || columns == NULL;
    for (size_t c = 0; c < width && is_read && !bytes->is_failed; c++) {
        columns[c] = table_column(table, c);
        is_read = table_read(table, c, from, count, cells + c * count);
    }
    for (size_t row = 0; row < count && is_read && !bytes->is_failed; row++) {
        for (size_t c = 0; c < width; c++) {
            const double value = cells[c * count + row];
            size_t length;
            bytes_text(bytes, c > 0 ? "," : "");
            if (columns[c].texts == NULL) {
                csv_cells_real(bytes, value);
                continue;
            }
            const char *text = table_bare(&columns[c], value, &length);
            csv_put_text(bytes, text, length);
        }
        bytes_text(bytes, "\n");
    }
    free(columns);
    free(cells);
    return is_read;
}

static bool csv_next(const Table *table, TextPlace *place, Bytes *bytes) {
    if (place->part++ == 0) {
        csv_put_header(table, bytes);
        return table->count > 0;
    }
    const size_t rows = FORMAT_PIECE_NUMBERS / (1 + table->column_count) + 1;
    const size_t end = table->count - place->row < rows ? table->count : place->row + rows;
    for (size_t i = place->row; i < end && table->fields != NULL; i++)
        csv_put_record(bytes, table->fields, (const char *)table->records + i * table->record_size);
    if (table->fields == NULL && !csv_put_rows(table, place->row, end - place->row, bytes))
        return false;
    place->row = end;
    return end < table->count;
}

const TableFormat format_csv = {
    .extension = "csv",
    .content_type = "text/csv; charset=utf-8",
    .is_binary = false,
    .next = csv_next,
};
