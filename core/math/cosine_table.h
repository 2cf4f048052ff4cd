// Many cosines and sines at equal steps, without a call of the C library for each.
// Not for single angles. Used by excite/random.c and result/spectrum.c.
#ifndef CORE_MATH_COSINE_TABLE_H
#define CORE_MATH_COSINE_TABLE_H

#include <stddef.h>

// cosines[i] = cos(start + i step), i = 0 ... count - 1, right to some 4e-16 for angles within a
// few turns [rad].
void circle_cosines(double start, double step, size_t count, double *cosines);

#endif
