// Welch power spectral densities, one-sided, per Hz, as scipy.signal.welch computes them.
// Not a response spectrum. Used by simulation/.
#ifndef CORE_RESULT_WELCH_H
#define CORE_RESULT_WELCH_H

#include "core/base/columns.h"
#include "core/base/progress.h"
#include "core/math/fft.h"

typedef enum SpectrumWindow {
    WINDOW_HANN,
    WINDOW_BOXCAR,
    WINDOW_HAMMING,
    WINDOW_BLACKMAN
} SpectrumWindow;
typedef enum SpectrumDetrend { DETREND_CONSTANT, DETREND_LINEAR, DETREND_NONE } SpectrumDetrend;
extern const char *const spectrum_window_names[];  // scipy's: "hann", "boxcar", ...
extern const char *const spectrum_detrend_names[]; // "constant", "linear", "none" (scipy's False)

typedef struct SpectrumSettings {
    size_t segment; // samples, 1 ... count
    size_t overlap; // samples, < segment
    int window;     // SpectrumWindow, periodic ("fftbins") form
    int detrend;    // SpectrumDetrend, per segment
} SpectrumSettings;

typedef struct Spectrum {
    SpectrumSettings settings;
    size_t segments;   // averaged
    double *frequency; // [Hz], densities.rows of them
    Columns densities; // one column per input column, same names, unit squared per Hz
} Spectrum;

// `series` holds the columns to transform, all of series->rows samples at `sample_rate` Hz.
// `units[i]` is the density's unit of column i; `stock` may be NULL. Cleared by spectrum_clear;
// empty on failure.
Status spectrum_welch(const Columns *series, const char *const *units, double sample_rate,
                      const SpectrumSettings *settings, const Progress *progress,
                      FourierStock *stock, Spectrum *spectrum, Problem *problem);
void spectrum_clear(Spectrum *spectrum);

#endif
