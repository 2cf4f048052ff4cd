// Real Fourier transforms; FFTW lives here alone.
// Not a spectrum: no windows, no scaling.
// Used by result/spectrum.c and excite/random.c.
#ifndef CORE_MATH_FOURIER_H
#define CORE_MATH_FOURIER_H

#include <stddef.h>

// Makes planning safe from several threads. Once per program, before the first transform.
void fourier_start(void);

typedef struct Fourier Fourier;

typedef enum FourierDirection {
    FOURIER_FORWARD,  // real -> complex, exp(-i ...), unnormalised
    FOURIER_BACKWARD, // complex -> real, exp(+i ...), unnormalised; destroys complex
} FourierDirection;

// A plan for real sequences of `size` (1 ... 2^30) with its own aligned buffers: real[size],
// complex as re, im pairs [size / 2 + 1]. One thread at a time. NULL without memory.
Fourier *fourier_new(size_t size, FourierDirection direction);
void fourier_free(Fourier *fourier);
double *fourier_real(Fourier *fourier);
double *fourier_complex(Fourier *fourier);
void fourier_run(Fourier *fourier);

#endif
