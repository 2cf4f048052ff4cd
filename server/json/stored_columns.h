// Reads back the spectra and the impacts of a result from the documents saved with it, to the bit.
// Not a reader of what clients send: that is read.h. Used by api/impacts.c
// and api/bundle.c.
#ifndef SERVER_JSON_STORED_COLUMNS_H
#define SERVER_JSON_STORED_COLUMNS_H

#include "core/result/response.h"
#include "server/util/bytes.h"

// psd.json: the frequency and behind it a density a channel. Cleared by columns_clear; empty on
// failure. STATUS_INTERNAL: it is not what was written.
Status stored_spectra(const char *text, Columns *columns, Problem *problem);

// impacts.json. impacts->at is to be freed; NULL on failure.
Status stored_impacts(const char *text, Impacts *impacts, Problem *problem);

// Which impacts: those whose contact meets [from, to], of them the first `limit` whose number in
// the ledger, counted from 1, is at least `first`.
typedef struct ImpactWindow {
    double from, to; // [s]
    size_t first, limit;
} ImpactWindow;

// Appends impacts.json with those impacts alone, to the letter as they were saved; the counts stay
// those of the whole ledger. With `is_numbered` every impact begins with its number and "matching"
// tells behind the list how many meet [from, to]. STATUS_INTERNAL: it is not what was written.
Status stored_impacts_window(const char *text, const ImpactWindow *window, bool is_numbered,
                             Bytes *bytes, Problem *problem);

#endif
