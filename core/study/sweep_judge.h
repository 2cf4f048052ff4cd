// A sweep's points judged before any of them runs. Not how their scenes are made: sweep_plan.h.
// Used by sweep.c, sweep_run.c and server/jobs.
#ifndef CORE_STUDY_SWEEP_JUDGE_H
#define CORE_STUDY_SWEEP_JUDGE_H

#include "core/study/sweep_plan.h"

// Judges every point, or (`is_sample`) those where one axis alone leaves its first value, of long
// ranges some, and the last one. Each fault stands at the value it comes of and says which point it
// is of. `watch` may stop it.
Status sweep_check(const SweepPlan *plan, bool is_sample, const SimulationLimits *limits,
                   const Watch *watch, Problem *problem);

// Judges axes and points, all points where they are at most `at_once`, else the sample of them;
// `limits` NULL: the axes alone.
Status sweep_judge(const SweepStudy *study, const Simulation *simulation, size_t at_once,
                   const SimulationLimits *limits, Problem *problem);

#endif
