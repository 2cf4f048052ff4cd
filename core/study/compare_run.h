// The runs of a comparison and what is made of each beside the reference's. Used by compare.c.
#ifndef CORE_STUDY_COMPARE_RUN_H
#define CORE_STUDY_COMPARE_RUN_H

#include "core/study/model_comparison.h"

extern const StudyMembers compare_members;

// What a variant is foretold to take in solver steps; 0 for one that is refused.
Status compare_foretell(const CompareStudy *study, const Simulation *simulation,
                        const CompareEntry *entry, const SimulationLimits *limits, double *steps,
                        Problem *problem);

#endif
