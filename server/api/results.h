// Documents of a result, and what handlers of its parts share.
#ifndef SERVER_API_RESULTS_H
#define SERVER_API_RESULTS_H

#include "server/api/app.h"
#include "server/util/bytes.h"

// Append the documents of a result's row, as /v1/results/{id} and its manifest answer them.
Status result_put(const ResultRow *row, Bytes *bytes, Problem *problem);
Status manifest_put(App *app, const ResultRow *row, Bytes *bytes, Problem *problem);

// The entity tag of what may change with a material's status or the base of links, by its content
// (or by another that changes with it). True if the client has it.
bool results_tagged(const Request *request, Reply *reply, const ResultRow *row, const char *what,
                    const Bytes *content);

// The links of a 410: how to have the result made by this engine, and what it is.
void results_link_gone(const char *id, Reply *reply);

// Why a result has no ledger.
extern const char no_impacts[];

#endif
