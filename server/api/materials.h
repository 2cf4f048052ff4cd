// What the handlers of materials share: entity tags and the conditions that writers bring. Not
// routes and not rows. Used by the files of api/ that show or write what a material is.
#ifndef SERVER_API_MATERIALS_H
#define SERVER_API_MATERIALS_H

#include "core/drop_test/evaluation.h"
#include "server/api/app.h"
#include "server/api/cpu_budget.h"
#include "server/db/materials.h"
#include "server/util/bytes.h"

enum { MATERIAL_TAG = 110 };

// "SLUG@REVISION-VERSION", without quotes. What is said of a revision may still change (a draft is
// approved): the version tells.
void material_tag(const char *slug, uint64_t revision, uint64_t version, char tag[MATERIAL_TAG]);

// The state that a writer has seen, as If-Match tells it: any tag of the material of its present
// version, or "*". *version is what the store is to find (ANY_VERSION: whatever it is); *state the
// material's present one. STATUS_NOT_FOUND, STATUS_UNCONDITIONAL where it is required and missing,
// STATUS_STALE.
Status material_condition(App *app, const Request *request, const char *slug, bool is_required,
                          uint64_t *version, MaterialState *state, Problem *problem);

// The number of a revision as a path has it. STATUS_NOT_FOUND.
Status material_revision_number(const char *text, uint64_t *revision, Problem *problem);

// The head, or of a material that has none (all are deprecated) the newest revision; lists are
// read. STATUS_NOT_FOUND, and then it is clear.
Status material_latest(App *app, const char *slug, MaterialRevision *revision, Problem *problem);

// The separation rule that drop tests are to be read by: the query's, else the material's, else
// zero penetration.
Status material_separation(App *app, const Request *request, int *separation, Problem *problem);

// evaluation_run while patience lasts. STATUS_BUSY, STATUS_LIMIT.
Status material_evaluate(CpuBudget *budget, const Measurement *tests, size_t count, int separation,
                         Evaluation *evaluation, Reply *reply, Problem *problem);

#endif
