#include "core/math/linear_system.h"

#include <lapacke.h>
#include <math.h>

static void linear_system_swap(double *a, double *b, size_t count) {
    for (size_t j = 0; j < count; j++) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

bool linear_system_solve(double *A, double *B, size_t n, size_t columns) {
    for (size_t k = 0; k < n; k++) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(A[i * n + k]) > fabs(A[pivot * n + k]))
                pivot = i;
        if (!(fabs(A[pivot * n + k]) > 0) || !isfinite(A[pivot * n + k]))
            return false;
        if (pivot != k) {
            linear_system_swap(&A[k * n + k], &A[pivot * n + k], n - k);
            linear_system_swap(&B[k * columns], &B[pivot * columns], columns);
        }
        for (size_t i = k + 1; i < n; i++) {
            const double factor = A[i * n + k] / A[k * n + k];
            for (size_t j = k; j < n && factor != 0; j++)
                A[i * n + j] -= factor * A[k * n + j];
            for (size_t j = 0; j < columns && factor != 0; j++)
                B[i * columns + j] -= factor * B[k * columns + j];
        }
    }
    for (size_t i = n; i-- > 0;) {
        double *row = B + i * columns;
        for (size_t k = i + 1; k < n; k++)
            for (size_t j = 0; j < columns; j++)
                row[j] -= A[i * n + k] * B[k * columns + j];
        for (size_t j = 0; j < columns; j++)
            row[j] /= A[i * n + i];
    }
    return true;
}

static bool linear_system_is_before(const double *real, const double *imaginary, size_t i,
                                    size_t j) {
    const double a = hypot(real[i], imaginary[i]), b = hypot(real[j], imaginary[j]);
    if (a != b)
        return a > b;
    return real[i] != real[j] ? real[i] > real[j] : imaginary[i] > imaginary[j];
}

Status linear_system_eigenvalues(size_t n, double *A, double *real, double *imaginary) {
    for (size_t i = 0; i < n * n; i++)
        if (!isfinite(A[i]))
            return STATUS_INVALID;
    const lapack_int size = (lapack_int)n;
    const lapack_int found = LAPACKE_dgeev(LAPACK_ROW_MAJOR, 'N', 'N', size, A, size, real,
                                           imaginary, NULL, size, NULL, size);
    if (found == LAPACK_WORK_MEMORY_ERROR || found == LAPACK_TRANSPOSE_MEMORY_ERROR)
        return STATUS_NO_MEMORY;
    if (found != 0)
        return STATUS_INVALID;
    for (size_t i = 1; i < n; i++)
        for (size_t j = i; j > 0 && linear_system_is_before(real, imaginary, j, j - 1); j--) {
            linear_system_swap(&real[j], &real[j - 1], 1);
            linear_system_swap(&imaginary[j], &imaginary[j - 1], 1);
        }
    return STATUS_OK;
}
