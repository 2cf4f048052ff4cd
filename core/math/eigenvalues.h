// Eigenvalues of small dense matrices without symmetry (LAPACK).
#ifndef CORE_MATH_EIGENVALUES_H
#define CORE_MATH_EIGENVALUES_H

#include <stddef.h>

#include "core/base/status.h"

// The eigenvalues of A, size x size, in descending order of magnitude; of a conjugate pair the one
// with the positive imaginary part first. A is destroyed. STATUS_INVALID if A is not finite or they
// were not found.
Status eigenvalues_find(size_t size, double *A, double *real, double *imaginary);

#endif
