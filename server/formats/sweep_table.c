// Columns are the points' numbers, the axes, the metrics and what became of each point; rows are
// those that are there. Texts are made piece by piece:
//
//     JSON   frame, axes one after the other, failures, columns one after the other, links
//     CSV    names, rows
#include "server/formats/sweep_table.h"

#include <math.h>
#include <string.h>

#include "server/util/base_path.h"

static const char *unit_of(const Sweep *sweep, size_t metric) {
    return sweep_metric_unit(sweep->metrics.at[metric]);
}

static const char *status_name(double status) {
    return sweep_status_names[(size_t)status];
}

static bool read_cells(SweepText *text, size_t cell, size_t count, double *target) {
    const SweepSource *source = text->source;
    text->is_broken =
        text->is_broken || !source->read(source->context, cell, text->row, count, target);
    return !text->is_broken;
}

static size_t piece_of(const SweepText *text, size_t rows) {
    return rows - text->row < SWEEP_PIECE ? rows - text->row : SWEEP_PIECE;
}

static void put_frame(const SweepText *text, Bytes *bytes) {
    const Sweep *sweep = text->sweep;
    const size_t rows = text->source->rows;
    bytes_text(bytes, "{\"kind\": \"sweep\", ");
    if (text->result != NULL)
        bytes_format(bytes, "\"result\": \"%s\", ", text->result);
    bytes_format(bytes, "\"status\": \"%s\", \"points\": %llu, \"done\": %zu, \"failed\": %llu",
                 rows == sweep->points ? "complete" : "partial", (unsigned long long)sweep->points,
                 rows, (unsigned long long)sweep->table.failed);
    bytes_format(bytes, ", \"mode\": \"%s\", \"axes\": [", sweep_mode_names[sweep->mode]);
}

// All rows of it, or a piece: true at its end.
static bool put_axis(SweepText *text, size_t axis, Bytes *bytes) {
    const SweepAxisValues *told = &text->sweep->axes.at[axis];
    const size_t count = piece_of(text, told->values.count);
    if (text->row == 0) {
        bytes_text(bytes, axis > 0 ? ", {\"pointer\": " : "{\"pointer\": ");
        bytes_json_string(bytes, told->pointer);
        bytes_text(bytes, ", \"unit\": ");
        bytes_json_string(bytes, told->unit);
        bytes_text(bytes, ", \"values\": [");
    }
    for (size_t i = text->row; i < text->row + count; i++) {
        bytes_text(bytes, i > 0 ? "," : "");
        bytes_text(bytes, told->values.at[i]);
    }
    text->row += count;
    if (text->row < told->values.count)
        return false;
    bytes_text(bytes, "]}");
    return true;
}

static void put_failures(Bytes *bytes, const Sweep *sweep) {
    const StudyFailures *failures = &sweep->table.failures;
    bytes_text(bytes, "], \"failures\": [");
    for (size_t i = 0; i < failures->count; i++) {
        const StudyFailure *failure = &failures->at[i];
        bytes_format(bytes, "%s{\"status\": \"%s\", \"count\": %llu, \"first_point\": %llu",
                     i > 0 ? ", " : "", sweep_status_names[failure->status],
                     (unsigned long long)failure->count, (unsigned long long)failure->first);
        bytes_text(bytes, ", \"detail\": ");
        bytes_json_string(bytes, failure->detail);
        bytes_text(bytes, "}");
    }
}

// The columns as JSON has them: the points' numbers, the axes, the metrics, the statuses.
static void open_column(const Sweep *sweep, size_t column, Bytes *bytes) {
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    const char *name = "status", *unit = NULL;
    if (column == 0) {
        name = "index";
    } else if (column <= axes) {
        name = sweep->axes.at[column - 1].pointer;
        unit = sweep->axes.at[column - 1].unit;
    } else if (column <= axes + metrics) {
        name = sweep->metrics.at[column - 1 - axes];
        unit = unit_of(sweep, column - 1 - axes);
    }
    bytes_text(bytes, column > 0 ? ",\n " : "], \"columns\": {\n ");
    bytes_json_string(bytes, name);
    bytes_text(bytes, ": {\"unit\": ");
    bytes_json_string(bytes, unit);
    bytes_text(bytes, ", \"values\": [");
}

