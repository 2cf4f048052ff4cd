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

// In buckets two columns are the lists "min" and "max" of one channel.
static void json_open_column(const Table *table, size_t c, Bytes *bytes) {
    const size_t channel = c - (table->axis_name != NULL);
    const TableColumn column = table_column(table, c);
    char name[sizeof((Column){0}.name)];
    if (table->axis != NULL && c == 0) {
        json_open_list(bytes, column.name, column.unit, "values");
    } else if (table->source != NULL) {
        bytes_text(bytes, c > 0 ? ",\n " : "\"columns\": {\n ");
        json_open_list(bytes, column.name, column.unit, "values");
    } else if (table->bucket > 0 && channel % 2 == 1) {
        bytes_text(bytes, ", \"max\": [");
    } else {
        text_fit(name, sizeof name, column.name);
        if (table->bucket > 0 && strlen(name) > strlen("_min"))
            name[strlen(name) - strlen("_min")] = '\0';
        bytes_text(bytes, channel > 0 ? ", " : "\"channels\": {");
        json_open_list(bytes, name, column.unit, table->bucket > 0 ? "min" : "values");
    }
}

// Rows of a column; false: they cannot be read any more.
static bool json_put_values(const Table *table, size_t c, size_t first, size_t count,
                            Bytes *bytes) {
    double numbers[FORMAT_PIECE_NUMBERS];
    const TableColumn column = table_column(table, c);
    if (!table_read(table, c, first, count, numbers))
        return false;
    if (column.texts == NULL)
        bytes_reals(bytes, numbers, count);
    for (size_t i = 0; i < count && column.texts != NULL; i++) {
        bytes_json(bytes, column.is_json ? "%p%p" : "%p%s", i > 0 ? "," : "",
                   column.texts[(size_t)numbers[i]]);
    }
    return true;
}

// An axis that is counted has no list.
static bool json_next_values(const Table *table, TextPlace *place, Bytes *bytes) {
    const bool is_counted = table->axis_name != NULL && table->axis == NULL;
    const size_t c = place->part - 1 + is_counted;
    if (c == table_width(table)) {
        bytes_text(bytes, table->column_count == 0 ? "\"channels\": {}" : "}");
        if (table->source != NULL)
            table->source->put_end(table->source->context, bytes);
        bytes_text(bytes, "}\n");
        return false;
    }
    const size_t left = table->count - place->row;
    const size_t count = left < FORMAT_PIECE_NUMBERS ? left : FORMAT_PIECE_NUMBERS;
    if (place->row == 0)
        json_open_column(table, c, bytes);
    else
        bytes_text(bytes, ",");
    if (!json_put_values(table, c, place->row, count, bytes))
        return false;
    place->row += count;
    if (place->row == table->count) {
        const bool is_axis = table->axis != NULL && c == 0;
        const bool has_max =
            table->bucket > 0 && !is_axis && (c - (table->axis_name != NULL)) % 2 == 0;
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
