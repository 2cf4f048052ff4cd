#include "server/encode/sweep_columns.h"

#include <stdlib.h>
#include <string.h>

#include "server/encode/encoding.h"

bool sweep_axis_is_numeric(const SweepTold *axis) {
    for (size_t i = 0; i < axis->values.count; i++)
        if (strchr("-0123456789", axis->values.at[i][0]) == NULL)
            return false;
    return true;
}

static const char *without_slash(const char *pointer) {
    return *pointer == '/' ? pointer + 1 : pointer;
}

static void fill_axis(const Sweep *sweep, size_t axis, double *values) {
    const SweepTold *told = &sweep->axes.at[axis];
    const bool is_numeric = sweep_axis_is_numeric(told);
    for (size_t row = 0; row < sweep->table.points.count; row++) {
        const size_t point = (size_t)sweep->table.points.at[row];
        const size_t place = sweep_value_index(sweep, axis, point);
        values[row] = is_numeric ? strtod(told->values.at[place], NULL) : (double)place;
    }
}

static void copy(const Reals *reals, double *values) {
    for (size_t row = 0; row < reals->count; row++)
        values[row] = reals->at[row];
}

// The columns of the CSV in its order.
static void fill(const Sweep *sweep, Columns *columns) {
    const size_t rows = columns->rows, metrics = sweep->metrics.count;
    size_t at = 0;
    columns_name(columns, at, "index", NULL);
    copy(&sweep->table.points, columns->at[at++].values);
    for (size_t i = 0; i < sweep->axes.count; i++, at++) {
        columns_name(columns, at, without_slash(sweep->axes.at[i].pointer), sweep->axes.at[i].unit);
        fill_axis(sweep, i, columns->at[at].values);
    }
    for (size_t i = 0; i < metrics; i++, at++) {
        columns_name(columns, at, sweep->metrics.at[i], sweep_metric_unit(sweep->metrics.at[i]));
        for (size_t row = 0; row < rows; row++)
            columns->at[at].values[row] = sweep->table.values.at[row * metrics + i];
    }
    columns_name(columns, at, "status", NULL);
    copy(&sweep->table.statuses, columns->at[at].values);
}

void sweep_columns(const Sweep *sweep, const Encoder *encoder, Bytes *bytes) {
    const size_t count = 2 + sweep->axes.count + sweep->metrics.count;
    Columns columns = {0};
    const Column **chosen = calloc(count, sizeof *chosen);
    if (chosen != NULL &&
        columns_make(&columns, count, sweep->table.points.count, 0, NULL) == STATUS_OK) {
        fill(sweep, &columns);
        for (size_t i = 0; i < count; i++)
            chosen[i] = &columns.at[i];
        const Table table = {.count = columns.rows, .columns = chosen, .column_count = count};
        if (encoding_write(encoder, &table, bytes, NULL) != STATUS_OK)
            bytes->is_failed = true;
    } else {
        bytes->is_failed = true;
    }
    free(chosen);
    columns_clear(&columns);
}
