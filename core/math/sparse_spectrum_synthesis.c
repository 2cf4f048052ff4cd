// With all bins below an eighth of what `coarse` samples can show, the samples between those are a
// short sum over their neighbours,
//
//   y[r + R q] = sum over p of kernel(p - r / R) g[q + p],    R = length / coarse,
//
// where g is the transform of c_k / K(k), K being what the same sum makes of a bin: what is left is
// the kernel's leak of the images beyond coarse / 2, some 1e-16 (Barnett, Magland and af
// Klinteberg, "A parallel non-uniform fast Fourier transform library based on an exponential of
// semicircle kernel", SIAM J. Sci. Comput. 41 (2019), C479). One short transform and TAPS products
// a sample instead of a long transform.
#include "core/math/sparse_spectrum_synthesis.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/cosine_table.h"

#define PI 3.14159265358979323846264338328

enum {
    TAPS = 14,
    OVERSAMPLED = 8, // coarse samples for each bin, at least
    WORTH = 8,       // below this R the long transform is as good
    LANES = 8
};

// Of the kernel e^(SHARP (sqrt(1 - (2 x / TAPS)^2) - 1)).
static const double SHARP = PI * TAPS * (1 - 1.0 / OVERSAMPLED);

struct Synthesis {
    Fourier *fourier;
    size_t ratio, coarse, bins;
    double *weights; // 1 / K
    double *kernel;  // [TAPS][ratio]
    double *samples; // coarse of them and TAPS more, from -TAPS / 2 on
    double *block;
};

static double kernel(double x) {
    const double t = 2 * x / TAPS, left = 1 - t * t;
    return left > 0 ? exp(SHARP * (sqrt(left) - 1)) : 0;
}

// Tap p of phase r reaches to coarse sample q + p - TAPS / 2 + 1.
static void make_kernel(Synthesis *synthesis) {
    for (size_t p = 0; p < TAPS; p++)
        for (size_t r = 0; r < synthesis->ratio; r++)
            synthesis->kernel[p * synthesis->ratio + r] =
                kernel((double)p - TAPS / 2 + 1 - (double)r / (double)synthesis->ratio);
}

// K(k) = sum over p of kernel(p) cos(2 pi k p / coarse), the cosines by their recurrence.
static void make_weights(Synthesis *synthesis) {
    double at[TAPS / 2];
    for (size_t p = 0; p < TAPS / 2; p++)
        at[p] = kernel((double)p);
    circle_cosines(0, 2 * PI / (double)synthesis->coarse, synthesis->bins, synthesis->weights);
    for (size_t k = 0; k < synthesis->bins; k++) {
        const double c = synthesis->weights[k];
        double before = 1, now = c, sum = at[0];
        for (size_t p = 1; p < TAPS / 2; p++) {
            sum += 2 * at[p] * now;
            const double next = 2 * c * now - before;
            before = now;
            now = next;
        }
        synthesis->weights[k] = 1 / sum;
    }
}

Synthesis *synthesis_new(size_t length, size_t bins, FourierStock *stock) {
    Synthesis *synthesis = calloc(1, sizeof *synthesis);
    if (synthesis == NULL)
        return NULL;
    size_t coarse = length;
    while (coarse / 2 >= OVERSAMPLED * bins && length / coarse < SYNTHESIS_PART)
        coarse /= 2;
    if (length / coarse < WORTH)
        coarse = length;
    synthesis->coarse = coarse;
    synthesis->ratio = length / coarse;
    synthesis->bins = bins;
    synthesis->fourier = fourier_take(stock, coarse, FOURIER_BACKWARD);
    if (synthesis->ratio > 1) {
        synthesis->block =
            malloc((bins + TAPS * synthesis->ratio + coarse + TAPS) * sizeof *synthesis->block);
        synthesis->weights = synthesis->block;
        synthesis->kernel = synthesis->weights + bins;
        synthesis->samples = synthesis->kernel + TAPS * synthesis->ratio;
    }
    if (synthesis->fourier == NULL || (synthesis->ratio > 1 && synthesis->block == NULL)) {
        synthesis_free(synthesis, stock);
        return NULL;
    }
    if (synthesis->ratio > 1) {
        make_kernel(synthesis);
        make_weights(synthesis);
    }
    return synthesis;
}

