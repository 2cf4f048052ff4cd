#include "server/formats/sweep.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/format.h"
#include "server/util/base_path.h"
#include "server/util/csv.h"

static bool sweep_table_read(void *context, size_t cell, size_t first, size_t count,
                             double *target) {
    const Sweep *sweep = context;
    const SweepTable *table = &sweep->table;
    for (size_t i = first; i < first + count; i++)
        *target++ = cell == SWEEP_CELL_POINT ? table->points.at[i]
                    : cell == SWEEP_CELL_STATUS
                        ? table->statuses.at[i]
                        : table->values.at[i * sweep->metrics.count + cell - SWEEP_CELL_METRIC];
    return true;
}

SweepSource sweep_source(const Sweep *sweep) {
    return (SweepSource){sweep->table.points.count, sweep_table_read, (void *)(uintptr_t)sweep};
}

// A column: the points' numbers, then the axes, the metrics, the statuses.
typedef struct SweepColumn {
    const char *name, *unit;
    size_t cell;
    const Texts *values; // of an axis: the column has indices into these; NULL: no axis
    size_t axis;
} SweepColumn;

static size_t sweep_columns(const Sweep *sweep) {
    return 2 + sweep->axes.count + sweep->metrics.count;
}

static SweepColumn sweep_column(const Sweep *sweep, size_t index) {
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    if (index == 0)
        return (SweepColumn){.name = "index", .cell = SWEEP_CELL_POINT};
    if (index <= axes) {
        const SweepAxisValues *axis = &sweep->axes.at[index - 1];
        return (SweepColumn){axis->pointer, axis->unit, SWEEP_CELL_POINT, &axis->values, index - 1};
    }
    if (index <= axes + metrics) {
        const char *name = sweep->metrics.at[index - 1 - axes];
        return (SweepColumn){.name = name,
                             .unit = sweep_metric_unit(name),
                             .cell = SWEEP_CELL_METRIC + index - 1 - axes};
    }
    return (SweepColumn){.name = "status", .cell = SWEEP_CELL_STATUS};
}

// Reads rows of a column, as numbers; false: the source is broken.
static bool sweep_column_read(SweepDocument *document, const SweepColumn *column, size_t first,
                              size_t count, double *values) {
    const SweepSource *source = document->source;
    if (document->is_broken || !source->read(source->context, column->cell, first, count, values))
        document->is_broken = true;
    for (size_t i = 0; i < count && !document->is_broken && column->values != NULL; i++)
        values[i] = (double)sweep_value_index(document->sweep, column->axis, (size_t)values[i]);
    return !document->is_broken;
}

static bool sweep_column_has_texts(const SweepColumn *column) {
    return column->values != NULL || column->cell == SWEEP_CELL_STATUS;
}

// The text of a cell: of an axis a JSON scalar; NULL: the column has numbers.
static const char *sweep_column_text(const SweepColumn *column, double value) {
    return column->values != NULL              ? column->values->at[(size_t)value]
           : column->cell == SWEEP_CELL_STATUS ? sweep_status_names[(size_t)value]
                                               : NULL;
}

static size_t sweep_piece(const TextPlace *place, size_t rows, size_t max) {
    return rows - place->row < max ? rows - place->row : max;
}

// The parts of the JSON: frame, axes, failures, columns, links.

static void sweep_json_frame(const SweepDocument *document, Bytes *bytes) {
    const Sweep *sweep = document->sweep;
    const size_t rows = document->source->rows;
    bytes_text(bytes, "{\"kind\": \"sweep\", ");
    if (document->result != NULL)
        bytes_format(bytes, "\"result\": \"%s\", ", document->result);
    bytes_format(bytes, "\"status\": \"%s\", \"points\": %llu, \"done\": %zu, \"failed\": %llu",
                 rows == sweep->points ? "complete" : "partial", (unsigned long long)sweep->points,
                 rows, (unsigned long long)sweep->table.failed);
    bytes_format(bytes, ", \"mode\": \"%s\", \"axes\": [", sweep_mode_names[sweep->mode]);
}

