// Leaves modes out of a plan: modes above the number asked for, and modes that nothing sets in
// motion.
#ifndef CORE_PLAN_MODE_SELECTION_H
#define CORE_PLAN_MODE_SELECTION_H

#include "core/plan/plan.h"

// Selects the modes of a plan of plan_new, once; `modes` is the number asked for, 0: all. Adds its
// decisions and the predicted error to the plan. Does nothing where plan_is_single.
Status plan_keep(Plan *plan, const Scene *scene, size_t modes, Problem *problem);

#endif
