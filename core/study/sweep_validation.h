// A sweep's points judged before any of them runs. Not how their scenes are made: sweep_plan.h.
// Used by sweep.c, sweep_run.c and server/jobs.
#ifndef CORE_STUDY_SWEEP_VALIDATION_H
#define CORE_STUDY_SWEEP_VALIDATION_H

#include "core/study/sweep_grid.h"

// Judges every point where they are no more work than `scenes` small ones, else about as many as
// that: points where one axis alone leaves its first value, of long axes some, and the last one.
// Each fault stands at the value it comes of and says which point it is of. `progress`, asked
// before each point, may stop it.
Status sweep_check(const SweepPlan *plan, size_t scenes, const SimulationLimits *limits,
                   const Progress *progress, Problem *problem);

// Judges axes and points, these as sweep_check does; `limits` NULL: the axes alone.
Status sweep_judge(const SweepStudy *study, const Simulation *simulation, size_t scenes,
                   const SimulationLimits *limits, Problem *problem);

#endif
