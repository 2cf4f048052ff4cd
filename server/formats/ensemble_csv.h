// The runs of an ensemble as CSV, a row for each seed. Used by answer.c.
#ifndef SERVER_FORMATS_ENSEMBLE_CSV_H
#define SERVER_FORMATS_ENSEMBLE_CSV_H

#include "core/study/ensemble.h"
#include "server/util/bytes.h"

// Appends the whole document: seed, steps, the summary's numbers with their units, and why a run
// failed. What is not known is nan, as in the other tables.
void ensemble_csv(const Ensemble *ensemble, Bytes *bytes);

#endif
