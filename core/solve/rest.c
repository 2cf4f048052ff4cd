#include "core/solve/rest.h"

#include <math.h>

enum { WATCH_SAMPLES = 1 << 16 }; // filled between two looks at the progress

static void fill(double *values, size_t count, double value) {
    for (size_t i = 0; i < count; i++)
        values[i] = value;
}

Status rest_run(Run *run, Response *response, Problem *problem) {
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
        const PlanDamper *damper = &plan->dampers[column->number];
        const double value =
            column->channel == CHANNEL_DAMPER_DISPLACEMENT ? damper->offset + damper->position : 0;
        for (size_t j = 0; j < plan->count; j += WATCH_SAMPLES) {
            const size_t left = plan->count - j;
            fill(column->values + j, left < WATCH_SAMPLES ? left : WATCH_SAMPLES, value);
            if (!progress_advance(run->progress, (double)i / (double)run->column_count))
                return problem_set(problem, STATUS_CANCELLED, "cancelled at rest");
        }
    }
    for (size_t d = 0; d < plan->damper_count; d++)
        peaks->damper_displacement = fmax(
            peaks->damper_displacement, fabs(plan->dampers[d].offset + plan->dampers[d].position));
    return STATUS_OK;
}
