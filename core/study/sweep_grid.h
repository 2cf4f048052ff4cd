// The points of a sweep made ready: point i's scene is computed from i alone. Shared by threads,
// never changes. Not their judging (sweep_grid_validate.h) and not runs (sweep_run.h). Used by
// those and server/jobs.
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

typedef struct SweepGrid {
    const SweepStudy *study;
    const Simulation *simulation;
    size_t points, axis_count;
    SweepValues *axes;
} SweepGrid;

// Borrows both, which must be completed (the study: by rows at least). Adds the faults of axes
// below "/study/axes", all of them; `limits` NULL: as many points as there are. Freed by
// sweep_grid_free.
Status sweep_grid_new(const SweepStudy *study, const Simulation *simulation,
                      const SimulationLimits *limits, SweepGrid **plan, Problem *problem);
void sweep_grid_free(SweepGrid *plan);
// The same, but where only pointers are faulty the plan is made all the same, beside
// STATUS_INVALID: those axes then change nothing.
Status sweep_grid_make(const SweepStudy *study, const Simulation *simulation,
                       const SimulationLimits *limits, SweepGrid **plan, Problem *problem);

// Which of an axis's values a point has.
size_t sweep_grid_index(const SweepGrid *plan, size_t axis, size_t point);

// The completed scene of a point: as the sweep's own, with this point's values. `is_bare`: nothing
// sampled, as a row needs it. Cleared by simulation_clear in any case. Faults are the scene's.
Status sweep_grid_scene(const SweepGrid *plan, size_t point, bool is_bare,
                        const SimulationLimits *limits, Simulation *target, Problem *problem);

// How many of its points are as much work to make ready as `scenes` of one storey; at least 16, and
// all for SIZE_MAX.
size_t sweep_grid_affordable(const SweepGrid *plan, size_t scenes);

// Solver steps foretold for all, from some points spread over them.
double sweep_grid_steps(const SweepGrid *plan, const SimulationLimits *limits);

// Validates every point where they are no more work than `scenes` small ones, else about as many as
// that: points where one axis alone leaves its first value, of long axes some, and the last one.
// Each fault has the pointer of the value that causes it and the number of its point. `progress`,
// asked before each point, may stop it.
Status sweep_grid_check_points(const SweepGrid *plan, size_t scenes, const SimulationLimits *limits,
                               const Progress *progress, Problem *problem);

// Validates axes and points, these as sweep_grid_check_points does; `limits` NULL: the axes alone.
Status sweep_grid_validate(const SweepStudy *study, const Simulation *simulation, size_t scenes,
                           const SimulationLimits *limits, Problem *problem);

#endif
