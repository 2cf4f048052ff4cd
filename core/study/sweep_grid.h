// The points of a sweep made ready: point i's scene is computed from i alone. Shared by threads,
// never changes. Not their judging (sweep_judge.h) and not runs (sweep_run.h). Used by those and
// server/jobs.
#ifndef CORE_STUDY_SWEEP_GRID_H
#define CORE_STUDY_SWEEP_GRID_H

#include "core/base/json_pointer.h"
#include "core/study/sweep.h"

// An axis's values, read.
typedef struct SweepValues {
    const char *pointer;
    size_t count, stride; // point p has value (p / stride) % count
    Scalar *at;
    char *texts; // of all its values
    const Field *field;
    bool is_tag;
} SweepValues;

typedef struct SweepPlan {
    const SweepStudy *study;
    const Simulation *simulation;
    size_t points, axis_count;
    SweepValues *axes;
} SweepPlan;

// Borrows both, which must be completed (the study: by rows at least). Adds the faults of axes
// below "/study/axes", all of them; `limits` NULL: as many points as there are. Freed by
// sweep_plan_free.
Status sweep_plan_new(const SweepStudy *study, const Simulation *simulation,
                      const SimulationLimits *limits, SweepPlan **plan, Problem *problem);
void sweep_plan_free(SweepPlan *plan);
// The same, but where only pointers are faulty the plan is made all the same, beside
// STATUS_INVALID: those axes then change nothing.
Status sweep_plan_make(const SweepStudy *study, const Simulation *simulation,
                       const SimulationLimits *limits, SweepPlan **plan, Problem *problem);

// Which of an axis's values a point has.
size_t sweep_plan_index(const SweepPlan *plan, size_t axis, size_t point);

// The completed scene of a point: as the sweep's own, with this point's values. `is_bare`: nothing
// sampled, as a row needs it. Cleared by simulation_clear in any case. Faults are the scene's.
Status sweep_scene(const SweepPlan *plan, size_t point, bool is_bare,
                   const SimulationLimits *limits, Simulation *target, Problem *problem);

// How many of its points are as much work to make ready as `scenes` of one storey; at least 16, and
// all for SIZE_MAX.
size_t sweep_affordable(const SweepPlan *plan, size_t scenes);

// Solver steps foretold for all, from some points spread over them.
double sweep_steps(const SweepPlan *plan, const SimulationLimits *limits);

#endif
