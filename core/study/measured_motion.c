// A run is evaluated at the measured times by a cubic through four samples (Lagrange); where the
// times are those of its samples, which is usual, by the samples themselves. Its spectrum is that
// of these values, so that both spectra have the same window, leakage and aliasing.
//
// A spectrum of K averaged segments has a relative deviation of about sqrt(1.06 / K) for Hann's
// window and half overlap (Welch 1967). The noise of the measurement adds a constant density.
#include "core/study/measured_motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// clang-format off
const Field measured_channel_fields[] = {
    FIELD_TEXT(MeasuredChannel, channel, 40, PRESENCE_REQUIRED, 0, "channel that was measured, as in output.channels"),
    FIELD_REALS(MeasuredChannel, samples, NULL, WITHIN(-1e100, 1e100), MEASURED_SAMPLES, PRESENCE_REQUIRED, "measured values in the channel's unit"),
    FIELD_REAL(MeasuredChannel, interval, "s", ABOVE(0), REQUIRED, "between samples"),
    FIELD_REAL(MeasuredChannel, start, "s", AT_MIN(0), 0, "time of the first sample in the scene"),
    FIELD_REAL(MeasuredChannel, deviation, NULL, ABOVE(0), OPTIONAL, "standard deviation of the noise in the channel's unit; estimated if absent"),
    FIELD_END
};
// clang-format on

enum { SEGMENTS_MIN = 4 };

static const double snap = 1e-6;       // of a sample interval: a time this close is a sample's
static const double slope_step = 1e-2; // of a sample interval
static const double floor_share = 0.1; // of the measured densities lies below the noise's
static const double floor_min = 1e-12; // of the largest density
static const double variance_hann = 1.06;

double measured_rms(const MeasuredChannel *measured) {
    double sum = 0, squares = 0;
    for (size_t i = 0; i < measured->samples.count; i++)
        sum += measured->samples.at[i];
    const double mean = sum / (double)measured->samples.count;
    for (size_t i = 0; i < measured->samples.count; i++)
        squares += (measured->samples.at[i] - mean) * (measured->samples.at[i] - mean);
    return sqrt(squares / (double)measured->samples.count);
}

void measured_target_clear(MeasuredTarget *target) {
    free(target->values.at);
    *target = (MeasuredTarget){.measured = NULL};
}

// Densities of evenly spaced values, without that of frequency 0.
static Status measured_target_spectrum(const MeasuredTarget *target, const double *samples,
                                       FftCache *cache, double *densities, Problem *problem) {
    Columns columns = {0};
    Spectrum spectrum = {0};
    static const char *const units[] = {""};
    TRY(columns_allocate(&columns, 1, target->samples, 0, problem));
    columns_name(&columns, 0, "measured", "");
    memcpy(columns.at[0].values, samples, target->samples * sizeof *samples);
    const Status status = welch_spectrum(&columns, units, 1 / target->measured->interval,
                                         &target->welch, NULL, cache, &spectrum, problem);
    if (status == STATUS_OK)
        memcpy(densities, spectrum.densities.at[0].values + 1,
               target->values.count * sizeof *densities);
    spectrum_clear(&spectrum);
    columns_clear(&columns);
    return status;
}

