// The answers of the studies, and the evaluation of drop tests, as charts: each function appends an
// SVG document. What a chart does not show is named in its description.
#ifndef SERVER_FORMATS_CHARTS_H
#define SERVER_FORMATS_CHARTS_H

#include "core/drop_test/evaluation.h"
#include "core/study/ensemble.h"
#include "core/study/model_comparison.h"
#include "core/study/sensitivity.h"
#include "core/study/tradeoff.h"
#include "server/formats/sweep.h"
#include "server/util/bytes.h"

// Error against CPU time, both logarithmic (a work-precision chart).
void charts_tradeoff(const Tradeoff *tradeoff, Bytes *bytes);
// The mean spectra with the intervals of the means, and the statistics with intervals and spread.
void charts_ensemble(const Ensemble *ensemble, Bytes *bytes);
// The spectra and the displacements of all variants.
void charts_compare(const Comparison *comparison, Bytes *bytes);
// The spectra of the drawn runs, and a table of the slopes.
void charts_sensitivity(const Sensitivity *sensitivity, Bytes *bytes);
// Each metric: a line over one axis, or a map over two. Size and memory are limited for any number
// of points. False: the rows could not be read to their end.
bool charts_sweep(const Sweep *sweep, const SweepSource *source, Bytes *bytes);
// Every reading over approach speed; those without a speed are at the left edge.
void charts_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes);

#endif
