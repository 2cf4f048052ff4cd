// The matrix exponential and quadratic forms of a small linear system, for comparison.
#ifndef TESTS_SUPPORT_MATRIX_FORMS_H
#define TESTS_SUPPORT_MATRIX_FORMS_H

#include <stddef.h>

// transition[n * n] = exp(A h), row-major, n <= MATRIX_EXPONENTIAL_MAX.
void matrix_exponential(const long double *A, size_t n, long double h, long double *transition);

// For each pair (c, d) the integral over 0 <= t <= h of (c' exp(A t))' (d' exp(A t)): the quadratic
// form whose value at y is the integral of (c'y(t)) (d'y(t)) along y' = A y from y(0) = y.
// forms[count * n * n], each symmetric.
void matrix_exponential_forms(const long double *A, size_t n, long double h, size_t count,
                              const long double *const pairs[][2], long double *forms);

#endif
