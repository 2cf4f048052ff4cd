// With FFTW_ESTIMATE nothing is timed, and fftw_malloc always aligns equally: the chosen algorithm,
// and every bit of a transform, depends only on the size and the machine.
#include "core/math/fft.h"

#include <fftw3.h>
#include <math.h>
#include <stdlib.h>

enum { FFT_COSINES_BLOCK = 64 }; // angles of fft_cosines in a block
// FFTW aborts where an allocation of its planner fails, so the memory for it is reserved first and
// then returned to the allocator: bytes, and bytes for each sample.
enum { FFT_PLANNER_BYTES = 1 << 16, FFT_PLANNER_SAMPLE_BYTES = 64 };
enum { FFT_CACHE_SIZE_MAX = 1 << 17 };

struct Fft {
    size_t size;
    FftDirection direction;
    double *real;
    fftw_complex *complex;
    fftw_plan plan;
};

void fft_start(void) {
    fftw_make_planner_thread_safe();
}

Fft *fft_new(size_t size, FftDirection direction) {
    if (size == 0 || size > (size_t)1 << 30)
        return NULL;
    Fft *fft = calloc(1, sizeof *fft);
    if (fft == NULL)
        return NULL;
    fft->size = size;
    fft->direction = direction;
    fft->real = fftw_alloc_real(size);
    fft->complex = fftw_alloc_complex(size / 2 + 1);
    void *reserve = malloc(FFT_PLANNER_BYTES + FFT_PLANNER_SAMPLE_BYTES * size);
    free(reserve);
    if (reserve != NULL && fft->real != NULL && fft->complex != NULL)
        fft->plan = direction == FFT_FORWARD
                        ? fftw_plan_dft_r2c_1d((int)size, fft->real, fft->complex, FFTW_ESTIMATE)
                        : fftw_plan_dft_c2r_1d((int)size, fft->complex, fft->real, FFTW_ESTIMATE);
    if (fft->plan == NULL) {
        fft_free(fft);
        return NULL;
    }
    return fft;
}

void fft_free(Fft *fft) {
    if (fft == NULL)
        return;
    if (fft->plan != NULL)
        fftw_destroy_plan(fft->plan);
    fftw_free(fft->complex);
    fftw_free(fft->real);
    free(fft);
}

double *fft_real(Fft *fft) {
    return fft->real;
}

double *fft_complex(Fft *fft) {
    return &fft->complex[0][0];
}

void fft_run(Fft *fft) {
    fftw_execute(fft->plan);
}

Fft *fft_acquire(FftCache *cache, size_t size, FftDirection direction) {
    for (size_t i = 0; cache != NULL && i < FFT_CACHE_MAX; i++) {
        Fft *kept = cache->at[i];
        if (kept != NULL && kept->size == size && kept->direction == direction) {
            cache->at[i] = NULL;
            return kept;
        }
    }
    return fft_new(size, direction);
}

void fft_release(FftCache *cache, Fft *fft) {
    if (cache == NULL || fft == NULL || fft->size > FFT_CACHE_SIZE_MAX) {
        fft_free(fft);
        return;
    }
    // Insert at the front; the others move up to the first free place, else the last is freed.
    Fft *moved = fft;
    for (size_t i = 0; i < FFT_CACHE_MAX && moved != NULL; i++) {
        Fft *next = cache->at[i];
        cache->at[i] = moved;
        moved = next;
    }
    fft_free(moved);
}

void fft_cache_clear(FftCache *cache) {
    for (size_t i = 0; i < FFT_CACHE_MAX; i++) {
        fft_free(cache->at[i]);
        cache->at[i] = NULL;
    }
}

// cos(a + b) = cos a cos b - sin a sin b, where a is every FFT_COSINES_BLOCK-th angle and b the
// steps in between; each cosine and sine is computed once.
void fft_cosines(double start, double step, size_t count, double *cosines) {
    double near_cos[FFT_COSINES_BLOCK], near_sin[FFT_COSINES_BLOCK];
    const size_t near = count < FFT_COSINES_BLOCK ? count : FFT_COSINES_BLOCK;
    for (size_t i = 0; i < near; i++) {
        near_cos[i] = cos((double)i * step);
        near_sin[i] = sin((double)i * step);
    }
    for (size_t first = 0; first < count; first += FFT_COSINES_BLOCK) {
        const double angle = start + (double)first * step;
        const double far_cos = cos(angle), far_sin = sin(angle);
        const size_t rest = count - first < FFT_COSINES_BLOCK ? count - first : FFT_COSINES_BLOCK;
        for (size_t i = 0; i < rest; i++)
            cosines[first + i] = far_cos * near_cos[i] - far_sin * near_sin[i];
    }
}
