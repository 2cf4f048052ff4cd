// Named columns of doubles of equal length: time series, spectra, tables.
#ifndef CORE_BASE_COLUMNS_H
#define CORE_BASE_COLUMNS_H

#include <stddef.h>

#include "core/base/status.h"

typedef struct Column {
    char name[48];
    char unit[24];
    double *values; // `rows` of them, inside the block of Columns
} Column;

// All zero is empty. The values of all columns are in one block, column after column.
typedef struct Columns {
    Column *at;
    size_t count;
    size_t rows;
    double *block;
} Columns;

// Allocates `count` columns of `rows` uninitialised values, without names; freed by columns_clear.
// STATUS_LIMIT if they need more than `max_bytes` (0: no limit).
Status columns_allocate(Columns *columns, size_t count, size_t rows, size_t max_bytes,
                        Problem *problem);
void columns_name(Columns *columns, size_t index, const char *name, const char *unit);
void columns_clear(Columns *columns);
const Column *columns_find(const Columns *columns, const char *name); // NULL if absent

#endif
