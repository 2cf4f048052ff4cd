// A series: {"sample_rate", "start", "count", "channels"}; in buckets "count" counts those, and
// "bucket" and "samples" follow. Over an axis that is given, the axis stands in place of rate and
// start, as one more member of the form that channels have; without any, nothing does.
#include "server/formats/json.h"

#include <string.h>

// Lists of numbers stand one after the other: the axis where it is given, then the columns.
typedef struct Lists {
    size_t axes, count;
} Lists;

static Lists lists_of(const Table *table) {
    const size_t axes = table->axis != NULL ? 1 : 0;
    return (Lists){axes, axes + table->column_count};
}

static void put_frame(const Table *table, Bytes *bytes) {
    bytes_text(bytes, "{");
    if (table->axis == NULL && table->axis_name != NULL) {
        bytes_text(bytes, "\"sample_rate\": ");
        bytes_real(bytes, table->axis_rate);
        bytes_text(bytes, ", \"start\": ");
        bytes_real(bytes, table_time(table, 0));
        bytes_text(bytes, ", ");
    }
    bytes_format(bytes, "\"count\": %zu, ", table->count);
    if (table->bucket > 0)
        bytes_format(bytes, "\"bucket\": %zu, \"samples\": %zu, ", table->bucket, table->samples);
}

static void open_member(Bytes *bytes, const char *name, const char *unit, const char *values) {
    bytes_json_string(bytes, name);
    bytes_text(bytes, ": {\"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_format(bytes, ", \"%s\": [", values);
}

static void open_list(const Table *table, size_t list, Bytes *bytes) {
    const Lists lists = lists_of(table);
    if (list < lists.axes) {
        open_member(bytes, table->axis_name, table->axis_unit, "values");
        return;
    }
    const size_t c = list - lists.axes;
    const Column *column = table->columns[c];
    if (c == 0)
        bytes_text(bytes, "\"channels\": {");
    if (table->bucket == 0) {
        bytes_text(bytes, c > 0 ? ", " : "");
        open_member(bytes, column->name, column->unit, "values");
    } else if (c % 2 == 0) {
        char name[sizeof column->name];
        text_fit(name, sizeof name, column->name);
        const size_t length = strlen(name), ending = strlen("_min");
        name[length > ending ? length - ending : 0] = '\0';
        bytes_text(bytes, c > 0 ? ", " : "");
        open_member(bytes, name, column->unit, "min");
    } else {
        bytes_text(bytes, ", \"max\": [");
    }
}

static void close_list(const Table *table, size_t list, Bytes *bytes) {
    const Lists lists = lists_of(table);
    const bool is_first_of_two =
        table->bucket > 0 && list >= lists.axes && (list - lists.axes) % 2 == 0;
    bytes_text(bytes, is_first_of_two ? "]" : "]}");
    if (list < lists.axes)
        bytes_text(bytes, ", ");
}

static bool json_next(const Table *table, TextPlace *place, Bytes *bytes) {
    const Lists lists = lists_of(table);
    if (place->part == 0) {
        put_frame(table, bytes);
        if (table->column_count == 0 && lists.axes == 0)
            bytes_text(bytes, "\"channels\": {");
        place->part = 1;
        return true;
    }
    const size_t list = place->part - 1;
    if (list >= lists.count) {
        if (table->column_count == 0 && lists.axes > 0)
            bytes_text(bytes, "\"channels\": {");
        bytes_text(bytes, "}}\n");
        return false;
    }
    const double *values =
        list < lists.axes ? table->axis : table->columns[list - lists.axes]->values;
    const size_t left = table->count - place->row;
    const size_t count = left < ENCODER_PIECE_NUMBERS ? left : ENCODER_PIECE_NUMBERS;
    if (place->row == 0)
        open_list(table, list, bytes);
    else
        bytes_text(bytes, ",");
    bytes_reals(bytes, table_values(table, values) + place->row, count);
    place->row += count;
    if (place->row == table->count) {
        close_list(table, list, bytes);
        *place = (TextPlace){place->part + 1, 0};
    }
    return true;
}

const TableFormat encoder_json = {
    .extension = "json",
    .content_type = "application/json",
    .is_binary = false,
    .next = json_next,
};
