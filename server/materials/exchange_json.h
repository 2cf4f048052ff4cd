// The document that all materials are carried in, read. Not its writing
// (formats/material_export.h). Used by api/.
#ifndef SERVER_MATERIALS_EXCHANGE_JSON_H
#define SERVER_MATERIALS_EXCHANGE_JSON_H

#include "server/materials/exchange.h"

// STATUS_UNREADABLE where it is not JSON, STATUS_INVALID with the faults; what could be read has
// been taken. `exchange` is empty before and cleared by the caller in any case.
Status exchange_read_json(const char *text, size_t size, Exchange *exchange, Problem *problem);

#endif
