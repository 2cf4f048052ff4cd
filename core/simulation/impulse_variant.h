// The same scene with the impulse model in place of its contact law.
#ifndef CORE_SIMULATION_IMPULSE_VARIANT_H
#define CORE_SIMULATION_IMPULSE_VARIANT_H

#include "core/simulation/simulation.h"

// Changes a completed simulation into one that has to be completed again. Buffers that are given by
// stiffness and damping get the restitution derived from them.
Status impulse_variant_apply(Simulation *simulation, Problem *problem);

#endif