void synthesis_free(Synthesis *synthesis, FourierStock *stock) {
    if (synthesis == NULL)
        return;
    fourier_put(stock, synthesis->fourier);
    free(synthesis->block);
    free(synthesis);
}

double *synthesis_bins(Synthesis *synthesis) {
    return fourier_complex(synthesis->fourier);
}

void synthesis_run(Synthesis *synthesis) {
    double *bin = fourier_complex(synthesis->fourier);
    const size_t coarse = synthesis->coarse;
    for (size_t k = 0; k < synthesis->bins && synthesis->ratio > 1; k++) {
        bin[2 * k] *= synthesis->weights[k];
        bin[2 * k + 1] *= synthesis->weights[k];
    }
    memset(bin + 2 * synthesis->bins, 0, (coarse / 2 + 1 - synthesis->bins) * 2 * sizeof *bin);
    fourier_run(synthesis->fourier);
    if (synthesis->ratio == 1)
        return;
    const double *real = fourier_real(synthesis->fourier);
    double *samples = synthesis->samples;
    memcpy(samples, real + coarse - (TAPS / 2 - 1), (TAPS / 2 - 1) * sizeof *samples);
    memcpy(samples + TAPS / 2 - 1, real, coarse * sizeof *samples);
    memcpy(samples + TAPS / 2 - 1 + coarse, real, (TAPS / 2 + 1) * sizeof *samples);
}

// Eight phases at once; the bytes are the same with all vectors.
typedef double Eight __attribute__((vector_size(8 * LANES), aligned(8), may_alias));

static inline __attribute__((always_inline)) void spread(const Synthesis *synthesis, size_t first,
                                                         size_t count, double *values) {
    const size_t ratio = synthesis->ratio;
    for (size_t r = 0; r < ratio; r += LANES) {
        Eight rows[TAPS]; // in registers, where there are as many
        for (size_t p = 0; p < TAPS; p++)
            rows[p] = *(const Eight *)(synthesis->kernel + p * ratio + r);
        for (size_t q = 0; q < count; q++) {
            const double *near = synthesis->samples + first + q;
            Eight even = rows[0] * near[0], odd = rows[1] * near[1];
            for (size_t p = 2; p < TAPS; p += 2) {
                even += rows[p] * near[p];
                odd += rows[p + 1] * near[p + 1];
            }
            *(Eight *)(values + q * ratio + r) = even + odd;
        }
    }
}

#ifdef __x86_64__
static __attribute__((target("avx512f"))) void
spread_avx512(const Synthesis *synthesis, size_t first, size_t count, double *values) {
    spread(synthesis, first, count, values);
}

static __attribute__((target("avx2"))) void spread_avx2(const Synthesis *synthesis, size_t first,
                                                        size_t count, double *values) {
    spread(synthesis, first, count, values);
}
#endif

static void spread_plain(const Synthesis *synthesis, size_t first, size_t count, double *values) {
    spread(synthesis, first, count, values);
}

void synthesis_read(const Synthesis *synthesis, size_t from, size_t count, double *values) {
    const size_t ratio = synthesis->ratio;
    if (ratio == 1) {
        memcpy(values, fourier_real(synthesis->fourier) + from, count * sizeof *values);
        return;
    }
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f")) {
        spread_avx512(synthesis, from / ratio, count / ratio, values);
        return;
    }
    if (__builtin_cpu_supports("avx2")) {
        spread_avx2(synthesis, from / ratio, count / ratio, values);
        return;
    }
#endif
    spread_plain(synthesis, from / ratio, count / ratio, values);
}
