// Small dense linear systems.
#ifndef CORE_MATH_LINEAR_SYSTEM_H
#define CORE_MATH_LINEAR_SYSTEM_H

#include <stdbool.h>
#include <stddef.h>

// Solves A X = B by Gaussian elimination with partial pivoting. A has n rows of n values and B n
// rows of `columns`; A is destroyed, and B becomes X. False: A is singular or not finite.
bool linear_system_solve(double *A, double *B, size_t n, size_t columns);

#endif
