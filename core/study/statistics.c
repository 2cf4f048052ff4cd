// All numbers of a statistic are in the table, so that means and deviations are of two passes: the
// second one corrects the first one's rounding. Quantiles are linear between order statistics, as
// NumPy's.
#include "core/study/statistics.h"

#include <stdlib.h>
#include <string.h>

#include "core/math/student_t.h"

static const char *const units[] = {"m", "m", "m/s^2", "m/s^2", "1", "N"};

EnsembleStatistic *ensemble_statistic(EnsembleStatistics *statistics, int metric) {
    EnsembleStatistic *const all[] = {
        &statistics->peak_displacement, &statistics->rms_displacement,
        &statistics->peak_acceleration, &statistics->rms_acceleration,
        &statistics->impacts,           &statistics->peak_contact_force,
    };
    return all[metric];
}

double statistics_value(const Summary *summary, int metric) {
    const double all[] = {
        summary->peak_displacement,
        summary->rms_displacement,
        summary->peak_acceleration,
        summary->rms_acceleration,
        summary->impacts == COUNT_ABSENT ? (double)NAN : (double)summary->impacts,
        summary->peak_contact_force,
    };
    return all[metric];
}

static bool statistics_is_known(const EnsembleRun *run, int metric) {
    return run->why == NULL && !isnan(statistics_value(&run->summary, metric));
}

// What is known of a statistic, in the order of the seeds.
typedef struct Values {
    double *at;
    size_t count;
    double mean, deviation; // NAN of too few
    double skewness;
} Values;

// In units of a power of two near the largest, so that no square or cube leaves what doubles hold.
static void statistics_measure(Values *values) {
    const double n = (double)values->count;
    double largest = 0, sum = 0, rest = 0, squares = 0, cubes = 0;
    int exponent;
    for (size_t i = 0; i < values->count; i++)
        largest = fmax(largest, fabs(values->at[i]));
    (void)frexp(largest, &exponent);
    for (size_t i = 0; i < values->count; i++)
        sum += ldexp(values->at[i], -exponent);
    for (size_t i = 0; i < values->count; i++)
        rest += ldexp(values->at[i], -exponent) - sum / n;
    const double mean = sum / n + rest / n;
    for (size_t i = 0; i < values->count; i++) {
        const double off = ldexp(values->at[i], -exponent) - mean;
        squares += off * off;
        cubes += off * off * off;
    }
    values->mean = ldexp(mean, exponent);
    if (values->count < 2)
        return;
    const double usual = sqrt(squares / n);
    values->deviation = ldexp(sqrt(squares / (n - 1)), exponent);
    values->skewness = usual > 0 ? cubes / n / (usual * usual * usual) : 0;
}

