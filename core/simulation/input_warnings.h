// Values that are allowed but hardly meant: millimetres for metres, milliseconds for seconds,
// percent for a ratio. Not faults: each is a warning with its pointer. Used by request.c.
#ifndef CORE_SIMULATION_INPUT_WARNINGS_H
#define CORE_SIMULATION_INPUT_WARNINGS_H

#include "core/plan/plan.h"
#include "core/simulation/simulation.h"

// Adds a warning for each implausible value of a completed simulation. STATUS_OK or
// STATUS_NO_MEMORY.
Status plausible_warn(const Simulation *simulation, Warnings *warnings);

#endif
