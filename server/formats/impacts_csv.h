// The ledger of impacts as CSV, a row for each, with kinds and sides as words. Used by
// api/impacts.c and api/bundle.c.
#ifndef SERVER_FORMATS_IMPACTS_CSV_H
#define SERVER_FORMATS_IMPACTS_CSV_H

#include "core/result/response.h"
#include "server/util/bytes.h"

// Appends the whole document. A cell is empty where a number is not known.
void impacts_csv(const Impacts *impacts, Bytes *bytes);

#endif
