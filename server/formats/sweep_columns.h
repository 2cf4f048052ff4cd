// A sweep's table as numbers alone, for the formats that hold nothing else: NPY and MAT. Texts are
// told by their place in the axis's values, from 0, a row's status by SweepStatus. Not NPZ, which
// holds texts too (sweep_npz.h). Used by answer.c and api/sweeps.c.
#ifndef SERVER_FORMATS_SWEEP_COLUMNS_H
#define SERVER_FORMATS_SWEEP_COLUMNS_H

#include "server/formats/format.h"
#include "server/formats/sweep_npz.h"

// As sweep_npz_lay, in another format; the columns of the CSV in its order.
Status sweep_columns_lay(SweepArchive *archive, const TableFormat *encoder, Segments *layout,
                         Problem *problem);

void sweep_columns(const Sweep *sweep, const TableFormat *encoder, Bytes *bytes);

#endif
