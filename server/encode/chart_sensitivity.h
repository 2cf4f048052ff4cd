// A sensitivity study as a chart: the band of the drawn runs' spectra, and the slopes of the
// response as a table. Not a format of tables (encoder.h). Used by answer.c.
#ifndef SERVER_ENCODE_CHART_SENSITIVITY_H
#define SERVER_ENCODE_CHART_SENSITIVITY_H

#include "core/study/sensitivity.h"
#include "server/base/bytes.h"

// Appends the whole document. Slopes that do not settle are grey, with their spread.
void chart_sensitivity(const Sensitivity *sensitivity, Bytes *bytes);

#endif
