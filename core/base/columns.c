// All columns share one block: one allocation, and a column-major matrix.
#include "core/base/columns.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

Status columns_allocate(Columns *columns, size_t count, size_t rows, size_t max_bytes,
                        Problem *problem) {
    memset(columns, 0, sizeof *columns);
    const size_t max = max_bytes != 0 ? max_bytes : SIZE_MAX / 2;
    if (count != 0 && rows > max / sizeof(double) / count)
        return problem_set(problem, STATUS_LIMIT,
                           "%zu columns of %zu values are more than the limit of %zu bytes", count,
                           rows, max);
    const size_t cells = count * rows;
    columns->at = calloc(count != 0 ? count : 1, sizeof *columns->at);
    columns->block = malloc((cells != 0 ? cells : 1) * sizeof *columns->block);
    if (columns->at == NULL || columns->block == NULL) {
        columns_clear(columns);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu columns of %zu values",
                           count, rows);
    }
    columns->count = count;
    columns->rows = rows;
    for (size_t i = 0; i < count; i++)
        columns->at[i].values = columns->block + i * rows;
    return STATUS_OK;
}

void columns_name(Columns *columns, size_t index, const char *name, const char *unit) {
    Column *column = &columns->at[index];
    text_fit(column->name, sizeof column->name, name);
    text_fit(column->unit, sizeof column->unit, unit != NULL ? unit : "");
}

void columns_clear(Columns *columns) {
    if (columns == NULL)
        return;
    free(columns->at);
    free(columns->block);
    memset(columns, 0, sizeof *columns);
}

const Column *columns_find(const Columns *columns, const char *name) {
    for (size_t i = 0; i < columns->count; i++)
        if (strcmp(columns->at[i].name, name) == 0)
            return &columns->at[i];
    return NULL;
}
