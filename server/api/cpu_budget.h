// How long a request may work on drop tests: what is quick goes at once, of what takes longer only
// so many go at a time, and none of them for ever. It goes by the processor's time, so that a
// loaded machine answers the same. Not the work itself. Used by the handlers that evaluate.
#ifndef SERVER_API_CPU_BUDGET_H
#define SERVER_API_CPU_BUDGET_H

#include "server/api/app.h"

typedef struct CpuBudget {
    App *app;
    int64_t from_ns; // of this thread's processor time
    bool has_place;  // among those that take long
    bool is_crowded; // there was none
} CpuBudget;

void cpu_budget_begin(App *app, CpuBudget *budget);
// Of a Progress, whose context is the patience; on the thread that began. False: give up.
bool cpu_budget_lasts(void *budget, double fraction);
// Why it was given up: STATUS_BUSY while others take long or the daemon stops, else STATUS_LIMIT.
Status cpu_budget_report(const CpuBudget *budget, Problem *problem);
void cpu_budget_end(CpuBudget *budget);

#endif
