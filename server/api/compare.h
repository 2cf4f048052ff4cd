// What both comparisons share: results by name with their outcomes, and warnings.
#ifndef SERVER_API_COMPARE_H
#define SERVER_API_COMPARE_H

#include "server/api/app.h"

#define COMPARE_PART 0.01 // of the largest displacement, by which motions have parted

enum { COMPARE_SIDES = 2 };

// What a request works with, and keeps while it waits, so that no cache can drop one outcome while
// the other one is computed. The body is gone by then: what was asked is kept too.
typedef struct CompareSides {
    Outcome *outcomes[COMPARE_SIDES]; // references
    void *asked;                      // the handler's own, freed by `release`
    void (*release)(void *asked);
} CompareSides;

// What an earlier call of the handler kept; to be called once, at its beginning.
CompareSides compare_begin(const Request *request);
void compare_end(CompareSides *sides);

// "r-..." as it is, "j-..." to its job's result. STATUS_NOT_FOUND, STATUS_CONFLICT for a job that
// has none. `name` is that of the parameter, for a fault.
Status compare_resolve(App *app, const char *name, const char *id, char result[72],
                       Problem *problem);

// Gets the outcomes of `count` results with their series. With *is_waiting the reply is made: the
// request waits, and `sides` is empty. STATUS_GONE as jobs_outcome.
Status compare_outcomes(App *app, const Request *request, Reply *reply, size_t count,
                        char results[][72], CompareSides *sides, bool *is_waiting,
                        Problem *problem);

// {"pointer": "", "detail": ...}, with a comma before it where one is needed.
void compare_put_warning(Bytes *bytes, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
