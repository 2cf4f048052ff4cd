// An evaluation of drop tests as a chart: every reading of e and T_c over approach speed, the means
// with their intervals, outliers and what is excluded marked. Not a format of tables (encoder.h).
// Used by api/proposals.c.
#ifndef SERVER_ENCODE_CHART_EVALUATION_H
#define SERVER_ENCODE_CHART_EVALUATION_H

#include "core/drop_test/evaluation.h"
#include "server/base/bytes.h"

// Appends the whole document. Readings without a speed stand at the left edge.
void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes);

#endif
