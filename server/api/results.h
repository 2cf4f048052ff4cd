// The documents saved with a result, for the handlers that offer them beside other formats.
// Used by results.c, ledgers.c and bundle.c.
#ifndef SERVER_API_RESULTS_H
#define SERVER_API_RESULTS_H

#include "server/api/app.h"

typedef enum Document { DOCUMENT_PSD, DOCUMENT_IMPACTS, DOCUMENT_ENERGY } Document;

// The JSON as it was saved, of the result in the request's first parameter; immutable.
Status results_document(App *app, const Request *request, Reply *reply, Document document,
                        Problem *problem);

// Why a result has no ledger.
extern const char no_impacts[];

#endif
