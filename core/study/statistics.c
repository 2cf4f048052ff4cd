// Means and deviations take two passes; the second corrects the rounding of the first.
#include "core/study/statistics.h"

#include <math.h>
#include <stdlib.h>

#include "core/math/student_t.h"

const char *const statistics_metric_names[] = {"peak_displacement",
                                               "rms_displacement",
                                               "peak_acceleration",
                                               "rms_acceleration",
                                               "impacts",
                                               "peak_contact_force",
                                               "psd",
                                               NULL};
static const char *const statistics_units[] = {"m", "m", "m/s^2", "m/s^2", "1", "N"};

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

static bool statistics_is_known(const RunRecord *run, int metric) {
    return run->why == NULL && !isnan(statistics_value(&run->summary, metric));
}

// Known values of a metric, in the order of the table.
typedef struct Values {
    double *at;
    size_t count;
    double mean, deviation; // NAN for too few values
    double skewness;
} Values;

// In units of a power of two near the largest, so that squares and cubes do not overflow.
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
    const double sigma = sqrt(squares / n);
    values->deviation = ldexp(sqrt(squares / (n - 1)), exponent);
    values->skewness = sigma > 0 ? cubes / n / (sigma * sigma * sigma) : 0;
}

static Status statistics_collect(const RunTable *table, int metric, Values *values,
                                 Problem *problem) {
    *values = (Values){.at = calloc(table->count + 1, sizeof *values->at),
                       .mean = (double)NAN,
                       .deviation = (double)NAN};
    if (values->at == NULL)
        return study_no_memory(problem);
    for (size_t i = 0; i < table->count; i++)
        if (statistics_is_known(&table->at[i], metric))
            values->at[values->count++] = statistics_value(&table->at[i].summary, metric);
    if (values->count > 0)
        statistics_measure(values);
    return STATUS_OK;
}

double statistics_quantile(const double *sorted, size_t count, double share) {
    const double place = share * (double)(count - 1);
    const size_t below = (size_t)place;
    const double from = sorted[below], to = below + 1 < count ? sorted[below + 1] : from;
    return from + (place - (double)below) * (to - from);
}

// Number of the first run with this value.
static uint64_t statistics_find_run(const RunTable *table, int metric, double value) {
    for (size_t i = 0; i < table->count; i++)
        if (statistics_is_known(&table->at[i], metric) &&
            statistics_value(&table->at[i].summary, metric) == value)
            return table->at[i].number;
    return COUNT_ABSENT;
}

Status statistics_fill(const RunTable *table, int metric, RunStatistic *statistic,
                       Problem *problem) {
    Values values;
    free(statistic->unit);
    statistic->metric = metric;
    TRY(study_copy_text(statistics_units[metric], &statistic->unit, problem));
    TRY(statistics_collect(table, metric, &values, problem));
    const size_t count = values.count;
    statistic->count = count;
    statistic->mean = values.mean;
    if (count > 1) {
        statistic->standard_deviation = values.deviation;
        statistic->standard_error = values.deviation / sqrt((double)count);
        const double half =
            student_t_quantile(STATISTICS_CONFIDENCE, count - 1) * statistic->standard_error;
        statistic->low = values.mean - half;
        statistic->high = values.mean + half;
    }
    if (count > 0) {
        reals_sort(values.at, count);
        statistic->minimum = values.at[0];
        statistic->q05 = statistics_quantile(values.at, count, 0.05);
        statistic->q25 = statistics_quantile(values.at, count, 0.25);
        statistic->median = statistics_quantile(values.at, count, 0.5);
        statistic->q75 = statistics_quantile(values.at, count, 0.75);
        statistic->q95 = statistics_quantile(values.at, count, 0.95);
        statistic->maximum = values.at[count - 1];
        statistic->minimum_seed = statistics_find_run(table, metric, statistic->minimum);
        statistic->maximum_seed = statistics_find_run(table, metric, statistic->maximum);
    }
    free(values.at);
    return STATUS_OK;
}

Status statistics_spread(const RunTable *table, int metric, RunSpread *spread, Problem *problem) {
    Values values;
    TRY(statistics_collect(table, metric, &values, problem));
    // Equal values say nothing about the spread: rare ones may differ.
    const double relative = values.deviation / fabs(values.mean);
    *spread = (RunSpread){.count = values.count,
                          .relative = relative > 0 ? relative : (double)INFINITY,
                          .skewness = values.skewness,
                          .freedom = 1};
    free(values.at);
    return STATUS_OK;
}

void statistics_trust(const RunTable *table, RunTrust *trust) {
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
        // fmin and fmax ignore NAN.
        trust->shortest_horizon = fmin(trust->shortest_horizon, summary->trust_horizon);
        trust->largest_error_estimate =
            fmax(trust->largest_error_estimate, summary->error_estimate);
        trust->largest_energy_residual =
            fmax(trust->largest_energy_residual, summary->energy_residual);
    }
}
