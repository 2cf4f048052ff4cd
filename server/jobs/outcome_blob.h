// Binary form of an Outcome for the database: spectra, impacts, energies and summary in one blob,
// the series in another. Plan, work and warnings are JSON documents of the result.
#ifndef SERVER_JOBS_OUTCOME_BLOB_H
#define SERVER_JOBS_OUTCOME_BLOB_H

#include "core/simulation/simulation.h"
#include "server/util/bytes.h"

void outcome_blob_write(Bytes *bytes, const Outcome *outcome);
// An outcome without series, with one reference. NULL
// for anything that outcome_blob_write did not write, and without memory.
Outcome *outcome_blob_read(const void *blob, size_t size);

void series_blob_write(Bytes *bytes, const Columns *series);
// `series` is cleared by columns_clear; false, and empty, as above.
bool series_blob_read(const void *blob, size_t size, Columns *series);

#endif
