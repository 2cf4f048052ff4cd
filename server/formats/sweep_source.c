#include "server/formats/sweep_source.h"

static bool read_table(void *context, size_t cell, size_t first, size_t count, double *target) {
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
    return (SweepSource){sweep->table.points.count, read_table, (void *)(uintptr_t)sweep};
}

const char *sweep_axis_text(const Sweep *sweep, size_t axis, double point) {
    return sweep->axes.at[axis].values.at[sweep_value_index(sweep, axis, (size_t)point)];
}
