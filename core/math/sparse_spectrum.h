// A long periodic signal of few low frequencies, y[i] = Re sum of c_k e^(2 pi i k n / length), of
// which any part can be computed. If the spectrum extends to high frequencies it is one transform
// of the whole length.
#ifndef CORE_MATH_SPARSE_SPECTRUM_H
#define CORE_MATH_SPARSE_SPECTRUM_H

#include "core/math/fft.h"

typedef struct SparseSpectrum SparseSpectrum;

// For a period of `length` samples, a power of two, and bins below `bins`, at most length / 2. NULL
// without memory.
SparseSpectrum *sparse_spectrum_new(size_t length, size_t bins, FftCache *cache);
// Returns its transform to the cache it came from.
void sparse_spectrum_free(SparseSpectrum *spectrum, FftCache *cache);

// c_k / 2 as pairs re, im: to be written for each k below `bins` before sparse_spectrum_run, which
// overwrites them.
double *sparse_spectrum_bins(SparseSpectrum *spectrum);
void sparse_spectrum_run(SparseSpectrum *spectrum);

// Samples `from` ... from + count - 1, to some 4e-15 of their rms. Both are multiples of
// SPARSE_SPECTRUM_BLOCK, or of the length if that is shorter.
enum { SPARSE_SPECTRUM_BLOCK = 1 << 10 };
void sparse_spectrum_samples(const SparseSpectrum *spectrum, size_t from, size_t count,
                             double *values);

#endif
