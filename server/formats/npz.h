// NumPy's archive of arrays: one of float64 per column under its name, and the axis. Used by
// encoders.c and the bundle.
#ifndef SERVER_FORMATS_NPZ_H
#define SERVER_FORMATS_NPZ_H

#include "server/formats/format.h"

extern const TableFormat encoder_npz;

#endif
