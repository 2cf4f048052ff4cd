// What a result is to be read with: warnings that only the run could give. Not those of a scene by
// itself (plausible.h). Used by run.c and by whoever
// tells what a run would be.
#ifndef CORE_SIMULATION_RESULT_WARNINGS_H
#define CORE_SIMULATION_RESULT_WARNINGS_H

#include "core/simulation/simulation.h"

// Adds to the outcome's warnings, of its finished response and summary, and of what was derived of
// the scene. STATUS_OK or STATUS_NO_MEMORY.
Status caution_warn(const Scene *scene, const DerivedList *derived, Outcome *outcome);

// Of that what no run is needed for: dampers whose masses are far from those of the tests that
// measured their materials.
Status caution_warn_of_pairs(const Scene *scene, const DerivedList *derived, Warnings *warnings);

#endif
