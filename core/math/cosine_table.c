// cos(a + b) = cos a cos b - sin a sin b, with a of every CHUNK-th angle and b of the steps between
// them, each from the C library once.
#include "core/math/cosine_table.h"

#include <math.h>

enum { CHUNK = 64 };

void circle_cosines(double start, double step, size_t count, double *cosines) {
    double near_cos[CHUNK], near_sin[CHUNK];
    const size_t near = count < CHUNK ? count : CHUNK;
    for (size_t i = 0; i < near; i++) {
        near_cos[i] = cos((double)i * step);
        near_sin[i] = sin((double)i * step);
    }
    for (size_t first = 0; first < count; first += CHUNK) {
        const double angle = start + (double)first * step;
        const double far_cos = cos(angle), far_sin = sin(angle);
        const size_t rest = count - first < CHUNK ? count - first : CHUNK;
        for (size_t i = 0; i < rest; i++)
            cosines[first + i] = far_cos * near_cos[i] - far_sin * near_sin[i];
    }
}
