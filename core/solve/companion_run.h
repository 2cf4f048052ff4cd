// Error estimate of a run of the event engine: a second run that differs by a few roundings follows
// it, COMPANION_SAMPLES behind, until the two have parted. A run of a single mass has
// rounding_growth.h.
#ifndef CORE_SOLVE_COMPANION_RUN_H
#define CORE_SOLVE_COMPANION_RUN_H

#include "core/solve/engine.h"

enum { COMPANION_SAMPLES = FLIGHT_BUFFER_MAX };

// All zero is empty.
typedef struct CompanionRun {
    EventEngine engine;
    Run run;
    Response response;
    bool is_finished;      // parted or failed
    bool is_known;         // has not failed
    bool is_stepped;       // contacts have a tolerance, and this run a finer one
    double largest, worst; // displacement, and difference of displacements, so far [m]
    double horizon;        // [s]; NAN: not reached
    double *tracks;        // of both runs, where every sample is compared
} CompanionRun;

// Starts beside an engine that has settled. A failure only leaves the run without an estimate.
// Freed by companion_run_clear, also if it was never started.
void companion_run_start(CompanionRun *companion, EventEngine *engine);
void companion_run_clear(CompanionRun *companion);

// Follows the run to its present sample, at most COMPANION_SAMPLES; the steps count as the run's.
// False: it has failed just now, perhaps by the run's own limit.
bool companion_run_step(CompanionRun *companion, const ModalState *state);

// Error estimate and horizon, into the response.
void companion_run_report(const CompanionRun *companion, const ModalState *state,
                          Response *response);

#endif
