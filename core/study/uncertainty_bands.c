// Quantiles need all numbers of a frequency at once: the densities of every run are kept until
// then.
#include "core/study/uncertainty_bands.h"

#include <stdlib.h>
#include <string.h>

#include "core/study/statistics.h"

enum { LOOK = 64 }; // frequencies between looks at the progress

static Status uncertainty_bands_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's answer");
}

Status uncertainty_bands_add(UncertaintyDensities *kept, const Spectrum *spectrum, size_t most,
                             Problem *problem) {
    const size_t columns = spectrum->densities.count, rows = spectrum->densities.rows;
    if (columns == 0)
        return STATUS_OK;
    if (kept->at == NULL) {
        *kept = (UncertaintyDensities){columns, rows, 0, most,
                                       calloc(most * columns * rows, sizeof *kept->at)};
        if (kept->at == NULL)
            return uncertainty_bands_no_memory(problem);
    }
    double *target = kept->at + kept->runs++ * columns * rows;
    for (size_t c = 0; c < columns; c++)
        memcpy(target + c * rows, spectrum->densities.at[c].values, rows * sizeof *target);
    return STATUS_OK;
}

void uncertainty_bands_clear(UncertaintyDensities *kept) {
    free(kept->at);
    *kept = (UncertaintyDensities){0};
}

static Status uncertainty_bands_fill_statistics(const EnsembleRuns *table, const Summary *own,
                                                bool has_force, Sensitivity *answer,
                                                Problem *problem) {
    answer->statistics.at = calloc(ENSEMBLE_STATISTICS, sizeof *answer->statistics.at);
    if (answer->statistics.at == NULL)
        return uncertainty_bands_no_memory(problem);
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++) {
        EnsembleStatistic of = {.mean = (double)NAN,
                                .standard_deviation = (double)NAN,
                                .low = (double)NAN,
                                .high = (double)NAN,
                                .minimum = (double)NAN,
                                .q05 = (double)NAN,
                                .median = (double)NAN,
                                .q95 = (double)NAN,
                                .maximum = (double)NAN};
        TRY(statistics_fold(table, metric, &of, problem));
        SensitivityBand *band = &answer->statistics.at[answer->statistics.count++];
        *band = (SensitivityBand){
            metric,    of.unit, of.count,   (double)NAN, of.mean,   of.standard_deviation,
            of.low,    of.high, of.minimum, of.q05,      of.median, of.q95,
            of.maximum};
        if (metric != ENSEMBLE_PEAK_CONTACT_FORCE || has_force)
            band->value = statistics_value(own, metric);
    }
    return STATUS_OK;
}

// `values` has room for all runs.
static Status uncertainty_bands_fill_spectrum(const UncertaintyDensities *kept, size_t channel,
                                              const Column *own, const Progress *progress,
                                              double *values, SensitivitySpectrum *told,
                                              Problem *problem) {
    const size_t rows = kept->rows, runs = kept->runs;
    told->channel = strdup(own->name);
    told->unit = strdup(own->unit);
    if (told->channel == NULL || told->unit == NULL || !reals_make(&told->value, rows) ||
        !reals_make(&told->mean, rows) || !reals_make(&told->q05, rows) ||
        !reals_make(&told->median, rows) || !reals_make(&told->q95, rows))
        return uncertainty_bands_no_memory(problem);
    memcpy(told->value.at, own->values, rows * sizeof *values);
    for (size_t k = 0; k < rows; k++) {
        double sum = 0;
        if (k % LOOK == 0 && !progress_advance(progress, 1))
            return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
        for (size_t i = 0; i < runs; i++) {
            values[i] = kept->at[(i * kept->channels + channel) * rows + k];
            sum += values[i] / (double)runs;
        }
        statistics_sort(values, runs);
        told->mean.at[k] = sum;
        told->q05.at[k] = statistics_quantile(values, runs, 0.05);
        told->median.at[k] = statistics_quantile(values, runs, 0.5);
        told->q95.at[k] = statistics_quantile(values, runs, 0.95);
    }
    return STATUS_OK;
}

static Status uncertainty_bands_fill_spectra(const UncertaintyDensities *kept, const Spectrum *own,
                                             const Progress *progress, Sensitivity *answer,
                                             Problem *problem) {
    if (kept->runs == 0)
        return STATUS_OK;
    double *values = calloc(kept->runs, sizeof *values);
    answer->spectra.at = calloc(kept->channels, sizeof *answer->spectra.at);
    Status status =
        values == NULL || answer->spectra.at == NULL || !reals_make(&answer->frequency, kept->rows)
            ? uncertainty_bands_no_memory(problem)
            : STATUS_OK;
    if (status == STATUS_OK)
        memcpy(answer->frequency.at, own->frequency, kept->rows * sizeof *own->frequency);
    for (size_t c = 0; c < kept->channels && status == STATUS_OK; c++)
        status =
            uncertainty_bands_fill_spectrum(kept, c, &own->densities.at[c], progress, values,
                                            &answer->spectra.at[answer->spectra.count++], problem);
    free(values);
    return status;
}

Status uncertainty_bands_report(const EnsembleRuns *table, const Status *statuses,
                                const UncertaintyDensities *kept, const Outcome *own,
                                bool has_force, const Progress *progress, Sensitivity *answer,
                                Problem *problem) {
    TRY(uncertainty_bands_fill_statistics(table, &own->summary, has_force, answer, problem));
    TRY(statistics_failures(table, statuses, &answer->failures, problem));
    return uncertainty_bands_fill_spectra(kept, &own->spectrum, progress, answer, problem);
}
