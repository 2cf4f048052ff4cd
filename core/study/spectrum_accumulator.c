// Means and deviations by Welford's recurrence, at each frequency for itself.
//
// A density is positive and its estimates are skewed, the more so the fewer segments a run has. The
// interval of its mean m is therefore taken of its logarithm, m exp(+-t s / (m sqrt(n))): of gamma
// distributed densities (1, 3 and 10 independent segments in each of 3 to 64 runs) such 95 %
// intervals held the true density in 93.0 to 95.1 %, m +- t s / sqrt(n) in 88.6 to 95.0 %, those of
// a chi-square with the freedom that m and s show in 81 to 95 %.
#include "core/study/spectrum_accumulator.h"

#include <stdlib.h>
#include <string.h>

#include "core/math/student_t.h"
#include "core/study/statistics.h"

static Status spectrum_accumulator_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's spectra");
}

static Status spectrum_accumulator_begin(SpectrumAccumulator *fold, const Spectrum *spectrum,
                                         bool keeps_first, Problem *problem) {
    const size_t values = spectrum->densities.count * spectrum->densities.rows;
    fold->channels = spectrum->densities.count;
    fold->rows = spectrum->densities.rows;
    fold->mean = calloc(values, sizeof *fold->mean);
    fold->squares = calloc(values, sizeof *fold->squares);
    if (keeps_first)
        fold->first = calloc(SPECTRUM_ACCUMULATOR_KEPT * values, sizeof *fold->first);
    return fold->mean == NULL || fold->squares == NULL || (keeps_first && fold->first == NULL)
               ? spectrum_accumulator_no_memory(problem)
               : STATUS_OK;
}

Status spectrum_accumulator_add(SpectrumAccumulator *fold, const Spectrum *spectrum,
                                bool keeps_first, Problem *problem) {
    if (spectrum->densities.count == 0)
        return STATUS_OK;
    if (fold->mean == NULL)
        TRY(spectrum_accumulator_begin(fold, spectrum, keeps_first, problem));
    const double n = (double)(fold->count + 1);
    for (size_t c = 0; c < fold->channels; c++) {
        const double *values = spectrum->densities.at[c].values;
        double *mean = fold->mean + c * fold->rows, *squares = fold->squares + c * fold->rows;
        for (size_t k = 0; k < fold->rows; k++) {
            const double off = values[k] - mean[k];
            mean[k] += off / n;
            squares[k] += off * (values[k] - mean[k]);
        }
        if (fold->first != NULL && fold->count < SPECTRUM_ACCUMULATOR_KEPT)
            memcpy(fold->first + (fold->count * fold->channels + c) * fold->rows, values,
                   fold->rows * sizeof *values);
    }
    fold->count++;
    return STATUS_OK;
}

// (sum of the eigenvalues)^2 / (sum of their squares) of the covariance that the kept runs show. It
// cannot be more than their number less one, and is told too small rather than too large.
static double spectrum_accumulator_freedom(const SpectrumAccumulator *fold, size_t channel) {
    const size_t kept =
        fold->count < SPECTRUM_ACCUMULATOR_KEPT ? fold->count : SPECTRUM_ACCUMULATOR_KEPT;
    const size_t stride = fold->channels * fold->rows;
    const double *at = fold->first + channel * fold->rows;
    double gram[SPECTRUM_ACCUMULATOR_KEPT][SPECTRUM_ACCUMULATOR_KEPT] = {{0}}, trace = 0,
           squares = 0;
    for (size_t k = 0; k < fold->rows; k++) {
        double off[SPECTRUM_ACCUMULATOR_KEPT], mean = 0;
        for (size_t i = 0; i < kept; i++)
            mean += at[i * stride + k] / (double)kept;
        for (size_t i = 0; i < kept; i++)
            off[i] = at[i * stride + k] - mean;
        for (size_t i = 0; i < kept; i++)
            for (size_t j = 0; j <= i; j++)
                gram[i][j] += off[i] * off[j];
    }
    for (size_t i = 0; i < kept; i++) {
        trace += gram[i][i];
        for (size_t j = 0; j <= i; j++)
            squares += (j < i ? 2 : 1) * gram[i][j] * gram[i][j];
    }
    return squares > 0 ? fmax(trace * trace / squares, 1) : 1;
}

