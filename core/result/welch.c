// Welch's method (1967), with the definitions of scipy.signal.welch. Of S segments of L samples,
// one beginning every L - overlap samples (an incomplete last one is dropped),
//
//   X_s[k] = sum over n of w[n] (x_s[n] - trend_s[n]) e^(-2 pi i k n / L)
//   P[k] = c_k / (f_s sum over n of w[n]^2) * mean over s of |X_s[k]|^2
//
// with c_k = 2, but 1 at k = 0 and, for even L, k = L / 2: those have no mirror.
#include "core/result/welch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"

#define PI 3.14159265358979323846264338328

enum { WATCH_SAMPLES = 1 << 16 }; // transformed between two checks of the progress

const char *const welch_window_names[] = {"hann", "boxcar", "hamming", "blackman", NULL};
const char *const welch_detrend_names[] = {"constant", "linear", "none", NULL};

// w[n] = a0 - a1 c + a2 (2 c^2 - 1), c = cos(2 pi n / L).
static const double window_terms[][3] = {
    [WELCH_HANN] = {0.5, 0.5, 0},
    [WELCH_BOXCAR] = {1, 0, 0},
    [WELCH_HAMMING] = {0.54, 0.46, 0},
    [WELCH_BLACKMAN] = {0.42, 0.5, 0.08},
};

// A sum with a second sum of its rounding errors (Neumaier 1974), for millions of terms.
typedef struct Sum {
    double value, rest;
} Sum;

static void welch_sum_add(Sum *sum, double term) {
    const double value = sum->value + term;
    sum->rest +=
        fabs(sum->value) >= fabs(term) ? (sum->value - value) + term : (term - value) + sum->value;
    sum->value = value;
}

static double welch_sum_total(const Sum *sum) {
    return sum->value + sum->rest;
}

static void welch_make_window(int window, double *w, size_t length) {
    const double *a = window_terms[window];
    fft_cosines(0, 2 * PI / (double)length, length, w);
    for (size_t n = 0; n < length; n++) {
        const double c = w[n];
        // Every window of one sample is 1.
        w[n] = length == 1 ? 1 : a[0] - a[1] * c + a[2] * (2 * c * c - 1);
    }
}

// Takes the mean or the least squares line off x[length].
static void welch_remove_trend(int detrend, double *x, size_t length) {
    if (detrend == WELCH_DETREND_NONE)
        return;
    Sum sum = {0};
    for (size_t n = 0; n < length; n++)
        welch_sum_add(&sum, x[n]);
    const double mean = welch_sum_total(&sum) / (double)length;
    for (size_t n = 0; n < length; n++)
        x[n] -= mean;
    if (detrend == WELCH_DETREND_CONSTANT || length == 1)
        return;
    // Over the centred index t, whose squares sum to L (L^2 - 1) / 12, the line's slope stands
    // alone.
    const double L = (double)length, middle = (L - 1) / 2;
    Sum moment = {0};
    for (size_t n = 0; n < length; n++)
        welch_sum_add(&moment, ((double)n - middle) * x[n]);
    const double slope = welch_sum_total(&moment) / (L * (L * L - 1) / 12);
    for (size_t n = 0; n < length; n++)
        x[n] -= slope * ((double)n - middle);
}

// Data shared by all columns.
typedef struct Welch {
    WelchSettings settings;
    size_t segments, bins;
    double scale; // 1 / (f_s sum w^2 S)
    double *window;
    Sum *power; // one per bin, summed over segments
    Fft *fourier;
} Welch;

static void welch_add_segment(Welch *welch, const double *x) {
    const size_t length = welch->settings.segment;
    double *real = fft_real(welch->fourier);
    const double *bin = fft_complex(welch->fourier);
    memcpy(real, x, length * sizeof *real);
    welch_remove_trend(welch->settings.detrend, real, length);
    for (size_t n = 0; n < length; n++)
        real[n] *= welch->window[n];
    fft_run(welch->fourier);
    for (size_t k = 0; k < welch->bins; k++)
        welch_sum_add(&welch->power[k], bin[2 * k] * bin[2 * k] + bin[2 * k + 1] * bin[2 * k + 1]);
}

