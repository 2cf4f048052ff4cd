// Columns of a table, tables of records, and downsampling.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "server/formats/format.h"

static bool table_has_axis(const Table *table) {
    return table->axis_name != NULL;
}

size_t table_width(const Table *table) {
    return table->column_count + table_has_axis(table);
}

TableColumn table_column(const Table *table, size_t column) {
    if (table->source != NULL)
        return table->source->column(table->source->context, column);
    if (table_has_axis(table) && column == 0)
        return (TableColumn){.name = table->axis_name, .unit = table->axis_unit};
    const Column *one = table->columns[column - table_has_axis(table)];
    return (TableColumn){.name = one->name, .unit = one->unit};
}

bool table_read(const Table *table, size_t column, size_t first, size_t count, double *target) {
    if (table->source != NULL)
        return table->source->read(table->source->context, column, first, count, target);
    const bool is_axis = table_has_axis(table) && column == 0;
    const double *values =
        is_axis ? table->axis : table->columns[column - table_has_axis(table)]->values;
    if (values != NULL) {
        memcpy(target, table_values(table, values) + first, count * sizeof *target);
        return true;
    }
    // Whole numbers below 2^53, so that each sum is exact and each quotient that of table_time. The
    // loop becomes vectors.
    const double step = table->bucket > 0 ? (double)table->bucket : 1;
    const double start = (double)table->first + (double)first * step;
    for (int i = 0; i < (int)count; i++)
        target[i] = (start + i * step) / table->axis_rate;
    return true;
}

bool table_column_is_numeric(const TableColumn *column) {
    for (size_t i = 0; i < column->text_count; i++)
        if (!column->is_json || strchr("-0123456789", column->texts[i][0]) == NULL)
            return false;
    return column->texts != NULL;
}

const char *table_bare(const TableColumn *column, double value, size_t *length) {
    const char *text = column->texts[(size_t)value];
    const bool is_quoted = column->is_json && *text == '"';
    *length = strlen(text) - (is_quoted ? 2 : 0);
    return text + is_quoted;
}

static bool table_has_field(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT ||
           field->kind == FIELD_KIND_CHOICE;
}

static double table_number(const Field *field, const char *record) {
    const void *at = record + field->offset;
    if (field_is_absent(field, record))
        return (double)NAN;
    return field->kind == FIELD_KIND_REAL    ? *(const double *)at
           : field->kind == FIELD_KIND_COUNT ? (double)*(const uint64_t *)at
                                             : (double)*(const int *)at;
}

Status table_records(const Field *fields, const void *records, size_t count, size_t size,
                     Columns *columns, Problem *problem) {
    size_t wide = 0, c = 0;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        wide += table_has_field(field);
    TRY(columns_allocate(columns, wide, count, 0, problem));
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        if (!table_has_field(field))
            continue;
        columns_name(columns, c, field->name, field->unit);
        for (size_t i = 0; i < count; i++)
            columns->at[c].values[i] = table_number(field, (const char *)records + i * size);
        c++;
    }
    return STATUS_OK;
}

// --- downsampling ---

enum { LANES = 8 }; // side by side, so that they become vectors

static inline double downsample_lesser(double a, double b) {
    return a < b ? a : b;
}

static inline double downsample_larger(double a, double b) {
    return a > b ? a : b;
}

void downsample_extremes(const double *values, size_t count, double *min, double *max) {
    double low = values[0], high = values[0];
    size_t i = 0;
    if (count >= LANES) {
        double lows[LANES], highs[LANES];
        for (size_t k = 0; k < LANES; k++)
            lows[k] = highs[k] = values[k];
        for (i = LANES; i + LANES <= count; i += LANES)
            for (size_t k = 0; k < LANES; k++) {
                lows[k] = downsample_lesser(values[i + k], lows[k]);
                highs[k] = downsample_larger(values[i + k], highs[k]);
            }
        for (size_t k = 0; k < LANES; k++) {
            low = downsample_lesser(lows[k], low);
            high = downsample_larger(highs[k], high);
        }
    }
    for (; i < count; i++) {
        low = downsample_lesser(values[i], low);
        high = downsample_larger(values[i], high);
    }
    *min = low;
    *max = high;
}

Status downsample(const Column *const *columns, size_t column_count, size_t first, size_t count,
                  size_t bucket, Columns *buckets, Problem *problem) {
    const size_t rows = (count + bucket - 1) / bucket;
    TRY(columns_allocate(buckets, 2 * column_count, rows, 0, problem));
    for (size_t c = 0; c < column_count; c++) {
        char name[sizeof columns[c]->name];
        const double *values = columns[c]->values + first;
        Column *pair = &buckets->at[2 * c];
        snprintf(name, sizeof name, "%.43s_min", columns[c]->name);
        columns_name(buckets, 2 * c, name, columns[c]->unit);
        snprintf(name, sizeof name, "%.43s_max", columns[c]->name);
        columns_name(buckets, 2 * c + 1, name, columns[c]->unit);
        for (size_t i = 0; i < rows; i++) {
            const size_t from = i * bucket, left = count - from;
            downsample_extremes(values + from, left < bucket ? left : bucket, &pair[0].values[i],
                                &pair[1].values[i]);
        }
    }
    return STATUS_OK;
}
