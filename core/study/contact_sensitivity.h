// What errors of e, T_c and the masses do to each stop's k_b and c_b. Not to the response:
// sensitivity_run.h. Used by sensitivity_run.c.
#ifndef CORE_STUDY_CONTACT_SENSITIVITY_H
#define CORE_STUDY_CONTACT_SENSITIVITY_H

#include "core/study/sensitivity.h"

// An entry for each damper and side, of what a plan derived.
Status sensitivity_contact(const SensitivityStudy *study, const Simulation *simulation,
                           const DerivedList *derived, SensitivityStops *stops, Problem *problem);

#endif
