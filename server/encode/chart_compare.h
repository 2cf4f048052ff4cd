// A comparison of contact models as a chart: spectra over each other, and displacements over each
// other. Not a format of tables (encoder.h). Used by answer.c.
#ifndef SERVER_ENCODE_CHART_COMPARE_H
#define SERVER_ENCODE_CHART_COMPARE_H

#include "core/study/model_comparison.h"
#include "server/base/bytes.h"

// Appends the whole document. Variants that were not run, or are too many to be told apart, stand
// in its description.
void chart_compare(const Comparison *comparison, Bytes *bytes);

#endif
