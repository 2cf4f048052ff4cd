// Small dense linear systems, and eigenvalues of matrices without symmetry (LAPACK).
#ifndef CORE_MATH_LINEAR_SYSTEM_H
#define CORE_MATH_LINEAR_SYSTEM_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

// Solves A X = B by Gaussian elimination with partial pivoting. A has n rows of n values and B n
// rows of `columns`; A is destroyed, and B becomes X. False: A is singular or not finite.
bool linear_system_solve(double *A, double *B, size_t n, size_t columns);

// The eigenvalues of A, n x n, in descending order of magnitude; of a conjugate pair the one with
// the positive imaginary part first. A is destroyed. STATUS_INVALID if A is not finite or they were
// not found.
Status linear_system_eigenvalues(size_t n, double *A, double *real, double *imaginary);

#endif
