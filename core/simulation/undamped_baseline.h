// What the dampers of a scene save: the same scene without them, run beside it. Not a study. Used
// by run.c and cost.c.
#ifndef CORE_SIMULATION_UNDAMPED_BASELINE_H
#define CORE_SIMULATION_UNDAMPED_BASELINE_H

#include "core/simulation/simulation.h"

// Runs a completed simulation without its dampers, and tells in the outcome, which is of the one
// with them, by how much it is the smaller. Adds the work.
Status bare_compare(const Simulation *simulation, const SimulationLimits *limits,
                    const Progress *progress, Workspace *workspace, Outcome *outcome,
                    Problem *problem);

// Foretold for that run alone.
Cost bare_cost(const Simulation *simulation);

#endif
