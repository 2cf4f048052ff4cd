// The general engine: any structure, any number of dampers, every contact state by its own motion.
// Not for one storey with one damper: exact.c does that faster and as exactly. Used by the exact
// solver.
#ifndef CORE_SOLVE_EVENT_ENGINE_H
#define CORE_SOLVE_EVENT_ENGINE_H

#include "core/solve/solver.h"

// As Solver.run.
Status event_engine_run(Run *run, Response *response, Problem *problem);

#endif
