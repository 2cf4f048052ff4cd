// accuracy.target: the cheapest way to run a scene that keeps an error asked for. Foretells the
// error of each way, runs the one it chooses, judges the run by its own estimate, and tightens what
// fell short. Not the solvers, whose settings it chooses, and no measurement against a reference:
// that is the study tradeoff. Used by run.c and request.c.
#ifndef CORE_SIMULATION_ACCURACY_TARGET_H
#define CORE_SIMULATION_ACCURACY_TARGET_H

#include "core/simulation/simulation.h"

// Whether a simulation has a target. The others are for those alone.
bool aim_is_asked(const Simulation *simulation);

// Judges what rows cannot say and completes the metric, of a completed scene.
Status aim_complete(Simulation *simulation, Problem *problem);

// simulation_plan, simulation_cost and simulation_run of a simulation with a target.
Status aim_plan(const Simulation *simulation, PlanReport *report, Problem *problem);
Cost aim_cost(const Simulation *simulation);
Status aim_run(const Simulation *simulation, const SimulationLimits *limits,
               const Progress *progress, Workspace *workspace, Outcome **outcome, Problem *problem);

// The simulation by the way that such a run came to, without a target, as it then was run: to run
// it once more. Cleared by simulation_clear in any case.
Status aim_settle(const Simulation *simulation, const SimulationLimits *limits,
                  const Progress *progress, Workspace *workspace, Simulation *settled,
                  Problem *problem);

#endif
