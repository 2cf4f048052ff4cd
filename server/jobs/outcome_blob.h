// An outcome's numbers as bytes, for the store: series, spectra, the ledger of impacts, energies.
// Not plan, summary and warnings, which are documents. Used by worker.c and outcome.c.
#ifndef SERVER_JOBS_OUTCOME_BLOB_H
#define SERVER_JOBS_OUTCOME_BLOB_H

#include "core/simulation/simulation.h"
#include "server/util/bytes.h"

void outcome_blob_write(Bytes *bytes, const Outcome *outcome);
// One hold; NULL for what outcome_blob_write did not write, and without memory.
Outcome *outcome_blob_read(const char *at, size_t size);

#endif
