// How sure each buffer's e and T_c are: as the study says for all, or buffer by buffer as their
// materials were measured. Not what is drawn (sensitivity_change.h). Used by the study's other
// parts.
#ifndef CORE_STUDY_INPUT_UNCERTAINTY_H
#define CORE_STUDY_INPUT_UNCERTAINTY_H

#include "core/study/sensitivity.h"

// Fills and judges it, of a completed simulation: what is not given is what the materials tell, and
// from then on stands in the study; where they tell nothing numbers are sure.
Status spread_complete(SensitivityStudy *study, const Simulation *simulation, Problem *problem);

// Whether anything is unsure.
bool spread_is_there(const SensitivityStudy *study);

// Relative standard deviation of a buffer's SENSITIVITY_RESTITUTION or SENSITIVITY_CONTACT_TIME;
// dampers from 0.
double spread_of(const SensitivityStudy *study, size_t damper, SensitivityBuffer buffer,
                 int parameter);

#endif
