// A series: {"sample_rate", "start", "count", "channels"}. Over an axis that is given, the axis
// stands in place of rate and start, as one more member of the form that channels have.
#include "server/encode/json.h"

void json_put_values(Bytes *bytes, const char *name, const char *unit, const double *values,
                     size_t count) {
    bytes_json_string(bytes, name);
    bytes_text(bytes, ": {\"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", \"values\": [");
    bytes_reals(bytes, values, count);
    bytes_text(bytes, "]}");
}

void json_put_channels(Bytes *bytes, const Table *table) {
    bytes_text(bytes, "\"channels\": {");
    for (size_t c = 0; c < table->column_count; c++) {
        const Column *column = table->columns[c];
        if (c > 0)
            bytes_text(bytes, ", ");
        json_put_values(bytes, column->name, column->unit, column->values + table->first,
                        table->count);
    }
    bytes_text(bytes, "}");
}

static void json_write(const Table *table, Bytes *bytes) {
    bytes_text(bytes, "{");
    if (table->axis == NULL) {
        bytes_text(bytes, "\"sample_rate\": ");
        bytes_real(bytes, table->axis_rate);
        bytes_text(bytes, ", \"start\": ");
        bytes_real(bytes, (double)table->first / table->axis_rate);
        bytes_text(bytes, ", ");
    }
    bytes_format(bytes, "\"count\": %zu, ", table->count);
    if (table->axis != NULL) {
        json_put_values(bytes, table->axis_name, table->axis_unit, table->axis + table->first,
                        table->count);
        bytes_text(bytes, ", ");
    }
    json_put_channels(bytes, table);
    bytes_text(bytes, "}\n");
}

const Encoder encoder_json = {
    .extension = "json",
    .content_type = "application/json",
    .is_binary = false,
    .write = json_write,
};