static Status measured_target_make_spectrum(MeasuredTarget *target, const SpectrumRequest *psd,
                                            Problem *problem) {
    const MeasuredChannel *measured = target->measured;
    const size_t max = target->samples / SEGMENTS_MIN;
    WelchSettings *welch = &target->welch;
    *welch = (WelchSettings){
        .segment = psd->segment == COUNT_ABSENT ? max : (size_t)psd->segment,
        .window = psd->window != CHOICE_ABSENT ? psd->window : (int)WELCH_HANN,
        .detrend = psd->detrend != CHOICE_ABSENT ? psd->detrend : (int)WELCH_DETREND_CONSTANT};
    welch->segment = welch->segment < max ? welch->segment : max;
    welch->overlap = psd->overlap < welch->segment ? (size_t)psd->overlap : welch->segment / 2;
    TRY(status_made(reals_allocate(&target->values, welch->segment / 2)));
    double *values = target->values.at;
    TRY(measured_target_spectrum(target, &measured->samples.at[target->first], NULL, values,
                                 problem));
    Reals sorted = {NULL, 0};
    TRY(status_made(reals_allocate(&sorted, target->values.count)));
    memcpy(sorted.at, values, sorted.count * sizeof *values);
    reals_sort(sorted.at, sorted.count);
    const double largest = sorted.at[sorted.count - 1];
    target->floor = isnan(measured->deviation)
                        ? sorted.at[(size_t)(floor_share * (double)sorted.count)]
                        : 2 * measured->deviation * measured->deviation * measured->interval;
    target->floor = fmax(target->floor, floor_min * largest);
    free(sorted.at);
    for (size_t i = 0; i < target->values.count; i++)
        values[i] = log(fmax(values[i], target->floor));
    const size_t hop = welch->segment - welch->overlap;
    const double segments = (double)((target->samples - welch->overlap) / hop);
    target->deviation = sqrt(variance_hann / segments);
    return STATUS_OK;
}

Status measured_target_make(const MeasuredChannel *measured, double from, double to,
                            const SpectrumRequest *psd, MeasuredTarget *target, Problem *problem) {
    const double interval = measured->interval, last = (double)measured->samples.count - 1;
    const double low = fmax(ceil((from - measured->start) / interval - snap), 0);
    const double high = fmin(floor((to - measured->start) / interval + snap), last);
    *target = (MeasuredTarget){.measured = measured, .is_spectrum = psd != NULL};
    if (high < low)
        return STATUS_OK;
    target->first = (size_t)low;
    target->samples = (size_t)(high - low) + 1;
    if (psd != NULL)
        return measured_target_make_spectrum(target, psd, problem);
    target->deviation = measured->deviation;
    TRY(status_made(reals_allocate(&target->values, target->samples)));
    memcpy(target->values.at, &measured->samples.at[target->first],
           target->samples * sizeof(double));
    return STATUS_OK;
}

// The cubic through the four samples around a place, in sample intervals from the first.
static double measured_interpolate(const double *samples, size_t count, double place) {
    const double near = nearbyint(place);
    if (fabs(place - near) < snap || count < 4)
        return samples[(size_t)fmin(fmax(near, 0), (double)(count - 1))];
    const double first = fmin(fmax(floor(place) - 1, 0), (double)(count - 4));
    const double *y = &samples[(size_t)first], x = place - first;
    return -y[0] * (x - 1) * (x - 2) * (x - 3) / 6 + y[1] * x * (x - 2) * (x - 3) / 2 -
           y[2] * x * (x - 1) * (x - 3) / 2 + y[3] * x * (x - 1) * (x - 2) / 6;
}

Status measured_target_model(const MeasuredTarget *target, const Response *response, double shift,
                             FftCache *cache, double *values, double *slopes, Problem *problem) {
    const MeasuredChannel *measured = target->measured;
    const Column *column = columns_find(&response->series, measured->channel);
    const double rate = response->sample_rate;
    if (target->samples == 0)
        return STATUS_OK;
    if (column == NULL)
        return problem_set(problem, STATUS_INTERNAL, "the run lacks a channel");
    Reals motion = {NULL, 0};
    if (target->is_spectrum)
        TRY(status_made(reals_allocate(&motion, target->samples)));
    double *at = target->is_spectrum ? motion.at : values;
    for (size_t i = 0; i < target->samples; i++) {
        const double place = (measured_time(measured, target->first + i) + shift) * rate;
        at[i] = measured_interpolate(column->values, response->count, place);
        if (slopes == NULL || target->is_spectrum)
            continue;
        const double after =
            measured_interpolate(column->values, response->count, place + slope_step);
        const double before =
            measured_interpolate(column->values, response->count, place - slope_step);
        slopes[i] = (after - before) * rate / (2 * slope_step);
    }
    if (!target->is_spectrum)
        return STATUS_OK;
    const Status status = measured_target_spectrum(target, motion.at, cache, values, problem);
    free(motion.at);
    for (size_t i = 0; i < target->values.count; i++) {
        values[i] = log(values[i] + target->floor);
        if (slopes != NULL)
            slopes[i] = 0;
    }
    return status;
}
