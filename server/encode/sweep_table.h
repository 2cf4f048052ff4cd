// A sweep's table as text: JSON and CSV. Not its chart (chart_sweep.h) and not where the rows come
// from. Used by answer.c and api/sweeps.c.
#ifndef SERVER_ENCODE_SWEEP_TABLE_H
#define SERVER_ENCODE_SWEEP_TABLE_H

#include "core/study/sweep.h"
#include "server/base/bytes.h"

// `result`: the id under which it is served, for links; NULL: it is not.
void sweep_json(const Sweep *sweep, const char *result, Bytes *bytes);

void sweep_csv(const Sweep *sweep, Bytes *bytes);

// A text as JSON has it, out of a scalar in JSON: the same, or without its quotes where it has any.
void sweep_put_scalar_csv(Bytes *bytes, const char *json);

#endif
