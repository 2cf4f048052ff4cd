// If all bins are below an eighth of the Nyquist bin of `coarse` samples, the samples in between
// are a short sum over their neighbours,
//
//   y[r + R q] = sum over p of kernel(p - r / R) g[q + p],    R = length / coarse,
//
// where g is the transform of c_k / K(k), and K(k) is the gain of the same sum for bin k. The error
// is the kernel's response to the images beyond coarse / 2, some 1e-16 (Barnett, Magland and af
// Klinteberg, "A parallel non-uniform fast Fourier transform library based on an exponential of
// semicircle kernel", SIAM J. Sci. Comput. 41 (2019), C479). It costs one short transform and TAPS
// products per sample instead of a long transform.
#include "core/math/sparse_spectrum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/fft.h"

#define PI 3.14159265358979323846264338328

enum {
    TAPS = 14,
    OVERSAMPLED = 8, // minimum number of coarse samples per bin
    RATIO_MIN = 8,   // below this R the long transform costs no more
    LANES = 8
};

// The kernel is e^(SHARP (sqrt(1 - (2 x / TAPS)^2) - 1)).
static const double SHARP = PI * TAPS * (1 - 1.0 / OVERSAMPLED);

struct SparseSpectrum {
    Fft *fourier;
    size_t ratio, coarse, bins;
    double *weights; // 1 / K
    double *kernel;  // [TAPS][ratio]
    double *samples; // coarse + TAPS values, from index -TAPS / 2 on
    double *block;
};

static double sparse_spectrum_kernel(double x) {
    const double t = 2 * x / TAPS, left = 1 - t * t;
    return left > 0 ? exp(SHARP * (sqrt(left) - 1)) : 0;
}

// Tap p of phase r multiplies coarse sample q + p - TAPS / 2 + 1.
static void sparse_spectrum_set_kernel(SparseSpectrum *spectrum) {
    for (size_t p = 0; p < TAPS; p++)
        for (size_t r = 0; r < spectrum->ratio; r++)
            spectrum->kernel[p * spectrum->ratio + r] = sparse_spectrum_kernel(
                (double)p - TAPS / 2 + 1 - (double)r / (double)spectrum->ratio);
}

// K(k) = sum over p of kernel(p) cos(2 pi k p / coarse), with cosines by recurrence.
static void sparse_spectrum_set_weights(SparseSpectrum *spectrum) {
    double at[TAPS / 2];
    for (size_t p = 0; p < TAPS / 2; p++)
        at[p] = sparse_spectrum_kernel((double)p);
    fft_cosines(0, 2 * PI / (double)spectrum->coarse, spectrum->bins, spectrum->weights);
    for (size_t k = 0; k < spectrum->bins; k++) {
        const double c = spectrum->weights[k];
        double before = 1, now = c, sum = at[0];
        for (size_t p = 1; p < TAPS / 2; p++) {
            sum += 2 * at[p] * now;
            const double next = 2 * c * now - before;
            before = now;
            now = next;
        }
        spectrum->weights[k] = 1 / sum;
    }
}

SparseSpectrum *sparse_spectrum_new(size_t length, size_t bins, FftCache *cache) {
    SparseSpectrum *spectrum = calloc(1, sizeof *spectrum);
    if (spectrum == NULL)
        return NULL;
    size_t coarse = length;
    while (coarse / 2 >= OVERSAMPLED * bins && length / coarse < SPARSE_SPECTRUM_BLOCK)
        coarse /= 2;
    if (length / coarse < RATIO_MIN)
        coarse = length;
    spectrum->coarse = coarse;
    spectrum->ratio = length / coarse;
    spectrum->bins = bins;
    spectrum->fourier = fft_acquire(cache, coarse, FFT_BACKWARD);
    if (spectrum->ratio > 1) {
        spectrum->block =
            malloc((bins + TAPS * spectrum->ratio + coarse + TAPS) * sizeof *spectrum->block);
        spectrum->weights = spectrum->block;
        spectrum->kernel = spectrum->weights + bins;
        spectrum->samples = spectrum->kernel + TAPS * spectrum->ratio;
    }
    if (spectrum->fourier == NULL || (spectrum->ratio > 1 && spectrum->block == NULL)) {
        sparse_spectrum_free(spectrum, cache);
        return NULL;
    }
    if (spectrum->ratio > 1) {
        sparse_spectrum_set_kernel(spectrum);
        sparse_spectrum_set_weights(spectrum);
    }
    return spectrum;
}

