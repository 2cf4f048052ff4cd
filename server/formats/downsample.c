#include "server/formats/downsample.h"

#include <stdio.h>

enum { LANES = 8 };

static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

static inline double larger(double a, double b) {
    return a > b ? a : b;
}

void downsample_extremes(const double *values, size_t count, double *least, double *most) {
    double low = values[0], high = values[0];
    size_t i = 0;
    if (count >= LANES) {
        // Side by side, so that they become vectors.
        double lows[LANES], highs[LANES];
        for (size_t k = 0; k < LANES; k++)
            lows[k] = highs[k] = values[k];
        for (i = LANES; i + LANES <= count; i += LANES)
            for (size_t k = 0; k < LANES; k++) {
                lows[k] = lesser(values[i + k], lows[k]);
                highs[k] = larger(values[i + k], highs[k]);
            }
        for (size_t k = 0; k < LANES; k++) {
            low = lesser(lows[k], low);
            high = larger(highs[k], high);
        }
    }
    for (; i < count; i++) {
        low = lesser(values[i], low);
        high = larger(values[i], high);
    }
    *least = low;
    *most = high;
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
