// Named columns of doubles of one length: time series, spectra, tables.
// Not a matrix: each column has its own name and unit. Used by result/, the encoders and the store.
#ifndef CORE_BASE_COLUMNS_H
#define CORE_BASE_COLUMNS_H

#include <stddef.h>

#include "core/base/status.h"

typedef struct Column {
    char name[48];
    char unit[24];
    double *values; // `rows` of them, inside the Columns' block
} Column;

// All zero is empty. The values of all columns lie in one block, column after column.
typedef struct Columns {
    Column *at;
    size_t count;
    size_t rows;
    double *block;
} Columns;

// Makes `count` columns of `rows` values (not initialised) without names. At most `most_bytes` (0:
// no limit).
Status columns_make(Columns *columns, size_t count, size_t rows, size_t most_bytes,
                    Problem *problem);
void columns_name(Columns *columns, size_t index, const char *name, const char *unit);
void columns_clear(Columns *columns);
const Column *columns_find(const Columns *columns, const char *name); // NULL if absent

#endif
