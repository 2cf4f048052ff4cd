#include "core/math/eigenvalues.h"

#include <lapacke.h>
#include <math.h>

static bool eigenvalues_is_before(const double *real, const double *imaginary, size_t i, size_t j) {
    const double a = hypot(real[i], imaginary[i]), b = hypot(real[j], imaginary[j]);
    if (a != b)
        return a > b;
    return real[i] != real[j] ? real[i] > real[j] : imaginary[i] > imaginary[j];
}

static void eigenvalues_swap(double *values, size_t i, size_t j) {
    const double kept = values[i];
    values[i] = values[j];
    values[j] = kept;
}

Status eigenvalues_find(size_t size, double *A, double *real, double *imaginary) {
    for (size_t i = 0; i < size * size; i++)
        if (!isfinite(A[i]))
            return STATUS_INVALID;
    const lapack_int n = (lapack_int)size;
    const lapack_int found =
        LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'N', 'N', n, A, n, real, imaginary, NULL, n, NULL, n);
    if (found == LAPACK_WORK_MEMORY_ERROR || found == LAPACK_TRANSPOSE_MEMORY_ERROR)
        return STATUS_NO_MEMORY;
    if (found != 0)
        return STATUS_INVALID;
    for (size_t i = 1; i < size; i++)
        for (size_t j = i; j > 0 && eigenvalues_is_before(real, imaginary, j, j - 1); j--) {
            eigenvalues_swap(real, j, j - 1);
            eigenvalues_swap(imaginary, j, j - 1);
        }
    return STATUS_OK;
}
