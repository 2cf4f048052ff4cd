// What one point of a sweep comes to, and all of them as members of the study. Not how they are
// shared out: server/jobs. Used by sweep.c, server/jobs and the benches.
#ifndef CORE_STUDY_SWEEP_RUN_H
#define CORE_STUDY_SWEEP_RUN_H

#include "core/study/sweep_grid.h"

// Runs a point and writes its metrics to `values`, one for each that the study asks for; NAN where
// it is unknown, and all of them where it failed. `fault` is left with why. STATUS_OK also then;
// STATUS_CANCELLED when the progress said so, STATUS_NO_MEMORY where nothing can be said of the
// point.
Status sweep_run_point(const SweepPlan *plan, size_t point, const SimulationLimits *limits,
                       const Progress *progress, Workspace *workspace, double *values,
                       SweepStatus *status, Problem *fault);

// Adds a point that failed to those that failed in the same way. STATUS_NO_MEMORY.
Status sweep_add_failure(SweepFailures *failures, SweepStatus status, uint64_t point,
                         const char *detail);

// What a point comes to, as a part of the study's members: freed with it.
typedef struct SweepPart {
    SweepStatus status;
    char *why; // NULL where it was made
    double values[];
} SweepPart;

extern const StudyMembers sweep_members;

#endif
