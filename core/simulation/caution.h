// What a result is to be read with: warnings that only the run could give. Not those of a scene by
// itself (plausible.h). Used by run.c.
#ifndef CORE_SIMULATION_CAUTION_H
#define CORE_SIMULATION_CAUTION_H

#include "core/simulation/simulation.h"

// Adds to the outcome's warnings, of its finished response and summary. STATUS_OK or
// STATUS_NO_MEMORY.
Status caution_warn(const Scene *scene, Outcome *outcome);

#endif
