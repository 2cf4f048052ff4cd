// Linear algebra of small dense symmetric matrices: the one place that calls LAPACK.
// Not for sparse or huge systems: a structure has 200 storeys at most. Used by scene/ and plan/.
#ifndef CORE_MATH_SYMMETRIC_EIGEN_H
#define CORE_MATH_SYMMETRIC_EIGEN_H

#include <stddef.h>

#include "core/base/status.h"

// All matrices are size x size, row after row, finite and, but for rounding, symmetric: the mean of
// a matrix and its transpose is meant. No range of values is too wide unless it is said.

// Scaled to a unit diagonal, is A + margin I positive definite? 0 if so, else the order (from 1) of
// the first leading block that is not, or -1 without memory. margin > 0 judges semi-definiteness
// in spite of rounding, margin < 0 asks for a distance from singular matrices.
int linear_find_indefinite(size_t size, const double *A, double margin);

// x with A x = b for a positive definite A that linear_find_indefinite has passed.
Status linear_solve(size_t size, const double *A, const double *b, double *x);

// K y = value M y with y' M y = 1 for a positive definite M: values rising, vectors[size * size]
// one a row, the component of largest magnitude positive. Right to long double's rounding of the
// largest value. STATUS_INVALID where M is not definite or the numbers leave long double's range.
Status linear_eigen(size_t size, const double *M, const double *K, long double *values,
                    long double *vectors);

#endif
