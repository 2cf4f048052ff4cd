// How long a request may work on drop tests: what is quick goes at once, of what takes longer only
// so many go at a time, and none of them for ever. It goes by the processor's time, so that a
// loaded machine answers the same. Not the work itself. Used by the handlers that evaluate.
#ifndef SERVER_API_CPU_BUDGET_H
#define SERVER_API_CPU_BUDGET_H

#include "server/api/app.h"

typedef struct Patience {
    App *app;
    int64_t from_ns; // of this thread's processor time
    bool has_place;  // among those that take long
    bool is_crowded; // there was none
} Patience;

void patience_begin(App *app, Patience *patience);
// Of a Progress, whose context is the patience; on the thread that began. False: give up.
bool patience_lasts(void *patience, double fraction);
// Why it was given up: STATUS_BUSY while others take long or the daemon stops, else STATUS_LIMIT.
Status patience_tell(const Patience *patience, Problem *problem);
void patience_end(Patience *patience);

#endif