static bool put_column(SweepText *text, size_t column, Bytes *bytes) {
    const Sweep *sweep = text->sweep;
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    const size_t count = piece_of(text, text->source->rows);
    const bool is_metric = column > axes && column <= axes + metrics;
    const bool is_status = column > axes + metrics;
    double values[SWEEP_PIECE];
    if (text->row == 0)
        open_column(sweep, column, bytes);
    else
        bytes_text(bytes, ",");
    if (!read_cells(text,
                    is_metric   ? SWEEP_CELL_METRIC + column - axes - 1
                    : is_status ? SWEEP_CELL_STATUS
                                : SWEEP_CELL_POINT,
                    count, values))
        return true;
    if (is_metric || column == 0)
        bytes_reals(bytes, values, count);
    for (size_t i = 0; i < count && !is_metric && column > 0; i++) {
        bytes_text(bytes, i > 0 ? "," : "");
        if (is_status)
            bytes_format(bytes, "\"%s\"", status_name(values[i]));
        else
            bytes_text(bytes, sweep_axis_text(sweep, column - 1, values[i]));
    }
    text->row += count;
    if (text->row < text->source->rows)
        return false;
    bytes_text(bytes, "]}");
    return true;
}

static void put_links(Bytes *bytes, const char *result) {
    const char *base = base_path();
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/table.json\"", base, result);
    bytes_format(bytes, ", \"point\": \"%s/v1/results/%s/points/{index}\"", base, result);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/{index}/scene\"}", base, result);
}

bool sweep_json_next(SweepText *text, Bytes *bytes) {
    const size_t axes = text->sweep->axes.count, columns = 2 + axes + text->sweep->metrics.count;
    // Frame, axes, failures, columns, links.
    bool is_done = true;
    if (text->part == 0)
        put_frame(text, bytes);
    else if (text->part <= axes)
        is_done = put_axis(text, text->part - 1, bytes);
    else if (text->part == axes + 1)
        put_failures(bytes, text->sweep);
    else if (text->part <= axes + 1 + columns)
        is_done = put_column(text, text->part - axes - 2, bytes);
    if (is_done) {
        text->part++;
        text->row = 0;
    }
    if (text->part <= axes + 1 + columns)
        return !text->is_broken;
    bytes_text(bytes, "}");
    if (text->result != NULL)
        put_links(bytes, text->result);
    bytes_text(bytes, "}\n");
    return false;
}

void sweep_json(const Sweep *sweep, const char *result, Bytes *bytes) {
    const SweepSource source = sweep_source(sweep);
    SweepText text = {.sweep = sweep, .source = &source, .result = result};
    while (sweep_json_next(&text, bytes))
        continue;
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

static void put_names(const Sweep *sweep, Bytes *bytes) {
    bytes_text(bytes, "index");
    for (size_t i = 0; i < sweep->axes.count; i++)
        put_header(bytes, sweep->axes.at[i].pointer, sweep->axes.at[i].unit);
    for (size_t i = 0; i < sweep->metrics.count; i++)
        put_header(bytes, sweep->metrics.at[i], unit_of(sweep, i));
    bytes_text(bytes, ",status\n");
}

bool sweep_csv_next(SweepText *text, Bytes *bytes) {
    const Sweep *sweep = text->sweep;
    const size_t metrics = sweep->metrics.count, count = piece_of(text, text->source->rows);
    double cells[SWEEP_CELLS][SWEEP_PIECE];
    if (text->row == 0)
        put_names(sweep, bytes);
    for (size_t cell = 0; cell < SWEEP_CELL_METRIC + metrics && cell < SWEEP_CELLS; cell++)
        if (!read_cells(text, cell, count, cells[cell]))
            return false;
    for (size_t row = 0; row < count; row++) {
        bytes_real(bytes, cells[SWEEP_CELL_POINT][row]);
        for (size_t i = 0; i < sweep->axes.count; i++) {
            bytes_text(bytes, ",");
            sweep_put_scalar_csv(bytes, sweep_axis_text(sweep, i, cells[SWEEP_CELL_POINT][row]));
        }
        for (size_t i = 0; i < metrics && i < SWEEP_METRICS; i++) {
            const double value = cells[SWEEP_CELL_METRIC + i][row];
            bytes_text(bytes, ",");
            if (isnan(value))
                bytes_text(bytes, "nan");
            else
                bytes_real(bytes, value);
        }
        bytes_format(bytes, ",%s\n", status_name(cells[SWEEP_CELL_STATUS][row]));
    }
    text->row += count;
    return text->row < text->source->rows;
}

void sweep_csv(const Sweep *sweep, Bytes *bytes) {
    const SweepSource source = sweep_source(sweep);
    SweepText text = {.sweep = sweep, .source = &source};
    while (sweep_csv_next(&text, bytes))
        continue;
}
