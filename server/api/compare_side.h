// One side of a comparison: a result by its id or a job's, with its outcome, which may have to be
// computed anew. Not what is compared. Used by compare.c and compare_measured.c.
#ifndef SERVER_API_COMPARE_SIDE_H
#define SERVER_API_COMPARE_SIDE_H

#include "server/api/app.h"

// "r-..." as it is, "j-..." to its job's result. STATUS_NOT_FOUND, STATUS_CONFLICT of a job that
// has none. `name` is what to call it in a fault.
Status side_resolve(App *app, const char *name, const char *id, char result[72], Problem *problem);

enum { SIDES = 2 };

// What a request works with, and what it keeps while it sleeps, so that no cache can drop one
// outcome while it waits for the other. A body is gone by then: what was asked is kept too.
typedef struct Sides {
    Outcome *outcomes[SIDES]; // holds
    void *asked;              // the handler's own, freed by `release`
    void (*release)(void *asked);
} Sides;

// What an earlier call of the handler kept; taken once, at its beginning.
Sides sides_begin(const Request *request);
void sides_end(Sides *sides);

// Gets the outcomes of `count` results. With *is_waiting the reply is made: the request sleeps, and
// `sides` is empty. STATUS_GONE as jobs_outcome.
Status sides_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                      char results[][72], Sides *sides, bool *is_waiting, Problem *problem);

#endif