static Status statistics_collect(const EnsembleRuns *table, int metric, Values *values,
                                 Problem *problem) {
    *values = (Values){.at = calloc(table->count + 1, sizeof *values->at),
                       .mean = (double)NAN,
                       .deviation = (double)NAN};
    if (values->at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's statistics");
    for (size_t i = 0; i < table->count; i++)
        if (statistics_is_known(&table->at[i], metric))
            values->at[values->count++] = statistics_value(&table->at[i].summary, metric);
    if (values->count > 0)
        statistics_measure(values);
    return STATUS_OK;
}

static int statistics_compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void statistics_sort(double *values, size_t count) {
    qsort(values, count, sizeof *values, statistics_compare);
}

double statistics_quantile(const double *sorted, size_t count, double share) {
    const double place = share * (double)(count - 1);
    const size_t below = (size_t)place;
    const double from = sorted[below], to = below + 1 < count ? sorted[below + 1] : from;
    return from + (place - (double)below) * (to - from);
}

// The first run that has this number.
static uint64_t statistics_seed(const EnsembleRuns *table, int metric, double value) {
    for (size_t i = 0; i < table->count; i++)
        if (statistics_is_known(&table->at[i], metric) &&
            statistics_value(&table->at[i].summary, metric) == value)
            return table->at[i].seed;
    return COUNT_ABSENT;
}

static void statistics_fill(const EnsembleRuns *table, int metric, Values *values,
                            EnsembleStatistic *statistic) {
    statistic->count = values->count;
    if (values->count == 0)
        return;
    statistic->mean = values->mean;
    if (values->count > 1) {
        statistic->standard_deviation = values->deviation;
        statistic->standard_error = values->deviation / sqrt((double)values->count);
        const double half =
            student_quantile(ENSEMBLE_INTERVAL, values->count - 1) * statistic->standard_error;
        statistic->low = values->mean - half;
        statistic->high = values->mean + half;
    }
    statistics_sort(values->at, values->count);
    statistic->minimum = values->at[0];
    statistic->q05 = statistics_quantile(values->at, values->count, 0.05);
    statistic->q25 = statistics_quantile(values->at, values->count, 0.25);
    statistic->median = statistics_quantile(values->at, values->count, 0.5);
    statistic->q75 = statistics_quantile(values->at, values->count, 0.75);
    statistic->q95 = statistics_quantile(values->at, values->count, 0.95);
    statistic->maximum = values->at[values->count - 1];
    statistic->minimum_seed = statistics_seed(table, metric, statistic->minimum);
    statistic->maximum_seed = statistics_seed(table, metric, statistic->maximum);
}

Status statistics_fold(const EnsembleRuns *table, int metric, EnsembleStatistic *statistic,
                       Problem *problem) {
    Values values;
    TRY(statistics_collect(table, metric, &values, problem));
    statistics_fill(table, metric, &values, statistic);
    free(values.at);
    free(statistic->unit);
    statistic->unit = strdup(units[metric]);
    return statistic->unit != NULL
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's statistics");
}

Status statistics_spread(const EnsembleRuns *table, int metric, Spread *spread, Problem *problem) {
    Values values;
    TRY(statistics_collect(table, metric, &values, problem));
    // Where all are alike there may be rare ones that are not: nothing is known of them.
    const double relative = values.deviation / fabs(values.mean);
    *spread = (Spread){.count = values.count,
                       .relative = relative > 0 ? relative : (double)INFINITY,
                       .skewness = values.skewness,
                       .freedom = 1};
    free(values.at);
    return STATUS_OK;
}

void statistics_trust(const EnsembleRuns *table, EnsembleTrust *trust) {
    for (size_t i = 0; i < table->count; i++) {
        const Summary *summary = &table->at[i].summary;
        if (table->at[i].why != NULL)
            continue;
        if (isnan(summary->error_estimate))
            trust->unknown++;
        else if (isnan(summary->trust_horizon))
            trust->whole++;
        else
            trust->beyond++;
        // fmin and fmax pass over what is unknown.
        trust->shortest_horizon = fmin(trust->shortest_horizon, summary->trust_horizon);
        trust->largest_error_estimate =
            fmax(trust->largest_error_estimate, summary->error_estimate);
        trust->largest_energy_residual =
            fmax(trust->largest_energy_residual, summary->energy_residual);
    }
}

Status statistics_failures(const EnsembleRuns *table, const Status *statuses,
                           EnsembleFailures *failures, Problem *problem) {
    failures->at = calloc(STATUS_COUNT, sizeof *failures->at);
    if (failures->at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's failures");
    for (size_t i = 0; i < table->count; i++) {
        const EnsembleRun *run = &table->at[i];
        if (run->why == NULL)
            continue;
        size_t at = 0;
        while (at < failures->count &&
               strcmp(failures->at[at].reason, status_slug(statuses[i])) != 0)
            at++;
        EnsembleFailure *failure = &failures->at[at];
        if (at == failures->count) {
            failures->count++;
            failure->first_seed = run->seed;
            failure->reason = strdup(status_slug(statuses[i]));
            failure->detail = strdup(run->why);
            if (failure->reason == NULL || failure->detail == NULL)
                return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's failures");
        }
        failure->count++;
    }
    return STATUS_OK;
}