static double spectrum_accumulator_norm(const double *values, size_t count) {
    double sum = 0;
    for (size_t k = 0; k < count; k++)
        sum += values[k] * values[k];
    return sqrt(sum);
}

Spread spectrum_accumulator_spread(const SpectrumAccumulator *fold, size_t all) {
    Spread worst = {.count = fold->count, .relative = INFINITY, .freedom = 1};
    double largest = -1;
    for (size_t c = 0; c < fold->channels && fold->count > 1; c++) {
        double squares = 0;
        for (size_t k = 0; k < fold->rows; k++)
            squares += fold->squares[c * fold->rows + k];
        const double relative = sqrt(squares / (double)(fold->count - 1)) /
                                spectrum_accumulator_norm(fold->mean + c * fold->rows, fold->rows);
        const Spread spread = {.count = fold->count,
                               .relative = relative > 0 ? relative : (double)INFINITY,
                               .freedom = spectrum_accumulator_freedom(fold, c)};
        const double error = stopping_rule_error(&spread, fold->count, all);
        if (error > largest) {
            largest = error;
            worst = spread;
        }
    }
    return worst;
}

static Status spectrum_accumulator_report_channel(const SpectrumAccumulator *fold, size_t channel,
                                                  const Column *like, EnsembleSpectrum *told,
                                                  Problem *problem) {
    const double *mean = fold->mean + channel * fold->rows;
    const double *squares = fold->squares + channel * fold->rows;
    const double n = (double)fold->count;
    told->channel = strdup(like->name);
    told->unit = strdup(like->unit);
    if (told->channel == NULL || told->unit == NULL || !reals_make(&told->mean, fold->rows))
        return spectrum_accumulator_no_memory(problem);
    memcpy(told->mean.at, mean, fold->rows * sizeof *mean);
    if (fold->count < 2)
        return STATUS_OK;
    if (!reals_make(&told->standard_deviation, fold->rows) || !reals_make(&told->low, fold->rows) ||
        !reals_make(&told->high, fold->rows))
        return spectrum_accumulator_no_memory(problem);
    const double t = student_quantile(ENSEMBLE_INTERVAL, fold->count - 1);
    for (size_t k = 0; k < fold->rows; k++) {
        const double deviation = sqrt(squares[k] / (n - 1));
        const double factor = mean[k] > 0 ? exp(t * deviation / (mean[k] * sqrt(n))) : 1;
        told->standard_deviation.at[k] = deviation;
        told->low.at[k] = mean[k] / factor;
        told->high.at[k] = mean[k] * factor;
        if (!isfinite(mean[k] + deviation + told->high.at[k]))
            return problem_set(problem, STATUS_UNSTABLE,
                               "the spectra are too large: their deviations leave what double "
                               "precision can hold");
    }
    return STATUS_OK;
}

Status spectrum_accumulator_report(const SpectrumAccumulator *fold, const Spectrum *like,
                                   Ensemble *answer, Problem *problem) {
    if (fold->count == 0)
        return STATUS_OK;
    EnsembleSpectra *spectra = &answer->spectra;
    spectra->at = calloc(fold->channels, sizeof *spectra->at);
    if (spectra->at == NULL || !reals_make(&answer->frequency, fold->rows))
        return spectrum_accumulator_no_memory(problem);
    memcpy(answer->frequency.at, like->frequency, fold->rows * sizeof *like->frequency);
    spectra->count = fold->channels;
    for (size_t c = 0; c < fold->channels; c++)
        TRY(spectrum_accumulator_report_channel(fold, c, &like->densities.at[c], &spectra->at[c],
                                                problem));
    return STATUS_OK;
}

void spectrum_accumulator_clear(SpectrumAccumulator *fold) {
    free(fold->mean);
    free(fold->squares);
    free(fold->first);
    *fold = (SpectrumAccumulator){0};
}
