// A tradeoff study as a work-precision chart: error against CPU time, both logarithmic, as SVG that
// stands on its own in light and dark. Not a format of tables (encoder.h). Used by
// answer.c.
#ifndef SERVER_ENCODE_CHART_H
#define SERVER_ENCODE_CHART_H

#include "core/study/tradeoff.h"
#include "server/base/bytes.h"

// Appends the whole document. Points that were not measured, or whose error by the metric is not
// known, stand in its description.
void chart_tradeoff(const Tradeoff *tradeoff, Bytes *bytes);

#endif
