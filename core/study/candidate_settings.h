// The ways that a tradeoff study tries: every solver of the table by its own step or tolerance, and
// what else may be traded for speed. Not the runs. Used by tradeoff.c.
#ifndef CORE_STUDY_CANDIDATE_SETTINGS_H
#define CORE_STUDY_CANDIDATE_SETTINGS_H

#include "core/study/tradeoff.h"

// The solver that the others are compared with: the first of the table that runs.
const Kind *candidate_settings_reference(void);

// The points of a completed study of a completed simulation, without numbers. Cleared by
// fields_clear; STATUS_NO_MEMORY leaves what there is.
Status candidate_settings_list(const TradeoffStudy *study, const Simulation *simulation,
                               TradeoffPoints *points, Problem *problem);

// The simulation as a point runs it, completed under `limits`. A point that cannot be is refused
// with its faults. Cleared by simulation_clear in any case.
Status candidate_settings_apply(const Simulation *simulation, const TradeoffPoint *point,
                                const SimulationLimits *limits, Simulation *target,
                                Problem *problem);

// What a point is foretold to take, in solver steps.
double candidate_settings_cost(const Simulation *simulation, const TradeoffPoint *point);

#endif
