// The table that all materials are carried in, read: a header of names, perhaps with units, in any
// order, and a row for each revision and measurement. Not its writing (formats/material_export.h).
// Used by api/.
#ifndef SERVER_MATERIALS_EXCHANGE_CSV_H
#define SERVER_MATERIALS_EXCHANGE_CSV_H

#include "server/materials/exchange.h"

// STATUS_INVALID with the faults, at "/ROW/COLUMN"; what could be read has been taken. `exchange`
// is empty before and cleared by the caller in any case.
Status exchange_read_csv(const char *text, size_t size, Exchange *exchange, Problem *problem);

// Gives every fault at "/ROW/COLUMN" its row and column.
void exchange_place_faults(Problem *problem);

#endif
