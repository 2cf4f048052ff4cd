// Which solver a simulation comes to, and what that one is asked for. Used by run.c and cost.c.
#ifndef CORE_SIMULATION_CHOICE_H
#define CORE_SIMULATION_CHOICE_H

#include "core/simulation/simulation.h"
#include "core/solve/solver.h"

const Solver *choice_solver(const Simulation *simulation);

// The rows that every solver has, "auto" too.
const Accuracy *choice_common(const Simulation *simulation);

// What the chosen solver is asked for; the settings of "auto" are not the chosen one's: NULL.
const Accuracy *choice_settings(const Simulation *simulation);

// Between the samples by which the base is known; 0: it is known in closed form [s].
double choice_base_interval(const Simulation *simulation);

#endif
