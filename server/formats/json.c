// A series: {"sample_rate", "start", "count", "channels"}; in buckets "count" counts those, and
// "bucket" and "samples" follow. An axis that is given is a list like a channel, in place of rate
// and start. Records are one list of objects.
#include <string.h>

#include "server/formats/format.h"
#include "server/json/encode.h"

static void json_put_head(const Table *table, Bytes *bytes) {
    bytes_text(bytes, "{");
    if (table->source != NULL) {
        table->source->put_head(table->source->context, bytes);
        return;
    }
    if (table->members != NULL) {
        bytes_text(bytes, table->members);
        return;
    }
    if (table->axis == NULL && table->axis_name != NULL)
        bytes_json(bytes, "\"sample_rate\": %g, \"start\": %g, ", table->axis_rate,
                   table_time(table, 0));
    bytes_format(bytes, "\"count\": %zu, ", table->count);
    if (table->bucket > 0)
        bytes_format(bytes, "\"bucket\": %zu, \"samples\": %zu, ", table->bucket, table->samples);
}

static void json_open_list(Bytes *bytes, const char *name, const char *unit, const char *values) {
    bytes_json(bytes, "\"%s\": {\"unit\": %s, \"%s\": [", name, unit, values);
}

// Column `c`, or the axis; in buckets two columns are the lists "min" and "max" of one channel.
static void json_open_column(const Table *table, size_t c, bool is_axis, Bytes *bytes) {
    if (is_axis) {
        json_open_list(bytes, table->axis_name, table->axis_unit, "values");
        return;
    }
    if (table->source != NULL) {
        const TableColumn described = table_column(table, c);
        bytes_text(bytes, c > 0 ? ",\n " : "\"columns\": {\n ");
        json_open_list(bytes, described.name, described.unit, "values");
        return;
    }
    const Column *column = table->columns[c];
    char name[sizeof column->name];
    if (table->bucket > 0 && c % 2 == 1) {
        bytes_text(bytes, ", \"max\": [");
        return;
    }
    text_fit(name, sizeof name, column->name);
    if (table->bucket > 0 && strlen(name) > strlen("_min"))
        name[strlen(name) - strlen("_min")] = '\0';
    bytes_text(bytes, c > 0 ? ", " : "\"channels\": {");
    json_open_list(bytes, name, column->unit, table->bucket > 0 ? "min" : "values");
}

// Rows of a column; false: the source cannot be read any more.
static bool json_put_values(const Table *table, const double *values, size_t c, size_t first,
                            size_t count, Bytes *bytes) {
    const TableSource *source = table->source;
    if (source == NULL) {
        bytes_reals(bytes, table_values(table, values) + first, count);
        return true;
    }
    double numbers[TABLE_PIECE];
    const TableColumn column = table_column(table, c);
    if (!source->read(source->context, c, first, count, numbers))
        return false;
    if (column.texts == NULL)
        bytes_reals(bytes, numbers, count);
    for (size_t i = 0; i < count && column.texts != NULL; i++) {
        bytes_json(bytes, column.is_json ? "%p%p" : "%p%s", i > 0 ? "," : "",
                   column.texts[(size_t)numbers[i]]);
    }
    return true;
}

static bool json_next_values(const Table *table, TextPlace *place, Bytes *bytes) {
    const size_t axes = table->axis != NULL ? 1 : 0, list = place->part - 1;
    const bool is_axis = list < axes;
    if (list == axes + table->column_count) {
        bytes_text(bytes, table->column_count == 0 ? "\"channels\": {}" : "}");
        if (table->source != NULL)
            table->source->put_end(table->source->context, bytes);
        bytes_text(bytes, "}\n");
        return false;
    }
    const size_t c = list - axes, left = table->count - place->row;
    const size_t max = table->source != NULL ? TABLE_PIECE : FORMAT_PIECE_NUMBERS;
    const size_t count = left < max ? left : max;
    const double *values = is_axis                 ? table->axis
                           : table->source != NULL ? NULL
                                                   : table->columns[c]->values;
    if (place->row == 0)
        json_open_column(table, c, is_axis, bytes);
    else
        bytes_text(bytes, ",");
    if (!json_put_values(table, values, c, place->row, count, bytes))
        return false;
    place->row += count;
    if (place->row == table->count) {
        const bool has_max = table->bucket > 0 && !is_axis && c % 2 == 0;
        bytes_text(bytes, is_axis ? "]}, " : has_max ? "]" : "]}");
        *place = (TextPlace){place->part + 1, 0};
    }
    return true;
}

static bool json_next_records(const Table *table, TextPlace *place, Bytes *bytes) {
    enum { PIECE = 128 };
    const size_t left = table->count - place->row, count = left < PIECE ? left : PIECE;
    bytes_text(bytes, place->row == 0 ? "[" : "");
    for (size_t i = place->row; i < place->row + count; i++) {
        bytes_text(bytes, i > 0 ? ", {" : "{");
        if (table->numbers != NULL)
            bytes_format(bytes, "\"number\": %zu, ", table->numbers[i]);
        (void)encode_members(bytes, table->fields,
                             (const char *)table->records + i * table->record_size, WRITE_REPORT);
        bytes_text(bytes, "}");
    }
    place->row += count;
    if (place->row < table->count)
        return true;
    bytes_format(bytes, "]%s}\n", table->end != NULL ? table->end : "");
    return false;
}

static bool json_next(const Table *table, TextPlace *place, Bytes *bytes) {
    if (place->part == 0) {
        json_put_head(table, bytes);
        place->part = 1;
        return true;
    }
    return table->fields != NULL ? json_next_records(table, place, bytes)
                                 : json_next_values(table, place, bytes);
}

const TableFormat format_json = {
    .extension = "json",
    .content_type = "application/json",
    .is_binary = false,
    .next = json_next,
};
