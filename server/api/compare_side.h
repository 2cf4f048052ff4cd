// One side of a comparison: a result by its id or a job's, with its outcome, which may have to be
// computed anew. Not what is compared. Used by compare.c and compare_measured.c.
#ifndef SERVER_API_COMPARE_SIDE_H
#define SERVER_API_COMPARE_SIDE_H

#include "server/api/app.h"

// "r-..." as it is, "j-..." to its job's result. STATUS_NOT_FOUND, STATUS_CONFLICT of a job that
// has none. `name` is what to call it in a fault.
Status side_resolve(App *app, const char *name, const char *id, char result[72], Problem *problem);

enum { SIDES = 2 };

// Outcomes of `count` results, held; what an earlier call had is taken from request->kept. With
// *is_waiting the reply is made: the request sleeps. STATUS_GONE as intake_outcome, with the
// outcomes there are; the caller drops all in any case.
Status sides_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                      char results[][72], Outcome *outcomes[SIDES], bool *is_waiting,
                      Problem *problem);

void sides_drop(Outcome *outcomes[SIDES]);

#endif
