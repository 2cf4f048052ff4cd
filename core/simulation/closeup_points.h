// The rows of an impact seen from near, out of the fine run. Not that run (closeup.c), which uses
// it.
#ifndef CORE_SIMULATION_CLOSEUP_POINTS_H
#define CORE_SIMULATION_CLOSEUP_POINTS_H

#include "core/simulation/simulation.h"

// Channels of the fine run.
enum { FINE_FORCE, FINE_PENETRATION, FINE_VELOCITY, FINE_DAMPER_VELOCITY, FINE_COLUMNS };

// What is at hand for one impact.
typedef struct Shot {
    Simulation simulation; // as it was run, but for its output
    Outcome *outcome;      // all states, by sample
    const Impact *impact;
    Plan *plan;          // of the fine run
    Base base;           // of the whole
    Base shifted;        // from the fine run's start on; its values are the other's
    size_t sample;       // there
    double start;        // of the fine run [s]
    Columns fine;        // FINE_COLUMNS
    Response response;   // of the fine run
    const Impact *again; // the impact in that
} Shot;

// Cleared by columns_clear.
Status closeup_points(const Shot *shot, Columns *columns, Problem *problem);

#endif
