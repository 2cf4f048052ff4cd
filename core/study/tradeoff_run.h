// Runs a tradeoff study: errors and times of every point, and what follows of them. Used by
// tradeoff.c.
#ifndef CORE_STUDY_TRADEOFF_RUN_H
#define CORE_STUDY_TRADEOFF_RUN_H

#include "core/study/tradeoff.h"

// `study` and `simulation` are completed. Fills `answer`, also in part after a failure.
Status tradeoff_measure(const TradeoffStudy *study, const Simulation *simulation,
                        const StudyTools *tools, Tradeoff *answer, Problem *problem);

#endif
