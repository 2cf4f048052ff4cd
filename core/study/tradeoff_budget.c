#include "core/study/tradeoff_budget.h"

#include <string.h>

#include "core/study/candidate_settings.h"

SimulationLimits budget_point(const TradeoffStudy *study, const SimulationLimits *limits) {
    SimulationLimits own = limits != NULL ? *limits : (SimulationLimits){0};
    if (!(own.steps > 0) || own.steps > study->point_steps)
        own.steps = study->point_steps;
    return own;
}

void budget_foretell(const Simulation *simulation, const TradeoffPoints *points, double *steps) {
    for (size_t i = 0; i < points->count; i++)
        steps[i] = ladder_cost(simulation, &points->at[i]);
}

size_t budget_trim(TradeoffPoints *points, double *steps, double most) {
    size_t count = 0;
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const bool is_finer = count > 0 && !isnan(point->step) && steps[i] > most &&
                              steps[count - 1] > most &&
                              strcmp(point->solver, points->at[count - 1].solver) == 0;
        if (is_finer) {
            fields_clear(tradeoff_point_fields, point);
            continue;
        }
        points->at[count] = *point;
        steps[count++] = steps[i];
    }
    return points->count = count;
}

double budget_timed(const TradeoffStudy *study, double steps) {
    return steps + (double)study->repeats * (steps > BUDGET_BATCH ? steps : BUDGET_BATCH + steps);
}