void sparse_spectrum_free(SparseSpectrum *spectrum, FftCache *cache) {
    if (spectrum == NULL)
        return;
    fft_release(cache, spectrum->fourier);
    free(spectrum->block);
    free(spectrum);
}

double *sparse_spectrum_bins(SparseSpectrum *spectrum) {
    return fft_complex(spectrum->fourier);
}

void sparse_spectrum_run(SparseSpectrum *spectrum) {
    double *bin = fft_complex(spectrum->fourier);
    const size_t coarse = spectrum->coarse;
    for (size_t k = 0; k < spectrum->bins && spectrum->ratio > 1; k++) {
        bin[2 * k] *= spectrum->weights[k];
        bin[2 * k + 1] *= spectrum->weights[k];
    }
    memset(bin + 2 * spectrum->bins, 0, (coarse / 2 + 1 - spectrum->bins) * 2 * sizeof *bin);
    fft_run(spectrum->fourier);
    if (spectrum->ratio == 1)
        return;
    const double *real = fft_real(spectrum->fourier);
    double *samples = spectrum->samples;
    memcpy(samples, real + coarse - (TAPS / 2 - 1), (TAPS / 2 - 1) * sizeof *samples);
    memcpy(samples + TAPS / 2 - 1, real, coarse * sizeof *samples);
    memcpy(samples + TAPS / 2 - 1 + coarse, real, (TAPS / 2 + 1) * sizeof *samples);
}

// A function for one width of vector, that is so many phases at once; each phase has the same bytes
// in all of them. Vectors wider than the processor's would go through memory.
#define INTERPOLATE(name, width, targets)                                                          \
    typedef double name##_vector __attribute__((vector_size(8 * (width)), aligned(8), may_alias)); \
    targets static void name(const SparseSpectrum *spectrum, size_t first, size_t count,           \
                             double *values) {                                                     \
        const size_t ratio = spectrum->ratio;                                                      \
        for (size_t r = 0; r < ratio; r += (width)) {                                              \
            name##_vector rows[TAPS];                                                              \
            for (size_t p = 0; p < TAPS; p++)                                                      \
                rows[p] = *(const name##_vector *)(spectrum->kernel + p * ratio + r);              \
            for (size_t q = 0; q < count; q++) {                                                   \
                const double *near = spectrum->samples + first + q;                                \
                name##_vector even = rows[0] * near[0], odd = rows[1] * near[1];                   \
                for (size_t p = 2; p < TAPS; p += 2) {                                             \
                    even += rows[p] * near[p];                                                     \
                    odd += rows[p + 1] * near[p + 1];                                              \
                }                                                                                  \
                *(name##_vector *)(values + q * ratio + r) = even + odd;                           \
            }                                                                                      \
        }                                                                                          \
    }

INTERPOLATE(sparse_spectrum_interpolate, 2, )
#ifdef __x86_64__
INTERPOLATE(sparse_spectrum_interpolate_avx2, 4, __attribute__((target("avx2"))))
INTERPOLATE(sparse_spectrum_interpolate_avx512, LANES, __attribute__((target("avx512f"))))
#endif

void sparse_spectrum_samples(const SparseSpectrum *spectrum, size_t from, size_t count,
                             double *values) {
    const size_t ratio = spectrum->ratio;
    if (ratio == 1) {
        memcpy(values, fft_real(spectrum->fourier) + from, count * sizeof *values);
        return;
    }
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f")) {
        sparse_spectrum_interpolate_avx512(spectrum, from / ratio, count / ratio, values);
        return;
    }
    if (__builtin_cpu_supports("avx2")) {
        sparse_spectrum_interpolate_avx2(spectrum, from / ratio, count / ratio, values);
        return;
    }
#endif
    sparse_spectrum_interpolate(spectrum, from / ratio, count / ratio, values);
}
