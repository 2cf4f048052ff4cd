// What the general engine's parts take, in solver steps, as measured on frames of 1 to 200
// storeys. Not a count.
#ifndef CORE_SOLVE_STEP_WORK_H
#define CORE_SOLVE_STEP_WORK_H

#include <stdbool.h>
#include <stddef.h>

typedef enum StepWorkKind {
    STEP_WORK_FLIGHT, // a sample interval of flight
    STEP_WORK_HOLD,   // a long step of contact, taken or not
    STEP_WORK_ARC,
    STEP_WORK_EVENT,
    STEP_WORK_POWER, // a contact under a power law; foretold only
} StepWorkKind;

double step_work_steps(StepWorkKind kind, size_t storeys, size_t dampers, bool is_coupled);

#endif
