// One linear contact in closed form. Not for buffers whose motion is no oscillation, nor beside
// structures so soft that the closed form loses digits: those contacts go by Taylor polynomials.
#ifndef CORE_SOLVE_LINEAR_CONTACT_H
#define CORE_SOLVE_LINEAR_CONTACT_H

#include "core/solve/single_mass_state.h"

// Follows the present contact over at most `most` samples, records them and applies its release;
// returns over how many. The state may be left between two samples.
size_t linear_contact_run(SingleMass *single, size_t most);

#endif
