// Cost is the smallest CPU time: what disturbs a run makes it longer, never shorter. Even so times
// that are nearly alike change places from one measurement to the next: among those the closest is
// taken.
#include "core/study/pareto.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double alike = 1.25; // times as long is no longer than the cheapest, measured again

static bool pareto_is_measured(const TradeoffPoint *point, int metric) {
    return point->status == TRADEOFF_MEASURED && !isnan(point->cpu_minimum) &&
           !isnan(errors_by(&point->errors, metric));
}

void pareto_mark(TradeoffPoints *points, int metric) {
    for (size_t i = 0; i < points->count; i++) {
        TradeoffPoint *point = &points->at[i];
        const double cpu = point->cpu_minimum, error = errors_by(&point->errors, metric);
        point->is_best = pareto_is_measured(point, metric);
        for (size_t j = 0; j < points->count && point->is_best; j++) {
            const TradeoffPoint *other = &points->at[j];
            if (!pareto_is_measured(other, metric))
                continue;
            const double own = errors_by(&other->errors, metric);
            if (other->cpu_minimum <= cpu && own <= error &&
                (other->cpu_minimum < cpu || own < error))
                point->is_best = false;
        }
    }
}

static Status pareto_explain(TradeoffRecommendation *choice, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static Status pareto_explain(TradeoffRecommendation *choice, const char *format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    free(choice->why);
    choice->why = strdup(text);
    return choice->why == NULL ? STATUS_NO_MEMORY : STATUS_OK;
}

// The cheapest that keeps the error, other than `without`; NULL: none.
static const TradeoffPoint *pareto_cheapest(const TradeoffPoints *points, int metric, double error,
                                            const TradeoffPoint *without) {
    const TradeoffPoint *found = NULL;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (point != without && pareto_is_measured(point, metric) &&
            errors_by(&point->errors, metric) <= error &&
            (found == NULL || point->cpu_minimum < found->cpu_minimum))
            found = point;
    }
    return found;
}

// The closest of those that take hardly longer than `cpu`.
static const TradeoffPoint *pareto_closest_of_similar(const TradeoffPoints *points, int metric,
                                                      double cpu, const TradeoffPoint *found) {
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (pareto_is_measured(point, metric) && point->cpu_minimum <= alike * cpu &&
            errors_by(&point->errors, metric) < errors_by(&found->errors, metric))
            found = point;
    }
    return found;
}

static const TradeoffPoint *pareto_closest(const TradeoffPoints *points, int metric) {
    const TradeoffPoint *found = NULL;
    for (size_t i = 0; i < points->count; i++) {
        const TradeoffPoint *point = &points->at[i];
        if (pareto_is_measured(point, metric) &&
            (found == NULL ||
             errors_by(&point->errors, metric) < errors_by(&found->errors, metric)))
            found = point;
    }
    return found;
}

Status pareto_recommend(const TradeoffPoints *points, int metric, double error,
                        TradeoffRecommendation *choice) {
    const char *name = metric_names[metric], *unit = metric_units[metric];
    const TradeoffPoint *taken = pareto_cheapest(points, metric, error, NULL);
    choice->point = COUNT_ABSENT;
    if (taken == NULL) {
        const TradeoffPoint *near = pareto_closest(points, metric);
        if (near == NULL)
            return pareto_explain(choice, "no point has an error of %s", name);
        return pareto_explain(
            choice, "no point keeps %s within %.3g%s; the closest, %s, is at %.2g%s", name, error,
            unit, near->name, errors_by(&near->errors, metric), unit);
    }
    const TradeoffPoint *first = taken;
    taken = pareto_closest_of_similar(points, metric, first->cpu_minimum, first);
    choice->point = (uint64_t)(taken - points->at) + 1;
    const double reached = errors_by(&taken->errors, metric);
    const double cpu = taken->cpu_minimum;
    if (taken != first)
        return pareto_explain(
            choice,
            "%s keeps %s within %.3g%s, %.2g%s in %.3g s, and takes hardly longer than the "
            "cheapest, %s, %.2g%s in %.3g s",
            taken->name, name, error, unit, reached, unit, cpu, first->name,
            errors_by(&first->errors, metric), unit, first->cpu_minimum);
    const TradeoffPoint *next = pareto_cheapest(points, metric, error, taken);
    if (next == NULL)
        return pareto_explain(choice,
                              "%s is the only point that keeps %s within %.3g%s: %.2g%s in %.3g s",
                              taken->name, name, error, unit, reached, unit, cpu);
    return pareto_explain(
        choice,
        "%s is the cheapest that keeps %s within %.3g%s: %.2g%s in %.3g s; the next, %s, "
        "takes %.3g times as long",
        taken->name, name, error, unit, reached, unit, cpu, next->name, next->cpu_minimum / cpu);
}
