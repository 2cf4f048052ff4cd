// The matrix exponential exp(A h) by precise integration: Zhong and Williams, Computers &
// Structures 56 (1995) 113-120. The increment exp(A h) - I is squared instead of the matrix, so
// that no digits are lost to the identity. Small systems in long double, computed once per plan.
#ifndef CORE_MATH_MATRIX_EXPONENTIAL_H
#define CORE_MATH_MATRIX_EXPONENTIAL_H

#include <stddef.h>

enum { MATRIX_EXPONENTIAL_MAX = 8 };

// exp(A h) - I, row-major, for A[n * n], n <= MATRIX_EXPONENTIAL_MAX.
void matrix_exponential_increment(const long double *A, size_t n, long double h,
                                  long double *increment);

#endif
