// Fourier transforms of real sequences by FFTW, unscaled, and tables of cosines.
#ifndef CORE_MATH_FFT_H
#define CORE_MATH_FFT_H

#include <stddef.h>

// Makes FFTW's planner thread-safe. Called once per program, before the first transform.
void fft_start(void);

typedef struct Fft Fft;

typedef enum FftDirection {
    FFT_FORWARD,  // real -> complex, exp(-i ...), unnormalised
    FFT_BACKWARD, // complex -> real, exp(+i ...), unnormalised; overwrites the complex buffer
} FftDirection;

// A plan for `size` (1 ... 2^30) real numbers with aligned buffers: real[size], and complex as
// pairs re, im [size / 2 + 1]. For one thread at a time. Freed by fft_free; NULL without memory.
Fft *fft_new(size_t size, FftDirection direction);
void fft_free(Fft *fft);
double *fft_real(Fft *fft);
double *fft_complex(Fft *fft);
void fft_run(Fft *fft);

// Plans kept for reuse, because planning costs as much as many transforms. For one thread at a
// time. All zero is empty.
enum { FFT_CACHE_MAX = 4 };
typedef struct FftCache {
    Fft *at[FFT_CACHE_MAX]; // the last released one first
} FftCache;

// A plan from the cache or a new one; returned with fft_release. Without a cache (NULL): fft_new.
Fft *fft_acquire(FftCache *cache, size_t size, FftDirection direction);
// Takes ownership of `fft` (may be NULL). Long transforms are freed, not kept.
void fft_release(FftCache *cache, Fft *fft);
void fft_cache_clear(FftCache *cache);

// cosines[i] = cos(start + i step), i = 0 ... count - 1 [rad], to some 4e-16 for angles within a
// few turns. Calls the C library twice per 64 values.
void fft_cosines(double start, double step, size_t count, double *cosines);

#endif
