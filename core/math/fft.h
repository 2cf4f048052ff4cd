// Real Fourier transforms; FFTW lives here alone.
// Not a spectrum: no windows, no scaling.
// Used by result/spectrum.c, excite/random.c and the workspace.
#ifndef CORE_MATH_FFT_H
#define CORE_MATH_FFT_H

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

// Transforms kept for later: planning one costs as much as many runs of it. Of one thread at a
// time. All zero is empty.
enum { FOURIER_KEPT = 4 };
typedef struct FourierStock {
    Fourier *at[FOURIER_KEPT]; // the one put last is first
} FourierStock;

// Out of the stock, or new; to be handed back by fourier_put. Without a stock: as fourier_new and
// fourier_free.
Fourier *fourier_take(FourierStock *stock, size_t size, FourierDirection direction);
// Takes `fourier`; NULL is allowed. Large ones are not kept.
void fourier_put(FourierStock *stock, Fourier *fourier);
void fourier_stock_clear(FourierStock *stock);

#endif
