// Integrals over a unit interval, to rounding, also of integrands with singular ends.
#ifndef CORE_MATH_QUADRATURE_H
#define CORE_MATH_QUADRATURE_H

// The integral over 0 < u < 1 of f(context, u, 1 - u). Both are passed because the subtraction
// loses digits near an end. f must be finite inside, and grow more slowly than 1 / sqrt(u) towards
// an end. Not for oscillating integrands.
double quadrature_unit(double (*f)(const void *context, double u, double rest),
                       const void *context);

#endif
