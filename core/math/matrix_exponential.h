// exp(A h) by precise integration: Zhong and Williams, Computers & Structures 56 (1995) 113-120.
// The increment exp(A h) - I is squared instead of the matrix, so that nothing is lost to the
// identity. Small dense systems in long double, made once per plan. Used by plan/ and solve/.
#ifndef CORE_MATH_MATRIX_EXPONENTIAL_H
#define CORE_MATH_MATRIX_EXPONENTIAL_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/progress.h"

enum { EXPONENTIAL_SIZE = 8 };

// transition[n * n] = exp(A h), row-major, for A[n * n], n <= EXPONENTIAL_SIZE.
void exponential(const long double *A, size_t n, long double h, long double *transition);

// The same less I, and what it is over twice the time; for ladders of h, 2 h, 4 h ...
void exponential_increment(const long double *A, size_t n, long double h, long double *increment);
void exponential_double(size_t n, long double *increment);

// For each pair (c, d) the integral over 0 <= t <= h of (c' exp(A t))' (d' exp(A t)): the quadratic
// form whose value at y is the integral of (c'y(t)) (d'y(t)) along y' = A y from y(0) = y.
// forms[count * n * n], each symmetric.
void exponential_forms(const long double *A, size_t n, long double h, size_t count,
                       const long double *const pairs[][2], long double *forms);

// What the form is over twice the time; `increment` is the single time's.
void exponential_form_double(size_t n, const long double *increment, long double *form);

// exp(A h) - I of any size in double: A h / 2^N, N >= 20, by four terms of the Taylor series, then
// N doublings as above, as the paper has it. `out` may not be A; `scratch` holds 2 n * n. False:
// `progress`, which is told of `fraction` now and then, said stop.
bool exponential_doublings(const double *A, size_t n, double h, double *out, double *scratch,
                           const Progress *progress, double fraction);

#endif
