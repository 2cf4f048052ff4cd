// One impact at full detail: force, penetration and speed of the contact from its start to its end.
#ifndef CORE_SIMULATION_IMPACT_HISTORY_H
#define CORE_SIMULATION_IMPACT_HISTORY_H

#include "core/simulation/simulation.h"

enum {
    IMPACT_HISTORY_POINTS = 401, // default
    IMPACT_HISTORY_POINTS_MIN = 5,
    IMPACT_HISTORY_POINTS_MAX = 100001,
};

typedef struct ImpactHistory {
    Impact impact; // as the run lists it
    // "time" of the scene [s]; "contact_force", positive where the stop pushes [N]; "penetration"
    // [m]; "approach_speed", positive into the stop [m/s]. About as many rows as points were
    // requested, equally spaced from start to end, and one at the peak.
    Columns columns;
} ImpactHistory;

// The history of impact `number`, from 1, of a completed simulation. STATUS_NOT_FOUND where there
// is no such impact or where contacts have no duration, STATUS_CANCELLED when `progress` asks to
// stop. `limits`, `progress` and `workspace` may be NULL. Cleared by impact_history_clear.
Status impact_history_make(const Simulation *simulation, size_t number, size_t points,
                           const SimulationLimits *limits, const Progress *progress,
                           Workspace *workspace, ImpactHistory *history, Problem *problem);
void impact_history_clear(ImpactHistory *history);

// Predicted solver steps of that call.
double impact_history_steps(const Simulation *simulation);

#endif