static Status welch_run_columns(Welch *welch, const Columns *series, const Progress *progress,
                                Columns *densities, Problem *problem) {
    const size_t length = welch->settings.segment, step = length - welch->settings.overlap;
    size_t unwatched = WATCH_SAMPLES;
    for (size_t c = 0; c < series->count; c++) {
        memset(welch->power, 0, welch->bins * sizeof *welch->power);
        for (size_t s = 0; s < welch->segments; s++) {
            const double done = (double)c + (double)s / (double)welch->segments;
            if (unwatched >= WATCH_SAMPLES) {
                if (!progress_advance(progress, done / (double)series->count))
                    return problem_set(problem, STATUS_CANCELLED, "stopped at the spectra");
                unwatched = 0;
            }
            unwatched += length;
            welch_add_segment(welch, series->at[c].values + s * step);
        }
        double *density = densities->at[c].values;
        for (size_t k = 0; k < welch->bins; k++) {
            const bool has_mirror = k != 0 && 2 * k != length;
            density[k] = welch_sum_total(&welch->power[k]) * welch->scale * (has_mirror ? 2 : 1);
        }
    }
    return STATUS_OK;
}

static Status welch_check_settings(const Columns *series, const WelchSettings *settings,
                                   Problem *problem) {
    if (settings->segment < 1 || settings->segment > series->rows)
        return problem_set(problem, STATUS_INVALID,
                           "a segment of the spectra must have 1 to %zu samples, has %zu",
                           series->rows, settings->segment);
    if (settings->overlap >= settings->segment)
        return problem_set(problem, STATUS_INVALID,
                           "segments of %zu samples must overlap by less than that, not by %zu",
                           settings->segment, settings->overlap);
    if (settings->window < WELCH_HANN || settings->window > WELCH_BLACKMAN ||
        settings->detrend < WELCH_DETREND_CONSTANT || settings->detrend > WELCH_DETREND_NONE)
        return problem_set(problem, STATUS_INVALID, "no such window or detrending");
    return STATUS_OK;
}

static Status welch_make_spectrum(Welch *welch, const Columns *series, const char *const *units,
                                  double sample_rate, const Progress *progress, Spectrum *spectrum,
                                  Problem *problem) {
    const size_t length = welch->settings.segment;
    welch->bins = length / 2 + 1;
    welch->segments = (series->rows - welch->settings.overlap) / (length - welch->settings.overlap);
    welch->window = malloc(length * sizeof *welch->window);
    welch->power = malloc(welch->bins * sizeof *welch->power);
    spectrum->frequency = malloc(welch->bins * sizeof *spectrum->frequency);
    if (welch->window == NULL || welch->power == NULL || welch->fourier == NULL ||
        spectrum->frequency == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for spectra of %zu samples",
                           length);
    TRY(columns_allocate(&spectrum->densities, series->count, welch->bins, 0, problem));

    welch_make_window(welch->settings.window, welch->window, length);
    Sum squares = {0};
    for (size_t n = 0; n < length; n++)
        welch_sum_add(&squares, welch->window[n] * welch->window[n]);
    welch->scale = 1 / (sample_rate * welch_sum_total(&squares) * (double)welch->segments);
    for (size_t k = 0; k < welch->bins; k++)
        spectrum->frequency[k] = (double)k * sample_rate / (double)length;
    for (size_t c = 0; c < series->count; c++)
        columns_name(&spectrum->densities, c, series->at[c].name, units[c]);
    spectrum->settings = welch->settings;
    spectrum->segments = welch->segments;
    return welch_run_columns(welch, series, progress, &spectrum->densities, problem);
}

Status welch_spectrum(const Columns *series, const char *const *units, double sample_rate,
                      const WelchSettings *settings, const Progress *progress, FftCache *stock,
                      Spectrum *spectrum, Problem *problem) {
    *spectrum = (Spectrum){0};
    TRY(welch_check_settings(series, settings, problem));
    Welch welch = {.settings = *settings,
                   .fourier = fft_acquire(stock, settings->segment, FFT_FORWARD)};
    const Status status =
        welch_make_spectrum(&welch, series, units, sample_rate, progress, spectrum, problem);
    free(welch.window);
    free(welch.power);
    fft_release(stock, welch.fourier);
    if (status != STATUS_OK)
        spectrum_clear(spectrum);
    return status;
}

void spectrum_clear(Spectrum *spectrum) {
    if (spectrum == NULL)
        return;
    free(spectrum->frequency);
    columns_clear(&spectrum->densities);
    *spectrum = (Spectrum){0};
}
