// How far a run of the general engine can be trusted: the same run a few roundings away,
// COMPANION_SAMPLES behind it until the two have parted. Not the single engine's way, which is
// rounding_growth.h.
#ifndef CORE_SOLVE_COMPANION_RUN_H
#define CORE_SOLVE_COMPANION_RUN_H

#include "core/solve/event_engine.h"

enum { COMPANION_SAMPLES = FLIGHT_BUFFER_MAX };

// All zero is empty.
typedef struct CompanionRun {
    EventEngine engine;
    Run run;
    Response response;
    bool is_finished;      // parted, or failed: nothing is left to follow
    bool is_known;         // never failed
    bool is_stepped;       // the run keeps a tolerance: this one keeps a finer one
    double largest, worst; // displacement, and difference of displacements, so far [m]
    double horizon;        // [s]; NAN: not reached
    double *tracks;        // of both runs, where every sample is compared
} CompanionRun;

// Beside an engine that has settled. A failure only leaves the run without an estimate. Cleared by
// companion_run_clear, also if it was never started.
void companion_run_start(CompanionRun *neighbour, EventEngine *engine);
void companion_run_clear(CompanionRun *neighbour);

// Follows the run to the sample it has just reached, COMPANION_SAMPLES on or fewer; its steps are
// the run's. False: it has failed just now, perhaps because it was told to stop.
bool companion_run_step(CompanionRun *neighbour, const ModalState *state);

// Error estimate and horizon, into the response.
void companion_run_tell(const CompanionRun *neighbour, const ModalState *state, Response *response);

#endif
