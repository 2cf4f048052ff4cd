// A sweep's table as NumPy's archive: an array for each column under its name; pointers without
// their first slash, texts as bytes. Not JSON or CSV (sweep_table.h). Used by answer.c.
#ifndef SERVER_ENCODE_SWEEP_NPZ_H
#define SERVER_ENCODE_SWEEP_NPZ_H

#include "core/study/sweep.h"
#include "server/base/bytes.h"

void sweep_npz(const Sweep *sweep, Bytes *bytes);

#endif
