// The matrix exponential exp(A h) by precise integration: Zhong and Williams, Computers &
// Structures 56 (1995) 113-120. The increment exp(A h) - I is squared instead of the matrix, so
// that no digits are lost to the identity. Small systems in long double, computed once per plan.
#ifndef CORE_MATH_MATRIX_EXPONENTIAL_H
#define CORE_MATH_MATRIX_EXPONENTIAL_H

#include <stddef.h>

enum { MATRIX_EXPONENTIAL_MAX = 8 };

// transition[n * n] = exp(A h), row-major, for A[n * n], n <= MATRIX_EXPONENTIAL_MAX.
void matrix_exponential(const long double *A, size_t n, long double h, long double *transition);

// exp(A h) - I.
void matrix_exponential_increment(const long double *A, size_t n, long double h,
                                  long double *increment);

// For each pair (c, d) the integral over 0 <= t <= h of (c' exp(A t))' (d' exp(A t)): the quadratic
// form whose value at y is the integral of (c'y(t)) (d'y(t)) along y' = A y from y(0) = y.
// forms[count * n * n], each symmetric.
void matrix_exponential_forms(const long double *A, size_t n, long double h, size_t count,
                              const long double *const pairs[][2], long double *forms);

#endif
