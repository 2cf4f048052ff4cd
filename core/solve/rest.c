#include "core/solve/rest.h"

#include <math.h>
#include <string.h>

void rest_run(Run *run, Response *response) {
    const Plan *plan = run->plan;
    Peaks *peaks = &response->peaks;
    const size_t first = (size_t)ceil(run->statistics_from * plan->sample_rate * (1 - 1e-12));
    response->sample_rate = plan->sample_rate;
    response->count = plan->count;
    response->statistics_count = plan->count > first ? plan->count - first : 0;
    response->has_trust = true;
    response->trust_horizon = NAN;
    for (size_t i = 0; i < run->column_count; i++) {
        const RunColumn *column = &run->columns[i];
        memset(column->values, 0, plan->count * sizeof *column->values);
        const PlanDamper *damper = &plan->dampers[column->number];
        for (size_t j = 0; j < plan->count && column->channel == CHANNEL_DAMPER_DISPLACEMENT; j++)
            column->values[j] = damper->offset + damper->position;
    }
    for (size_t d = 0; d < plan->damper_count; d++)
        peaks->damper_displacement = fmax(
            peaks->damper_displacement, fabs(plan->dampers[d].offset + plan->dampers[d].position));
}
