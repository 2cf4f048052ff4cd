// Columns as JSON text, streamed. The frame of a series is here; that of a spectrum is its owner's.
// Not a document writer: that is codec/write.h. Used by encoders.c, api/ and the commands.
#ifndef SERVER_ENCODE_JSON_H
#define SERVER_ENCODE_JSON_H

#include "server/base/bytes.h"
#include "server/encode/encoder.h"

// Appends `"name": {"unit": "m", "values": [...]}`, without a comma on either side. What is not
// finite is null.
void json_put_values(Bytes *bytes, const char *name, const char *unit, const double *values,
                     size_t count);

// Appends `"channels": {...}` with the table's rows of each column.
void json_put_channels(Bytes *bytes, const Table *table);

extern const Encoder encoder_json;

#endif
