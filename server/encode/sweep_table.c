// Columns are the points' numbers, the axes, the metrics and what became of each point; rows are
// those that are there. Memory is one buffer, whatever the number of rows.
#include "server/encode/sweep_table.h"

#include <math.h>
#include <string.h>

#include "server/base/link.h"

static const char *unit_of(const Sweep *sweep, size_t metric) {
    return sweep_metric_unit(sweep->metrics.at[metric]);
}

static double value_at(const Sweep *sweep, size_t row, size_t metric) {
    return sweep->table.values.at[row * sweep->metrics.count + metric];
}

static const char *axis_text(const Sweep *sweep, size_t axis, size_t row) {
    const size_t point = (size_t)sweep->table.points.at[row];
    return sweep->axes.at[axis].values.at[sweep_value_index(sweep, axis, point)];
}

static const char *status_at(const Sweep *sweep, size_t row) {
    return sweep_status_names[(size_t)sweep->table.statuses.at[row]];
}

static void open_column(Bytes *bytes, const char *name, const char *unit) {
    bytes_text(bytes, ",\n ");
    bytes_json_string(bytes, name);
    bytes_text(bytes, ": {\"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", \"values\": [");
}

static void put_axis(Bytes *bytes, const Sweep *sweep, size_t axis) {
    open_column(bytes, sweep->axes.at[axis].pointer, sweep->axes.at[axis].unit);
    for (size_t row = 0; row < sweep->table.points.count; row++) {
        bytes_text(bytes, row > 0 ? "," : "");
        bytes_text(bytes, axis_text(sweep, axis, row));
    }
    bytes_text(bytes, "]}");
}

static void put_metric(Bytes *bytes, const Sweep *sweep, size_t metric) {
    open_column(bytes, sweep->metrics.at[metric], unit_of(sweep, metric));
    for (size_t row = 0; row < sweep->table.points.count; row++) {
        bytes_text(bytes, row > 0 ? "," : "");
        bytes_real(bytes, value_at(sweep, row, metric));
    }
    bytes_text(bytes, "]}");
}

static void put_columns(Bytes *bytes, const Sweep *sweep) {
    const size_t rows = sweep->table.points.count;
    bytes_text(bytes, ", \"columns\": {\n \"index\": {\"unit\": null, \"values\": [");
    for (size_t row = 0; row < rows; row++)
        bytes_format(bytes, row > 0 ? ",%.0f" : "%.0f", sweep->table.points.at[row]);
    bytes_text(bytes, "]}");
    for (size_t i = 0; i < sweep->axes.count; i++)
        put_axis(bytes, sweep, i);
    for (size_t i = 0; i < sweep->metrics.count; i++)
        put_metric(bytes, sweep, i);
    open_column(bytes, "status", NULL);
    for (size_t row = 0; row < rows; row++)
        bytes_format(bytes, row > 0 ? ",\"%s\"" : "\"%s\"", status_at(sweep, row));
    bytes_text(bytes, "]}}");
}

static void put_axes(Bytes *bytes, const Sweep *sweep) {
    bytes_text(bytes, ", \"axes\": [");
    for (size_t i = 0; i < sweep->axes.count; i++) {
        const SweepTold *axis = &sweep->axes.at[i];
        bytes_text(bytes, i > 0 ? ", {\"pointer\": " : "{\"pointer\": ");
        bytes_json_string(bytes, axis->pointer);
        bytes_text(bytes, ", \"unit\": ");
        bytes_json_string(bytes, axis->unit);
        bytes_text(bytes, ", \"values\": [");
        for (size_t k = 0; k < axis->values.count; k++) {
            bytes_text(bytes, k > 0 ? "," : "");
            bytes_text(bytes, axis->values.at[k]);
        }
        bytes_text(bytes, "]}");
    }
    bytes_text(bytes, "]");
}

