// What measurements and the revisions proposed from them share.
#ifndef SERVER_API_MEASUREMENTS_H
#define SERVER_API_MEASUREMENTS_H

#include "core/drop_test/evaluation.h"
#include "server/api/cpu_budget.h"
#include "server/db/materials.h"

// The head, or the newest revision if all are deprecated. STATUS_NOT_FOUND, and then it is empty.
Status material_latest(App *app, const char *slug, MaterialRevision *revision, Problem *problem);

// The separation rule of an evaluation: the query's, else the material's, else zero penetration.
Status measurement_separation(App *app, const Request *request, int *separation, Problem *problem);

// evaluation_run within the budget. STATUS_BUSY, STATUS_LIMIT.
Status measurements_evaluate(CpuBudget *budget, const Measurement *tests, size_t count,
                             int separation, Evaluation *evaluation, Reply *reply,
                             Problem *problem);

#endif
