#include "core/study/tradeoff_budget.h"

#include <string.h>

#include "core/study/tradeoff_ladder.h"

SimulationLimits budget_point(const TradeoffStudy *study, const SimulationLimits *limits) {
    SimulationLimits own = limits != NULL ? *limits : (SimulationLimits){0};
    if (!(own.steps > 0) || own.steps > study->point_steps)
        own.steps = study->point_steps;
    return own;
}

// Steps of one solver cost as many as there are: making ready a large structure once for each
// solver is enough.
void budget_foretell(const Simulation *simulation, const TradeoffPoints *points, double *steps) {
    size_t first = 0; // of this solver's
    double cost = 0;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i], *other = &points->at[first];
        const bool is_alike = i > 0 && strcmp(point->solver, other->solver) == 0 &&
                              !isnan(point->step) == !isnan(other->step) &&
                              (!isnan(point->step) || !isnan(point->tolerance));
        if (!is_alike) {
            first = i;
            cost = ladder_cost(simulation, point);
        }
        steps[i] = is_alike && !isnan(point->step) ? cost * other->step / point->step : cost;
    }
}

double budget_timed(const TradeoffStudy *study, double steps) {
    return steps + (double)study->repeats * (steps > BUDGET_BATCH ? steps : BUDGET_BATCH + steps);
}
