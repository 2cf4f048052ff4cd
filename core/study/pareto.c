// Cost is the smallest CPU time: disturbances make a run longer, never shorter. Even so similar
// times change places from one measurement to the next: among those the closest point is best.
#include "core/study/pareto.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/study/study_run.h"

static const double similar = 1.25; // times as long is within the noise of a measurement

// A point's error; NAN if it was not measured.
static double pareto_error(const TradeoffPoint *point, int metric) {
    return point->status == TRADEOFF_MEASURED && !isnan(point->cpu_minimum)
               ? error_metrics_by(&point->errors, metric)
               : (double)NAN;
}

void pareto_mark(TradeoffPoints *points, int metric) {
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const double cpu = point->cpu_minimum, error = pareto_error(point, metric);
        point->is_best = !isnan(error);
        for (size_t j = 0; j < points->count && point->is_best; j++) {
            const double other = pareto_error(&points->at[j], metric);
            const double time = points->at[j].cpu_minimum;
            point->is_best = !(time <= cpu && other <= error && (time < cpu || other < error));
        }
    }
}

// The cheapest point that keeps the error, other than `without`; NULL: none.
static const TradeoffPoint *pareto_cheapest(const TradeoffPoints *points, int metric, double error,
                                            const TradeoffPoint *without) {
    const TradeoffPoint *found = NULL;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (point != without && pareto_error(point, metric) <= error &&
            (found == NULL || point->cpu_minimum < found->cpu_minimum))
            found = point;
    }
    return found;
}

// The closest point that takes at most `cpu`, starting from `found` (NULL: none).
static const TradeoffPoint *pareto_closest(const TradeoffPoints *points, int metric, double cpu,
                                           const TradeoffPoint *found) {
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        const double error = pareto_error(point, metric);
        if (!isnan(error) && point->cpu_minimum <= cpu &&
            (found == NULL || error < pareto_error(found, metric)))
            found = point;
    }
    return found;
}

Status pareto_recommend(const TradeoffPoints *points, int metric, double error,
                        TradeoffRecommendation *recommendation, Problem *problem) {
    const char *name = metric_names[metric], *unit = metric_units[metric];
    const TradeoffPoint *cheapest = pareto_cheapest(points, metric, error, NULL);
    char text[512];
    recommendation->point = COUNT_ABSENT;
    if (cheapest == NULL) {
        const TradeoffPoint *near = pareto_closest(points, metric, INFINITY, NULL);
        if (near == NULL)
            snprintf(text, sizeof text, "no point has an error of %s", name);
        else
            snprintf(text, sizeof text,
                     "no point keeps %s within %.3g%s; the closest, %s, is at %.2g%s", name, error,
                     unit, near->name, pareto_error(near, metric), unit);
    } else {
        const TradeoffPoint *best =
            pareto_closest(points, metric, similar * cheapest->cpu_minimum, cheapest);
        const TradeoffPoint *next = pareto_cheapest(points, metric, error, best);
        const double reached = pareto_error(best, metric), cpu = best->cpu_minimum;
        recommendation->point = (uint64_t)(best - points->at) + 1;
        if (best != cheapest)
            snprintf(text, sizeof text,
                     "%s keeps %s within %.3g%s, %.2g%s in %.3g s, and takes hardly longer than "
                     "the cheapest, %s, %.2g%s in %.3g s",
                     best->name, name, error, unit, reached, unit, cpu, cheapest->name,
                     pareto_error(cheapest, metric), unit, cheapest->cpu_minimum);
        else if (next == NULL)
            snprintf(text, sizeof text,
                     "%s is the only point that keeps %s within %.3g%s: %.2g%s in %.3g s",
                     best->name, name, error, unit, reached, unit, cpu);
        else
            snprintf(text, sizeof text,
                     "%s is the cheapest that keeps %s within %.3g%s: %.2g%s in %.3g s; the next, "
                     "%s, takes %.3g times as long",
                     best->name, name, error, unit, reached, unit, cpu, next->name,
                     next->cpu_minimum / cpu);
    }
    free(recommendation->why);
    return study_copy_text(text, &recommendation->why, problem);
}
