// One impact of a run seen from near: the contact's force, penetration and speed from its touch to
// its release, many times within it. The run itself keeps no such thing: the scene is run again for
// the state at a sample before the impact, and from there once more, finely. Not the ledger's
// numbers, which it meets. Used by api/force.c and tests.
#ifndef CORE_SIMULATION_IMPACT_HISTORY_H
#define CORE_SIMULATION_IMPACT_HISTORY_H

#include "core/simulation/simulation.h"

enum {
    CLOSEUP_POINTS = 401, // unless others are asked for
    CLOSEUP_POINTS_MIN = 5,
    CLOSEUP_POINTS_MAX = 100001,
};

typedef struct Closeup {
    Impact impact; // as the run's ledger has it
    // "time", of the scene; "contact_force", positive where the stop pushes; "penetration";
    // "approach_speed", positive into the stop. About as many rows as points were asked for, evenly
    // from touch to release, and one at the peak.
    Columns columns;
} Closeup;

// Of the impact `number`, from 1, of a completed simulation's ledger. STATUS_NOT_FOUND where there
// is none, or where contacts have no length. Stops when `progress` says so. `workspace` may be
// NULL.
Status closeup_make(const Simulation *simulation, size_t number, size_t points,
                    const SimulationLimits *limits, const Progress *progress, Workspace *workspace,
                    Closeup *closeup, Problem *problem);
void closeup_clear(Closeup *closeup);

// Solver steps that this may take, foretold.
double closeup_steps(const Simulation *simulation);

#endif
