// The motion over cycles of a sine, of a scene.
#ifndef TESTS_SUPPORT_FLOWS_H
#define TESTS_SUPPORT_FLOWS_H

#include "core/simulation/simulation.h"
#include "core/solve/cycle_flow.h"
#include "tests/support/test.h"

// Completes and clears the simulation. The flow is freed by cycle_flow_free.
static inline CycleFlow *flow_of(Simulation *simulation) {
    static Problem problem;
    CycleFlow *flow = NULL;
    problem_clear(&problem);
    if (simulation_complete(simulation, NULL, NULL, &problem) != STATUS_OK ||
        simulation_cycle_flow(simulation, NULL, NULL, NULL, &flow, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.detail, problem.count > 0 ? problem.faults[0].pointer : "");
    simulation_clear(simulation);
    return flow;
}

#endif
