// The runs of an ensemble, seed by seed, until all are made or the target is kept. Used by
// ensemble.c.
#ifndef CORE_STUDY_ENSEMBLE_RUN_H
#define CORE_STUDY_ENSEMBLE_RUN_H

#include "core/study/ensemble.h"

Status ensemble_make(const EnsembleStudy *study, const Simulation *simulation,
                     const StudyTools *tools, Ensemble *answer, Problem *problem);

#endif
