// The first place where a polynomial stops being positive, found without ever stepping over one.
// Not a general root finder: what happens behind the first crossing is nobody's business here.
// Used by solve/ to locate events.
#ifndef CORE_MATH_POLYNOMIAL_ROOT_H
#define CORE_MATH_POLYNOMIAL_ROOT_H

#include <stdbool.h>
#include <stddef.h>

enum { ROOT_DEGREE = 31 };

// c[0] + c[1] s + ... + c[degree] s^degree on 0 <= s <= 1; a c[0] of exactly 0 is a root at the
// start that does not count. True if the polynomial becomes negative somewhere: *s is then where it
// first does (0 if at once), right to the rounding of the coefficients. Touching zero from above
// within rounding counts as crossing.
bool root_first_crossing(const double *c, size_t degree, double *s);

// The polynomial's value, and its derivative's, at s.
static inline double root_value(const double *c, size_t degree, double s) {
    double value = c[degree];
    for (size_t i = degree; i-- > 0;)
        value = value * s + c[i];
    return value;
}
static inline double root_slope(const double *c, size_t degree, double s) {
    double slope = 0;
    for (size_t i = degree; i > 0; i--)
        slope = slope * s + (double)i * c[i];
    return slope;
}

#endif
