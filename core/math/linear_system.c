#include "core/math/linear_system.h"

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
