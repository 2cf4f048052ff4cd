#include "server/formats/study_formats.h"

#include "server/json/encode.h"
#include "server/util/base_path.h"

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

SweepDocument sweep_document(const Sweep *sweep) {
    return (SweepDocument){.sweep = sweep,
                           .rows = sweep->table.points.count,
                           .read = sweep_table_read,
                           .context = (void *)(uintptr_t)sweep};
}

// The columns: the points' numbers, the axes, the metrics, the statuses.
static TableColumn sweep_column(const void *context, size_t index) {
    const Sweep *sweep = ((const SweepDocument *)context)->sweep;
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    if (index == 0)
        return (TableColumn){.name = "index"};
    if (index <= axes) {
        const SweepAxisValues *axis = &sweep->axes.at[index - 1];
        return (TableColumn){axis->pointer, axis->unit, (const char *const *)axis->values.at,
                             axis->values.count, true};
    }
    if (index <= axes + metrics) {
        const char *name = sweep->metrics.at[index - 1 - axes];
        return (TableColumn){.name = name, .unit = sweep_metric_unit(name)};
    }
    return (TableColumn){
        .name = "status", .texts = sweep_status_names, .text_count = SWEEP_STATUSES};
}

// Of an axis the indices of its values.
static bool sweep_read(void *context, size_t index, size_t first, size_t count, double *target) {
    SweepDocument *document = context;
    const size_t axes = document->sweep->axes.count, metrics = document->sweep->metrics.count;
    const size_t cell = index <= axes             ? SWEEP_CELL_POINT
                        : index <= axes + metrics ? SWEEP_CELL_METRIC + index - 1 - axes
                                                  : SWEEP_CELL_STATUS;
    if (document->is_broken || !document->read(document->context, cell, first, count, target)) {
        document->is_broken = true;
        return false;
    }
    for (size_t i = 0; i < count && index > 0 && index <= axes; i++)
        target[i] = (double)sweep_value_index(document->sweep, index - 1, (size_t)target[i]);
    return true;
}

static void sweep_put_head(const void *context, Bytes *bytes) {
    const SweepDocument *document = context;
    const Sweep *sweep = document->sweep;
    const size_t rows = document->rows;
    bytes_text(bytes, "\"kind\": \"sweep\", ");
    if (document->result != NULL)
        bytes_format(bytes, "\"result\": \"%s\", ", document->result);
    bytes_format(bytes, "\"status\": \"%s\", \"points\": %llu, \"done\": %zu, \"failed\": %llu",
                 rows == sweep->points ? "complete" : "partial", (unsigned long long)sweep->points,
                 rows, (unsigned long long)sweep->table.failed);
    bytes_format(bytes, ", \"mode\": \"%s\", \"axes\": ", sweep_mode_names[sweep->mode]);
    encode_list(bytes, sweep_axis_values_fields, sweep->axes.at, sweep->axes.count,
                sizeof *sweep->axes.at, WRITE_REPORT);
    bytes_text(bytes, ", \"failures\": ");
    encode_list(bytes, sweep_failure_fields, sweep->table.failures.at, sweep->table.failures.count,
                sizeof *sweep->table.failures.at, WRITE_REPORT);
    bytes_text(bytes, ", ");
}

static void sweep_put_links(const void *context, Bytes *bytes) {
    const char *base = base_path(), *result = ((const SweepDocument *)context)->result;
    if (result == NULL)
        return;
    bytes_format(bytes,
                 ", \"links\": {\"self\": \"%s/v1/results/%s/table.json\", "
                 "\"point\": \"%s/v1/results/%s/points/{index}\", "
                 "\"scene\": \"%s/v1/results/%s/points/{index}/scene\"}",
                 base, result, base, result, base, result);
}

Table sweep_document_table(SweepDocument *document) {
    const Sweep *sweep = document->sweep;
    document->columns =
        (TableSource){document, sweep_column, sweep_read, sweep_put_head, sweep_put_links};
    return (Table){.count = document->rows,
                   .column_count = 2 + sweep->axes.count + sweep->metrics.count,
                   .source = &document->columns};
}
