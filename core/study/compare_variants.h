// The contact models and separation rules that a comparison tries. Not the runs. Used by compare.c
// and compare_run.c.
#ifndef CORE_STUDY_COMPARE_VARIANTS_H
#define CORE_STUDY_COMPARE_VARIANTS_H

#include "core/study/model_comparison.h"

enum { COMPARE_VARIANTS = 24 };

// The entries of a completed study of a completed simulation, without numbers; the first is the
// scene's own. Cleared by fields_clear; STATUS_NO_MEMORY leaves what there is.
Status variants_make(const CompareStudy *study, const Simulation *simulation,
                     CompareEntries *entries, Problem *problem);

// The simulation under an entry's contact, with what is compared for its output; completed under
// `limits`. What cannot be is refused with its faults. Cleared by simulation_clear in any case.
Status variant_apply(const CompareStudy *study, const Simulation *simulation,
                     const CompareEntry *entry, const SimulationLimits *limits, Simulation *target,
                     Problem *problem);

#endif
