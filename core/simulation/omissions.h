// What a scene does not require and its run therefore leaves out, each told as a decision with what
// decided and the part of the foretold cost that it saves. Not the leaving out itself: that is
// run.c's and the solvers'. Used by run.c.
#ifndef CORE_SIMULATION_OMISSIONS_H
#define CORE_SIMULATION_OMISSIONS_H

#include "core/plan/reachability.h"
#include "core/simulation/simulation.h"
#include "core/solve/solver.h"

// Adds to the plan's decisions. `regime` NULL: the base is not made yet, and what hangs on it is
// told as open.
Status omissions_tell(const Simulation *simulation, const Solver *solver, const Plan *plan,
                      const Regime *regime, Decisions *decisions);

#endif
