// Comma-separated values: one header row with units, then a row per sample. Used by encoders.c.
// Not quoted: names and units are ours and hold neither comma nor quote.
#ifndef SERVER_FORMATS_CSV_H
#define SERVER_FORMATS_CSV_H

#include "server/formats/format.h"

extern const TableFormat encoder_csv;

#endif
