// The runs of an ensemble, one for each seed, until all are made or the target is kept. Used by
// ensemble.c.
#ifndef CORE_STUDY_ENSEMBLE_RUN_H
#define CORE_STUDY_ENSEMBLE_RUN_H

#include "core/study/ensemble.h"

extern const StudyMembers ensemble_members;

#endif
