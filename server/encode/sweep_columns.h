// A sweep's table as numbers alone, for the formats that hold nothing else: NPY and MAT. Texts are
// told by their place in the axis's values, from 0, a row's status by SweepStatus. Not NPZ, which
// holds texts too (sweep_npz.h). Used by answer.c.
#ifndef SERVER_ENCODE_SWEEP_COLUMNS_H
#define SERVER_ENCODE_SWEEP_COLUMNS_H

#include "core/study/sweep.h"
#include "server/encode/encoder.h"

void sweep_columns(const Sweep *sweep, const Encoder *encoder, Bytes *bytes);

// Whether all values of an axis are numbers.
bool sweep_axis_is_numeric(const SweepTold *axis);

#endif
