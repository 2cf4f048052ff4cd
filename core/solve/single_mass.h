// One storey with at most one free mass: the common scene, by kernels that propagate many samples
// at a time. Every event is located to rounding; what these kernels do not handle
// (rests, several events within the clock's resolution, steps that are too many) the event engine
// does, one sample interval at a time.
#ifndef CORE_SOLVE_SINGLE_MASS_H
#define CORE_SOLVE_SINGLE_MASS_H

#include "core/solve/solver.h"

// Whether the scene is one for single_mass_run; `is_clear`: no mass reaches a stop.
bool single_mass_serves(const Plan *plan, const Base *base, bool is_clear);

// As Solver.run. The workspace, if there is one, keeps the tables for the next run.
Status single_mass_run(Run *run, Response *response, Problem *problem);

#endif
