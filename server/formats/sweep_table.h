// A sweep's table as text: JSON and CSV. Not its chart (charts.h) and not where the rows come
// from. Used by answer.c and api/sweeps.c.
#ifndef SERVER_FORMATS_SWEEP_TABLE_H
#define SERVER_FORMATS_SWEEP_TABLE_H

#include "server/formats/sweep_source.h"
#include "server/util/bytes.h"

// A text on its way. All but the first three is zero at the start.
typedef struct SweepText {
    const Sweep *sweep; // its table is not looked at but for what failed
    const SweepSource *source;
    const char *result; // the id under which it is served, for links; NULL: it is not
    size_t part, row;
    bool is_broken; // the source was: what is there is not the whole
} SweepText;

// Appends the next piece; false: that was the last one.
bool sweep_json_next(SweepText *text, Bytes *bytes);
bool sweep_csv_next(SweepText *text, Bytes *bytes);

// The whole of a sweep that has its table. `result`: the id under which it is served, for links;
// NULL: it is not.
void sweep_json(const Sweep *sweep, const char *result, Bytes *bytes);

void sweep_csv(const Sweep *sweep, Bytes *bytes);

// A text as JSON has it, out of a scalar in JSON: the same, or without its quotes where it has any.
void sweep_put_scalar_csv(Bytes *bytes, const char *json);

#endif
