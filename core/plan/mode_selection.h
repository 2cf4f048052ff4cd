// Leaves modes out of a plan: those beyond a number asked for, with the error that this is foretold
// to make, and those that nothing in the scene can set moving. Not the foretelling (truncation.h).
// Used by simulation/ and tests.
#ifndef CORE_PLAN_MODE_SELECTION_H
#define CORE_PLAN_MODE_SELECTION_H

#include "core/plan/plan.h"

// Once, of a plan of plan_new; `modes` is the number asked for, 0: all. Adds what it decides to the
// plan's report. Nothing where plan_is_single.
Status plan_keep(Plan *plan, const Scene *scene, size_t modes, Problem *problem);

#endif
