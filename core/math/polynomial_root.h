// The first root at which a polynomial becomes negative. No earlier one is ever skipped.
#ifndef CORE_MATH_POLYNOMIAL_ROOT_H
#define CORE_MATH_POLYNOMIAL_ROOT_H

#include <stdbool.h>
#include <stddef.h>

enum { POLYNOMIAL_DEGREE_MAX = 31 };

// Searches c[0] + c[1] s + ... + c[degree] s^degree on 0 <= s <= 1. True if the polynomial becomes
// negative: *s is the first such place (0 if at once), to the rounding of the coefficients. A root
// at s = 0 from c[0] = 0 does not count. Touching zero from above within rounding counts as
// crossing.
bool polynomial_root_first(const double *c, size_t degree, double *s);

// The value of the polynomial and of its derivative at s.
static inline double polynomial_value(const double *c, size_t degree, double s) {
    double value = c[degree];
    for (size_t i = degree; i-- > 0;)
        value = value * s + c[i];
    return value;
}
static inline double polynomial_slope(const double *c, size_t degree, double s) {
    double slope = 0;
    for (size_t i = degree; i > 0; i--)
        slope = slope * s + (double)i * c[i];
    return slope;
}

#endif
