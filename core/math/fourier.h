// Real Fourier transforms; FFTW lives here alone.
// Used by result/spectrum.c and excite/random.c.
#ifndef CORE_MATH_FOURIER_H
#define CORE_MATH_FOURIER_H

#include <stdbool.h>
#include <stddef.h>

// Makes planning safe from several threads. Once per program, before the first transform.
void fourier_start(void);

typedef struct Fourier Fourier;

// A plan for real sequences of `size` with its own aligned buffers: real[size], complex as
// re, im pairs [size / 2 + 1]. One thread at a time. NULL without memory.
Fourier *fourier_new(size_t size);
void fourier_free(Fourier *fourier);
double *fourier_real(Fourier *fourier);
double *fourier_complex(Fourier *fourier);
void fourier_forward(Fourier *fourier);   // real -> complex, unnormalised, exp(-i ...)
void fourier_backward(Fourier *fourier);  // complex -> real, unnormalised; destroys complex

#endif
