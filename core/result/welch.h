// Power spectral densities by Welch's method, one-sided, per Hz, equal to scipy.signal.welch.
#ifndef CORE_RESULT_WELCH_H
#define CORE_RESULT_WELCH_H

#include "core/base/columns.h"
#include "core/base/progress.h"
#include "core/math/fft.h"

typedef enum WelchWindow { WELCH_HANN, WELCH_BOXCAR, WELCH_HAMMING, WELCH_BLACKMAN } WelchWindow;
typedef enum WelchDetrend {
    WELCH_DETREND_CONSTANT,
    WELCH_DETREND_LINEAR,
    WELCH_DETREND_NONE
} WelchDetrend;
extern const char *const welch_window_names[];  // scipy's: "hann", "boxcar", ...
extern const char *const welch_detrend_names[]; // "constant", "linear", "none" (scipy's False)

typedef struct WelchSettings {
    size_t segment; // samples, 1 ... count
    size_t overlap; // samples, < segment
    int window;     // WelchWindow, periodic ("fftbins") form
    int detrend;    // WelchDetrend, per segment
} WelchSettings;

typedef struct Spectrum {
    WelchSettings settings;
    size_t segments;   // number averaged
    double *frequency; // densities.rows values [Hz]
    Columns densities; // one column per input column, with its name
} Spectrum;

// The density of each column of `series`, sampled at `sample_rate` [Hz]; `units[i]` is its unit.
// `cache` may be NULL. `spectrum` is cleared by spectrum_clear and empty on failure.
Status welch_spectrum(const Columns *series, const char *const *units, double sample_rate,
                      const WelchSettings *settings, const Progress *progress, FftCache *cache,
                      Spectrum *spectrum, Problem *problem);
void spectrum_clear(Spectrum *spectrum);

#endif