// The next piece of an axis; true: that was its last.
static bool sweep_json_axis(const SweepDocument *document, size_t index, TextPlace *place,
                            Bytes *bytes) {
    const SweepAxisValues *axis = &document->sweep->axes.at[index];
    const size_t end = place->row + sweep_piece(place, axis->values.count, SWEEP_PIECE);
    if (place->row == 0) {
        bytes_text(bytes, index > 0 ? ", {\"pointer\": " : "{\"pointer\": ");
        bytes_json_string(bytes, axis->pointer);
        bytes_text(bytes, ", \"unit\": ");
        bytes_json_string(bytes, axis->unit);
        bytes_text(bytes, ", \"values\": [");
    }
    for (size_t i = place->row; i < end; i++) {
        bytes_text(bytes, i > 0 ? "," : "");
        bytes_text(bytes, axis->values.at[i]);
    }
    place->row = end;
    if (end < axis->values.count)
        return false;
    bytes_text(bytes, "]}");
    return true;
}

static void sweep_json_failures(const Sweep *sweep, Bytes *bytes) {
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
    bytes_text(bytes, "], \"columns\": {\n ");
}

// The next piece of a column; true: that was its last.
static bool sweep_json_column(SweepDocument *document, size_t index, TextPlace *place,
                              Bytes *bytes) {
    const SweepColumn column = sweep_column(document->sweep, index);
    const size_t rows = document->source->rows, count = sweep_piece(place, rows, SWEEP_PIECE);
    double values[SWEEP_PIECE];
    if (place->row == 0) {
        bytes_text(bytes, index > 0 ? ",\n " : "");
        bytes_json_string(bytes, column.name);
        bytes_text(bytes, ": {\"unit\": ");
        bytes_json_string(bytes, column.unit);
        bytes_text(bytes, ", \"values\": [");
    } else {
        bytes_text(bytes, ",");
    }
    if (!sweep_column_read(document, &column, place->row, count, values))
        return true;
    const bool has_texts = sweep_column_has_texts(&column);
    const char *quote = column.values != NULL ? "" : "\"";
    if (!has_texts)
        bytes_reals(bytes, values, count);
    for (size_t i = 0; i < count && has_texts; i++)
        bytes_format(bytes, "%s%s%s%s", i > 0 ? "," : "", quote,
                     sweep_column_text(&column, values[i]), quote);
    place->row += count;
    if (place->row < rows)
        return false;
    bytes_text(bytes, "]}");
    return true;
}

static void sweep_json_links(const char *result, Bytes *bytes) {
    const char *base = base_path();
    bytes_format(bytes, ", \"links\": {\"self\": \"%s/v1/results/%s/table.json\"", base, result);
    bytes_format(bytes, ", \"point\": \"%s/v1/results/%s/points/{index}\"", base, result);
    bytes_format(bytes, ", \"scene\": \"%s/v1/results/%s/points/{index}/scene\"}", base, result);
}

static bool sweep_json_next(const Table *table, TextPlace *place, Bytes *bytes) {
    SweepDocument *document = table->source->context;
    const Sweep *sweep = document->sweep;
    const size_t axes = sweep->axes.count, end = axes + 2 + sweep_columns(sweep);
    bool is_done = true;
    if (place->part == 0)
        sweep_json_frame(document, bytes);
    else if (place->part <= axes)
        is_done = sweep_json_axis(document, place->part - 1, place, bytes);
    else if (place->part == axes + 1)
        sweep_json_failures(sweep, bytes);
    else
        is_done = sweep_json_column(document, place->part - axes - 2, place, bytes);
    if (is_done) {
        place->part++;
        place->row = 0;
    }
    if (place->part < end)
        return !document->is_broken;
    bytes_text(bytes, "}");
    if (document->result != NULL)
        sweep_json_links(document->result, bytes);
    bytes_text(bytes, "}\n");
    return false;
}

// Without its quotes, if it has any: the texts of values have none inside.
static const char *sweep_bare(const char *json, size_t *length) {
    const bool is_quoted = *json == '"';
    *length = strlen(json) - (is_quoted ? 2 : 0);
    return json + is_quoted;
}

// A cell, quoted if it must be.
static void sweep_csv_text(Bytes *bytes, const char *text) {
    if (strpbrk(text, ",\"\n\r") == NULL)
        bytes_text(bytes, text);
    else
        csv_cells_text(bytes, text);
}

static void sweep_csv_scalar(Bytes *bytes, const char *json) {
    char text[256];
    size_t length;
    const char *bare = sweep_bare(json, &length);
    if (bare == json) {
        bytes_text(bytes, json);
        return;
    }
    snprintf(text, sizeof text, "%.*s", (int)length, bare);
    sweep_csv_text(bytes, text);
}

