// Impulses in place of contacts that take time: the same scene by the usual, cruder model. Not a
// judgement of what that makes wrong. Used by aim_way.c and study/.
#ifndef CORE_SIMULATION_IMPULSE_VARIANT_H
#define CORE_SIMULATION_IMPULSE_VARIANT_H

#include "core/simulation/simulation.h"

// A completed simulation becomes one to be completed again.
Status impulses_take(Simulation *simulation, Problem *problem);

#endif
