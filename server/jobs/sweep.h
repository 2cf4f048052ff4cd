// The bytes of a sweep's rows, chunk by chunk, as the store keeps them. Not how they are made
// (study.h, sweep_gather.c). Used by sweep_gather.c, sweep_rows.c and the benches.
#ifndef SERVER_JOBS_SWEEP_H
#define SERVER_JOBS_SWEEP_H

#include "core/study/sweep.h"
#include "server/db/db.h"

size_t sweep_rows_of(const SweepRow *row, size_t chunk);
size_t sweep_row_size(const SweepRow *row);
double sweep_row_cell(const unsigned char *row, size_t cell); // 0 its status, 1 ... its metrics
SweepStatus sweep_row_status(const SweepRow *row, const SweepChunkRow *chunk, size_t place);
void sweep_row_values(const SweepRow *row, const SweepChunkRow *chunk, size_t place,
                      double *values);
void sweep_row_put(const SweepRow *row, SweepChunkRow *chunk, size_t place, SweepStatus status,
                   const double *values);
// Why the row at `place` failed, into `why`; "" where it is not told.
void sweep_row_reason(const SweepChunkRow *chunk, size_t place, char *why, size_t size);

#endif
