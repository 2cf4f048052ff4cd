// A sweep's chart as SVG: lines over one axis, or heat maps over two. Not its table
// (sweep_table.h). Used by answer.c and
// api/sweeps.c.
#ifndef SERVER_ENCODE_CHART_SWEEP_H
#define SERVER_ENCODE_CHART_SWEEP_H

#include "server/base/bytes.h"
#include "server/encode/sweep_source.h"

// Appends the whole document, in the reader's light or dark colours. False where the rows could not
// be read to their end.
bool chart_sweep(const Sweep *sweep, const SweepSource *source, Bytes *bytes);

#endif
