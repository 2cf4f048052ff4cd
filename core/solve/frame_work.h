// What the general engine's parts take, in solver steps, as measured on frames of 1 to 200 storeys.
// Not a count. Used by frame_engine.c, which counts by it, and simulation/cost.c, which foretells.
#ifndef CORE_SOLVE_FRAME_WORK_H
#define CORE_SOLVE_FRAME_WORK_H

#include <stdbool.h>
#include <stddef.h>

typedef enum FrameWorkKind {
    FRAME_WORK_FLIGHT, // a sample interval of flight
    FRAME_WORK_HOLD,   // a long step of contact, taken or not
    FRAME_WORK_ARC,
    FRAME_WORK_EVENT,
    FRAME_WORK_POWER, // a contact under a power law; foretold only
} FrameWorkKind;

double frame_work_steps(FrameWorkKind kind, size_t storeys, size_t dampers, bool is_coupled);

#endif
