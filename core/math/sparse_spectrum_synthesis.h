// A long period of few low bins, y[i] = Re sum of c_k e^(2 pi i k n / length), any part of it at a
// time. Not for spectra that reach far up: there it is one transform of the whole length, and no
// better. Used by excite/random.c.
#ifndef CORE_MATH_SPARSE_SPECTRUM_SYNTHESIS_H
#define CORE_MATH_SPARSE_SPECTRUM_SYNTHESIS_H

#include "core/math/fft.h"

typedef struct Synthesis Synthesis;

// Of a period of `length` samples, a power of two, from bins below `bins`, at most length / 2.
// NULL without memory.
Synthesis *synthesis_new(size_t length, size_t bins, FourierStock *stock);
// Gives its transform back to the stock it is from.
void synthesis_free(Synthesis *synthesis, FourierStock *stock);

// c_k / 2 as pairs re, im, to be written for each k below `bins` before synthesis_run, which spoils
// them.
double *synthesis_bins(Synthesis *synthesis);
void synthesis_run(Synthesis *synthesis);

// Samples `from` to from + count - 1, right to some 4e-15 of their rms; both are multiples of
// SYNTHESIS_PART, or of the length where that is shorter.
enum { SYNTHESIS_PART = 1 << 10 };
void synthesis_read(const Synthesis *synthesis, size_t from, size_t count, double *values);

#endif