static void sweep_csv_names(const Sweep *sweep, Bytes *bytes) {
    for (size_t i = 0; i < sweep_columns(sweep); i++) {
        const SweepColumn column = sweep_column(sweep, i);
        char name[256];
        text_fit(name, sizeof name - 32, column.name);
        const size_t length = strlen(name);
        if (column.unit != NULL)
            snprintf(name + length, sizeof name - length, " [%.23s]", column.unit);
        bytes_text(bytes, i > 0 ? "," : "");
        sweep_csv_text(bytes, name);
    }
    bytes_text(bytes, "\n");
}

static bool sweep_csv_next(const Table *table, TextPlace *place, Bytes *bytes) {
    enum { PIECE = 64 };
    SweepDocument *document = table->source->context;
    const Sweep *sweep = document->sweep;
    const size_t columns = sweep_columns(sweep);
    const size_t count = sweep_piece(place, document->source->rows, PIECE);
    SweepColumn column[SWEEP_COLUMNS_MAX];
    double cells[SWEEP_COLUMNS_MAX][PIECE];
    if (place->row == 0)
        sweep_csv_names(sweep, bytes);
    for (size_t i = 0; i < columns; i++) {
        column[i] = sweep_column(sweep, i);
        if (!sweep_column_read(document, &column[i], place->row, count, cells[i]))
            return false;
    }
    for (size_t row = 0; row < count; row++) {
        for (size_t i = 0; i < columns; i++) {
            const char *text = sweep_column_text(&column[i], cells[i][row]);
            bytes_text(bytes, i > 0 ? "," : "");
            if (text != NULL)
                sweep_csv_scalar(bytes, text);
            else
                csv_cells_real(bytes, cells[i][row]);
        }
        bytes_text(bytes, "\n");
    }
    place->row += count;
    return place->row < document->source->rows;
}

static bool sweep_is_numeric(const Texts *values) {
    for (size_t i = 0; i < values->count; i++)
        if (strchr("-0123456789", values->at[i][0]) == NULL)
            return false;
    return true;
}

static void sweep_measure(SweepDocument *document, bool has_texts) {
    for (size_t i = 0; i < sweep_columns(document->sweep); i++) {
        const SweepColumn column = sweep_column(document->sweep, i);
        const bool is_status = column.cell == SWEEP_CELL_STATUS;
        const size_t texts = column.values != NULL ? column.values->count
                             : is_status           ? (size_t)SWEEP_STATUSES
                                                   : 0;
        size_t *width = &document->widths[i], length;
        document->is_number[i] = column.values != NULL && sweep_is_numeric(column.values);
        *width = 0;
        for (size_t k = 0; k < texts && has_texts && !document->is_number[i]; k++) {
            (void)sweep_bare(sweep_column_text(&column, (double)k), &length);
            *width = length > *width ? length : *width;
        }
    }
}

// Bytes skip ... skip + size - 1 of a cell: of a number, or of a text filled up with zeros.
static void sweep_archive_cell(const SweepDocument *document, size_t index,
                               const SweepColumn *column, double value, size_t skip, char *target,
                               size_t size) {
    if (document->is_number[index])
        value = strtod(sweep_column_text(column, value), NULL);
    if (document->widths[index] == 0) {
        memcpy(target, (const char *)&value + skip, size);
        return;
    }
    size_t length;
    const char *text = sweep_bare(sweep_column_text(column, value), &length);
    const size_t left = length > skip ? length - skip : 0, kept = left < size ? left : size;
    memcpy(target, text + skip, kept);
    memset(target + kept, 0, size - kept);
}

static void sweep_archive_read(void *context, size_t index, uint64_t offset, void *target,
                               size_t size) {
    SweepDocument *document = context;
    const SweepColumn column = sweep_column(document->sweep, index);
    const size_t width = document->widths[index] > 0 ? document->widths[index] : sizeof(double);
    size_t row = (size_t)(offset / width), skip = (size_t)(offset % width);
    char *at = target, *const end = at + size;
    double values[SWEEP_PIECE];
    while (at < end) {
        const size_t rows = (skip + (size_t)(end - at) + width - 1) / width;
        const size_t count = rows < SWEEP_PIECE ? rows : SWEEP_PIECE;
        if (!sweep_column_read(document, &column, row, count, values)) {
            memset(at, 0, (size_t)(end - at));
            return;
        }
        for (size_t i = 0; i < count; i++, skip = 0) {
            const size_t left = (size_t)(end - at), whole = width - skip;
            const size_t some = whole < left ? whole : left;
            sweep_archive_cell(document, index, &column, values[i], skip, at, some);
            at += some;
        }
        row += count;
    }
}

