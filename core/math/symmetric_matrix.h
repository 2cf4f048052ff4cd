// Dense symmetric matrices of at most a few hundred rows, by LAPACK.
#ifndef CORE_MATH_SYMMETRIC_MATRIX_H
#define CORE_MATH_SYMMETRIC_MATRIX_H

#include <stddef.h>

#include "core/base/status.h"

// All matrices are size x size, row-major, finite and, except for rounding, symmetric: the mean of
// a matrix and its transpose is used. Values may have any magnitude unless stated otherwise.

// Whether A, scaled to a unit diagonal, plus margin I is positive definite: 0 if so, else the order
// (from 1) of the first leading block that is not, -1 without memory. margin > 0 tests for positive
// semi-definiteness in spite of rounding, margin < 0 for a distance from singular matrices.
int symmetric_matrix_find_indefinite(size_t size, const double *A, double margin);

// Solves A x = b for a positive definite A (symmetric_matrix_find_indefinite returned 0).
Status symmetric_matrix_solve(size_t size, const double *A, const double *b, double *x);

// The values of K y = value M y for a positive definite M, ascending, to double rounding of the
// largest. STATUS_INVALID if M is not definite or a number overflows.
Status symmetric_matrix_eigenvalues(size_t size, const double *M, const double *K, double *values);

// Solves K y = value M y with y' M y = 1 for a positive definite M. Values ascend; vectors[size *
// size] has one per row, with its component of largest magnitude positive. Errors are long double
// rounding of the largest value. STATUS_INVALID if M is not definite or a number overflows.
Status symmetric_matrix_eigen(size_t size, const double *M, const double *K, long double *values,
                              long double *vectors);

#endif
