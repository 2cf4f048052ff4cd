// Reads back the spectra and the impacts of a result from the documents saved with it, to the bit.
// Not a reader of what clients send: that is read.h. Used by api/ledgers.c
// and api/bundle.c.
#ifndef SERVER_CODEC_KEPT_H
#define SERVER_CODEC_KEPT_H

#include "core/result/response.h"

// psd.json: the frequency and behind it a density a channel. Cleared by columns_clear; empty on
// failure. STATUS_INTERNAL: it is not what was written.
Status kept_spectra(const char *text, Columns *columns, Problem *problem);

// impacts.json. impacts->at is to be freed; NULL on failure.
Status kept_impacts(const char *text, Impacts *impacts, Problem *problem);

#endif
