// NumPy's array file, version 1.0: float64 of shape (rows, 1 + columns), the axis first. Used by
// encoders.c and npz.c. Not self-describing: names and units stand in the result's document.
#ifndef SERVER_FORMATS_NPY_H
#define SERVER_FORMATS_NPY_H

#include "server/formats/format.h"

extern const TableFormat encoder_npy;

// The header alone; `columns` 0: of one dimension.
void npy_put_header(Segments *layout, size_t rows, size_t columns);
// The same of another type: "|S7".
void npy_put_header_of(Segments *layout, const char *type, size_t rows, size_t columns);
// The axis's numbers alone; nothing where there is no axis.
void npy_put_axis(Segments *layout, const Table *table);

#endif