static void put_failures(Bytes *bytes, const Sweep *sweep) {
    const SweepFailures *failures = &sweep->table.failures;
    bytes_text(bytes, ", \"failures\": [");
    for (size_t i = 0; i < failures->count; i++) {
        const SweepFailure *failure = &failures->at[i];
        bytes_format(bytes, "%s{\"status\": \"%s\", \"count\": %llu, \"first_point\": %llu",
                     i > 0 ? ", " : "", sweep_status_names[failure->status],
                     (unsigned long long)failure->count, (unsigned long long)failure->first_point);
        bytes_text(bytes, ", \"detail\": ");
        bytes_json_string(bytes, failure->detail);
        bytes_text(bytes, "}");
    }
    bytes_text(bytes, "]");
}

static void put_links(Bytes *bytes, const char *result) {
    const char *base = link_base();
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/table.json\"", base, result);
    bytes_format(bytes, ", \"point\": \"%s/v1/results/%s/points/{index}\"", base, result);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/{index}/scene\"}", base, result);
}

void sweep_json(const Sweep *sweep, const char *result, Bytes *bytes) {
    const size_t rows = sweep->table.points.count;
    bytes_text(bytes, "{\"kind\": \"sweep\", ");
    if (result != NULL)
        bytes_format(bytes, "\"result\": \"%s\", ", result);
    bytes_format(bytes, "\"status\": \"%s\", \"points\": %llu, \"done\": %zu, \"failed\": %llu",
                 rows == sweep->points ? "complete" : "partial", (unsigned long long)sweep->points,
                 rows, (unsigned long long)sweep->table.failed);
    bytes_format(bytes, ", \"mode\": \"%s\"", sweep_mode_names[sweep->mode]);
    put_axes(bytes, sweep);
    put_failures(bytes, sweep);
    put_columns(bytes, sweep);
    if (result != NULL)
        put_links(bytes, result);
    bytes_text(bytes, "}\n");
}

// A cell: quoted, its quotes doubled, where it must be.
static void put_cell(Bytes *bytes, const char *text) {
    if (strpbrk(text, ",\"\n\r") == NULL) {
        bytes_text(bytes, text);
        return;
    }
    bytes_text(bytes, "\"");
    for (; *text != '\0'; text++)
        bytes_put(bytes, *text == '"' ? "\"\"" : text, *text == '"' ? 2 : 1);
    bytes_text(bytes, "\"");
}

void sweep_put_scalar_csv(Bytes *bytes, const char *json) {
    if (*json != '"') {
        bytes_text(bytes, json);
        return;
    }
    const size_t length = strlen(json);
    char text[256];
    const size_t kept = length - 2 < sizeof text ? length - 2 : sizeof text - 1;
    memcpy(text, json + 1, kept);
    text[kept] = '\0';
    put_cell(bytes, text);
}

static void put_header(Bytes *bytes, const char *name, const char *unit) {
    char text[256];
    bytes_text(bytes, ",");
    if (unit == NULL) {
        put_cell(bytes, name);
        return;
    }
    text_fit(text, sizeof text - 32, name);
    const size_t length = strlen(text);
    text[length] = ' ';
    text[length + 1] = '[';
    text_fit(text + length + 2, 24, unit);
    const size_t whole = strlen(text);
    text[whole] = ']';
    text[whole + 1] = '\0';
    put_cell(bytes, text);
}

void sweep_csv(const Sweep *sweep, Bytes *bytes) {
    bytes_text(bytes, "index");
    for (size_t i = 0; i < sweep->axes.count; i++)
        put_header(bytes, sweep->axes.at[i].pointer, sweep->axes.at[i].unit);
    for (size_t i = 0; i < sweep->metrics.count; i++)
        put_header(bytes, sweep->metrics.at[i], unit_of(sweep, i));
    bytes_text(bytes, ",status\n");
    for (size_t row = 0; row < sweep->table.points.count; row++) {
        bytes_format(bytes, "%.0f", sweep->table.points.at[row]);
        for (size_t i = 0; i < sweep->axes.count; i++) {
            bytes_text(bytes, ",");
            sweep_put_scalar_csv(bytes, axis_text(sweep, i, row));
        }
        for (size_t i = 0; i < sweep->metrics.count; i++) {
            const double value = value_at(sweep, row, i);
            bytes_text(bytes, ",");
            if (isnan(value))
                bytes_text(bytes, "nan");
            else
                bytes_real(bytes, value);
        }
        bytes_format(bytes, ",%s\n", status_at(sweep, row));
    }
}