static const char *sweep_array_name(const SweepColumn *column) {
    return *column->name == '/' ? column->name + 1 : column->name;
}

static Status sweep_lay_array(SweepDocument *document, Zip *zip, size_t index, Problem *problem) {
    const SweepColumn column = sweep_column(document->sweep, index);
    const size_t rows = document->source->rows, width = document->widths[index];
    char file[ZIP_NAME_MAX + 1], type[32] = "<f8";
    Segments array = {0};
    if (width > 0)
        snprintf(type, sizeof type, "|S%zu", width);
    npy_put_header(&array, type, rows, 0);
    segments_source(&array, &document->columns, index,
                    (uint64_t)rows * (width > 0 ? width : sizeof(double)));
    snprintf(file, sizeof file, "%.74s.npy", sweep_array_name(&column));
    const Status status = zip_put(zip, file, &array, problem);
    segments_clear(&array);
    return status;
}

static Status sweep_lay_npz(const Table *table, Segments *layout, Problem *problem) {
    SweepDocument *document = table->source->context;
    Zip zip = {.segments = layout};
    Status status = STATUS_OK;
    sweep_measure(document, true);
    for (size_t i = 0; i < sweep_columns(document->sweep) && status == STATUS_OK; i++)
        status = sweep_lay_array(document, &zip, i, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    return status != STATUS_OK ? status : ended;
}

static Status sweep_lay_numbers(const Table *table, const TableFormat *format, Segments *layout,
                                Problem *problem) {
    SweepDocument *document = table->source->context;
    const size_t count = sweep_columns(document->sweep);
    Column *columns = calloc(count, sizeof *columns);
    const Column *chosen[SWEEP_COLUMNS_MAX];
    if (columns == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    sweep_measure(document, false);
    for (size_t i = 0; i < count; i++) {
        const SweepColumn column = sweep_column(document->sweep, i);
        text_fit(columns[i].name, sizeof columns[i].name, sweep_array_name(&column));
        chosen[i] = &columns[i];
    }
    Table numbers = *table;
    numbers.columns = chosen;
    const Status status = format->lay(&numbers, layout, problem);
    free(columns);
    return status;
}

static Status sweep_lay_npy(const Table *table, Segments *layout, Problem *problem) {
    return sweep_lay_numbers(table, &format_npy, layout, problem);
}

static Status sweep_lay_mat(const Table *table, Segments *layout, Problem *problem) {
    return sweep_lay_numbers(table, &format_mat, layout, problem);
}

Table sweep_document_table(SweepDocument *document) {
    document->columns = (SegmentSource){sweep_archive_read, document};
    return (Table){.count = document->source->rows,
                   .column_count = sweep_columns(document->sweep),
                   .source = &document->columns};
}

const TableFormat *sweep_format(const char *extension) {
    static const TableFormat formats[] = {
        {.extension = "json", .content_type = "application/json", .next = sweep_json_next},
        {.extension = "csv", .content_type = "text/csv; charset=utf-8", .next = sweep_csv_next},
        {"npy", "application/x-npy", true, sweep_lay_npy, NULL},
        {"npz", "application/x-npz", true, sweep_lay_npz, NULL},
        {"mat", "application/x-matlab-data", true, sweep_lay_mat, NULL},
    };
    for (size_t i = 0; i < COUNT(formats); i++)
        if (strcmp(formats[i].extension, extension) == 0)
            return &formats[i];
    return NULL;
}

void sweep_write(const Sweep *sweep, const char *extension, Bytes *bytes) {
    const SweepSource source = sweep_source(sweep);
    SweepDocument document = {.sweep = sweep, .source = &source};
    const Table table = sweep_document_table(&document);
    if (format_write(sweep_format(extension), &table, bytes, NULL) != STATUS_OK)
        bytes->is_failed = true;
}
