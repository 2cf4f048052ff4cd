// A damper's two stops made ready: their contact parameters, into the plan and its report.
// Not the parameters themselves (contact/freeze.h). Used by plan.c and solve/.
#ifndef CORE_PLAN_CONTACT_SETUP_H
#define CORE_PLAN_CONTACT_SETUP_H

#include "core/plan/plan.h"

// Of the damper `index`, whose mass and effective mass the plan has already. Freed by stops_clear,
// also after a failure.
Status stops_make(const Scene *scene, Plan *plan, size_t index);
void stops_clear(Plan *plan);

// Whether a stop's parameters depend on the approach speed.
bool stops_vary(const PlanDamper *damper);

// Parameters of an impact that begins with this approach speed.
ContactParameters stops_freeze(const PlanStop *stop, double approach_speed);

#endif
