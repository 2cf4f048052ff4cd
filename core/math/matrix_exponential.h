// The matrix exponential exp(A h) by precise integration: Zhong and Williams, Computers &
// Structures 56 (1995) 113-120. The increment exp(A h) - I is squared instead of the matrix, so
// that no digits are lost to the identity. Small systems in long double, computed once per plan.
#ifndef CORE_MATH_MATRIX_EXPONENTIAL_H
#define CORE_MATH_MATRIX_EXPONENTIAL_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/progress.h"

enum { MATRIX_EXPONENTIAL_MAX = 8 };

// transition[n * n] = exp(A h), row-major, for A[n * n], n <= MATRIX_EXPONENTIAL_MAX.
void matrix_exponential(const long double *A, size_t n, long double h, long double *transition);

// exp(A h) - I, and the same for twice the time, in place; for the sequence h, 2 h, 4 h ...
void matrix_exponential_increment(const long double *A, size_t n, long double h,
                                  long double *increment);
void matrix_exponential_double(size_t n, long double *increment);

// For each pair (c, d) the integral over 0 <= t <= h of (c' exp(A t))' (d' exp(A t)): the quadratic
// form whose value at y is the integral of (c'y(t)) (d'y(t)) along y' = A y from y(0) = y.
// forms[count * n * n], each symmetric.
void matrix_exponential_forms(const long double *A, size_t n, long double h, size_t count,
                              const long double *const pairs[][2], long double *forms);

// Replaces a form by the form over twice the time; `increment` is that of the single time.
void matrix_exponential_form_double(size_t n, const long double *increment, long double *form);

// out = exp(A h) - I for any n in double: A h / 2^N, N >= 20, by four terms of the Taylor series,
// then N doublings as in the paper. `out` must not be A; `scratch` has 2 n * n. False if
// `progress`, which is called with `fraction` from time to time, requests a stop.
bool matrix_exponential_doublings(const double *A, size_t n, double h, double *out, double *scratch,
                                  const Progress *progress, double fraction);

#endif
