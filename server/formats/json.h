// Columns as JSON text. The frame of a series is here; that of a spectrum is its owner's. Not a
// document writer: that is json/encode.h. Used by encoders.c.
#ifndef SERVER_FORMATS_JSON_H
#define SERVER_FORMATS_JSON_H

#include "server/formats/format.h"

extern const TableFormat encoder_json;

#endif
