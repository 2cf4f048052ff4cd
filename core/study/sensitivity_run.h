// The runs of a sensitivity study: the scene itself, steps to either side by each parameter, and
// those that are drawn. Used by sensitivity.c.
#ifndef CORE_STUDY_SENSITIVITY_RUN_H
#define CORE_STUDY_SENSITIVITY_RUN_H

#include "core/study/sensitivity.h"

// How many runs a completed study takes.
uint64_t sensitivity_runs(const SensitivityStudy *study, const Simulation *simulation);

extern const StudyMembers sensitivity_members;

#endif
