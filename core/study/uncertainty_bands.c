#include "core/study/uncertainty_bands.h"

#include <stdlib.h>
#include <string.h>

#include "core/study/statistics.h"

enum { FREQUENCIES_PER_CHECK = 64 }; // between checks of the progress

Status uncertainty_bands_add(UncertaintyBands *bands, const Spectrum *spectrum, size_t max,
                             Problem *problem) {
    const size_t columns = spectrum->densities.count, rows = spectrum->densities.rows;
    if (columns == 0)
        return STATUS_OK;
    if (bands->at == NULL)
        *bands =
            (UncertaintyBands){columns, rows, 0, calloc(max * columns * rows, sizeof *bands->at)};
    if (bands->at == NULL)
        return study_no_memory(problem);
    double *target = bands->at + bands->runs++ * columns * rows;
    for (size_t c = 0; c < columns; c++)
        memcpy(target + c * rows, spectrum->densities.at[c].values, rows * sizeof *target);
    return STATUS_OK;
}

void uncertainty_bands_clear(UncertaintyBands *bands) {
    free(bands->at);
    *bands = (UncertaintyBands){0};
}

// `values` has room for all runs.
static Status uncertainty_bands_report_channel(const UncertaintyBands *bands, size_t channel,
                                               const double *own, const Progress *progress,
                                               double *values, RunSpectrum *spectrum,
                                               Problem *problem) {
    const size_t rows = bands->rows, runs = bands->runs;
    if (!reals_allocate(&spectrum->value, rows) || !reals_allocate(&spectrum->mean, rows) ||
        !reals_allocate(&spectrum->q05, rows) || !reals_allocate(&spectrum->median, rows) ||
        !reals_allocate(&spectrum->q95, rows))
        return study_no_memory(problem);
    memcpy(spectrum->value.at, own, rows * sizeof *values);
    for (size_t k = 0; k < rows; k++) {
        double sum = 0;
        if (k % FREQUENCIES_PER_CHECK == 0 && !progress_advance(progress, 1))
            return problem_set(problem, STATUS_CANCELLED, "the study was stopped");
        for (size_t i = 0; i < runs; i++) {
            values[i] = bands->at[(i * bands->channels + channel) * rows + k];
            sum += values[i] / (double)runs;
        }
        statistics_sort(values, runs);
        spectrum->mean.at[k] = sum;
        spectrum->q05.at[k] = statistics_quantile(values, runs, 0.05);
        spectrum->median.at[k] = statistics_quantile(values, runs, 0.5);
        spectrum->q95.at[k] = statistics_quantile(values, runs, 0.95);
    }
    return STATUS_OK;
}

Status uncertainty_bands_report(const UncertaintyBands *bands, const Spectrum *own,
                                const Progress *progress, Reals *frequency, RunSpectra *spectra,
                                Problem *problem) {
    if (bands->runs == 0)
        return STATUS_OK;
    double *values = calloc(bands->runs, sizeof *values);
    Status status = values == NULL ? study_no_memory(problem)
                                   : run_spectra_make(own, frequency, spectra, problem);
    for (size_t c = 0; c < bands->channels && status == STATUS_OK; c++)
        status = uncertainty_bands_report_channel(bands, c, own->densities.at[c].values, progress,
                                                  values, &spectra->at[c], problem);
    free(values);
    return status;
}
