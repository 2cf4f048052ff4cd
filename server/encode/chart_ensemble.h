// An ensemble as a chart: the mean spectra with the band in which the mean over all seeds lies, and
// each statistic's mean with its interval and spread, as SVG that stands on its own in light and
// dark. Used by answer.c.
#ifndef SERVER_ENCODE_CHART_ENSEMBLE_H
#define SERVER_ENCODE_CHART_ENSEMBLE_H

#include "core/study/ensemble.h"
#include "server/base/bytes.h"

// Appends the whole document; what is not drawn stands in its description.
void chart_ensemble(const Ensemble *ensemble, Bytes *bytes);

#endif
