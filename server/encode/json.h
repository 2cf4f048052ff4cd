// Columns as JSON text. The frame of a series is here; that of a spectrum is its owner's. Not a
// document writer: that is codec/write.h. Used by encoders.c.
#ifndef SERVER_ENCODE_JSON_H
#define SERVER_ENCODE_JSON_H

#include "server/encode/encoder.h"

extern const Encoder encoder_json;

#endif
