// Integrals whose integrand may be singular at the ends, to rounding. Not for what oscillates.
// Used by contact/ for the duration of contacts.
#ifndef CORE_MATH_QUADRATURE_H
#define CORE_MATH_QUADRATURE_H

// The integral over 0 < u < 1 of f(context, u, 1 - u); both are told because near its end one of
// them is all cancellation. f must be finite inside and grow more slowly than 1 / sqrt(u) towards
// the ends.
double quadrature_unit(double (*f)(const void *context, double u, double rest),
                       const void *context);

#endif
