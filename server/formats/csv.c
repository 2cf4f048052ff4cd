// Numbers have the shortest digits that read back to the same double. Names and units are the
// program's own and hold neither comma nor quote.
#include "server/util/csv.h"
#include "server/formats/format.h"
#include "server/util/dtoa.h"

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
            bytes_format(bytes, "%llu", (unsigned long long)*(const uint64_t *)member);
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
