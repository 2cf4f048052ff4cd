// How far a run of the general engine can be trusted: the same run a few roundings away,
// NEIGHBOUR_SAMPLES behind it until the two have parted. Not the single engine's way, which is
// trust.h. Used by frame.c.
#ifndef CORE_SOLVE_COMPANION_RUN_H
#define CORE_SOLVE_COMPANION_RUN_H

#include "core/solve/frame_engine.h"

enum { NEIGHBOUR_SAMPLES = TRAIL_MAX };

// All zero is empty.
typedef struct FrameNeighbour {
    FrameEngine engine;
    Run run;
    Response response;
    bool is_spent;         // parted, or failed: nothing is left to follow
    bool is_known;         // never failed
    bool is_stepped;       // the run keeps a tolerance: this one keeps a finer one
    double largest, worst; // displacement, and difference of displacements, so far [m]
    double horizon;        // [s]; NAN: not reached
    double *apart;         // scratch, of all modes
    double *tracks;        // of both runs, where every sample is compared
} FrameNeighbour;

// Beside an engine that has settled. A failure only leaves the run without an estimate. Cleared by
// frame_neighbour_clear, also if it was never started.
void frame_neighbour_start(FrameNeighbour *neighbour, FrameEngine *engine);
void frame_neighbour_clear(FrameNeighbour *neighbour);

// Follows the run to the sample it has just reached, NEIGHBOUR_SAMPLES on or fewer; its steps are
// the run's. False: it has failed just now, perhaps because it was told to stop.
bool frame_neighbour_step(FrameNeighbour *neighbour, const Frame *frame);

// Error estimate and horizon, into the response.
void frame_neighbour_tell(const FrameNeighbour *neighbour, const Frame *frame, Response *response);

#endif
