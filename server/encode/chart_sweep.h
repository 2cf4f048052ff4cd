// A sweep's chart as SVG: lines over one axis, or heat maps over two. Not its table
// (sweep_table.h). Used by answer.c.
#ifndef SERVER_ENCODE_CHART_SWEEP_H
#define SERVER_ENCODE_CHART_SWEEP_H

#include "core/study/sweep.h"
#include "server/base/bytes.h"

// Appends the whole document, in the reader's light or dark colours.
void chart_sweep(const Sweep *sweep, Bytes *bytes);

#endif
