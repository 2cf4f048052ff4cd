// A M-scaled problem has entries of order 1, so LAPACK (dsygvd) meets neither overflow nor
// underflow. Its vectors Y are right to a double's rounding of the largest value, and small values
// to far less. So they only start the polish, in long double: Y is made M-orthonormal by Cholesky's
// factor of Y M Y', and Jacobi's rotations take what is left beside the diagonal of Y K Y' to
// nothing; a sweep or two, for rotations converge quadratically.
#include "core/math/symmetric_eigen.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SWEEPS = 30 }; // from the unit matrix Jacobi needs ten at most

static double mean(const double *A, size_t size, size_t i, size_t j) {
    return A[i * size + j] / 2 + A[j * size + i] / 2;
}

int linear_find_indefinite(size_t size, const double *A, double margin) {
    double *scaled = malloc(size * size * sizeof *scaled);
    if (scaled == NULL)
        return -1;
    int found = 0;
    for (size_t i = 0; i < size && found == 0; i++) {
        const double own = A[i * size + i];
        for (size_t j = 0; j <= i && found == 0; j++) {
            const double other = A[j * size + j], entry = mean(A, size, i, j);
            const double most = sqrt(fabs(own)) * sqrt(fabs(other));
            // No entry of a semi-definite matrix is larger than its diagonal allows: not even 0.
            if (own < 0 || (i != j && fabs(entry) > most * (1 + fabs(margin))))
                found = (int)(i + 1);
            scaled[i * size + j] = i == j ? 1 + margin : most > 0 ? entry / most : 0;
        }
        if (own == 0 && margin <= 0)
            found = (int)(i + 1);
    }
    if (found == 0)
        found = LAPACKE_dpotrf(LAPACK_ROW_MAJOR, 'L', (lapack_int)size, scaled, (lapack_int)size);
    free(scaled);
    return found;
}

Status linear_solve(size_t size, const double *A, const double *b, double *x) {
    double *scaled = malloc((size * size + size) * sizeof *scaled);
    if (scaled == NULL)
        return STATUS_NO_MEMORY;
    double *scale = scaled + size * size;
    for (size_t i = 0; i < size; i++)
        scale[i] = 1 / sqrt(A[i * size + i]);
    for (size_t i = 0; i < size; i++) {
        for (size_t j = 0; j < size; j++)
            scaled[i * size + j] = mean(A, size, i, j) * scale[i] * scale[j];
        x[i] = b[i] * scale[i];
    }
    const lapack_int n = (lapack_int)size,
                     found = LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', n, 1, scaled, n, x, 1);
    for (size_t i = 0; i < size; i++)
        x[i] *= scale[i];
    free(scaled);
    return found == 0 ? STATUS_OK : STATUS_INVALID;
}

// The scaled problem, and the polish's scratch.
typedef struct Eigen {
    size_t size;
    long double *M, *K, *Y; // Y holds vectors in rows
    long double *work;
    double *start; // what LAPACK reads and writes
} Eigen;

// C = A B' for square matrices in rows.
static void multiply(size_t size, const long double *A, const long double *B, long double *C) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) {
            long double sum = 0;
            for (size_t k = 0; k < size; k++)
                sum += A[i * size + k] * B[j * size + k];
            C[i * size + j] = sum;
        }
}

// Makes Y's rows M-orthonormal: with L L' = Y M Y' they become L^-1 Y.
static bool orthonormalise(Eigen *eigen) {
    const size_t n = eigen->size;
    long double *L = eigen->work + n * n, *Y = eigen->Y;
    multiply(n, Y, eigen->M, eigen->work);
    multiply(n, eigen->work, Y, L);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            long double sum = L[i * n + j];
            for (size_t k = 0; k < j; k++)
                sum -= L[i * n + k] * L[j * n + k];
            if (i == j && !(sum > 0))
                return false;
            L[i * n + j] = i == j ? sqrtl(sum) : sum / L[j * n + j];
        }
        for (size_t j = 0; j < i; j++)
            for (size_t k = 0; k < n; k++)
                Y[i * n + k] -= L[i * n + j] * Y[j * n + k];
        for (size_t k = 0; k < n; k++)
            Y[i * n + k] /= L[i * n + i];
    }
    return true;
}

static void rotate_rows(size_t n, long double *p, long double *q, long double c, long double s) {
    for (size_t k = 0; k < n; k++) {
        const long double a = p[k], b = q[k];
        p[k] = c * a - s * b;
        q[k] = s * a + c * b;
    }
}

// The rotation of rows and columns p and q that takes A_pq to 0, also of Y's rows.
static void rotate(Eigen *eigen, long double *A, size_t p, size_t q) {
    const size_t n = eigen->size;
    const long double apq = A[p * n + q], app = A[p * n + p], aqq = A[q * n + q];
    const long double theta = (aqq - app) / (2 * apq);
    const long double t = copysignl(1, theta) / (fabsl(theta) + sqrtl(theta * theta + 1));
    const long double c = 1 / sqrtl(t * t + 1), s = t * c;
    rotate_rows(n, A + p * n, A + q * n, c, s);
    rotate_rows(n, eigen->Y + p * n, eigen->Y + q * n, c, s);
    for (size_t k = 0; k < n; k++) {
        A[k * n + p] = A[p * n + k];
        A[k * n + q] = A[q * n + k];
    }
    A[p * n + p] = app - t * apq;
    A[q * n + q] = aqq + t * apq;
    A[p * n + q] = A[q * n + p] = 0;
}

// Leaves the values on the diagonal of A.
static void diagonalise(Eigen *eigen, long double *A) {
    const size_t n = eigen->size;
    long double largest = 0;
    for (size_t i = 0; i < n; i++)
        largest = fmaxl(largest, fabsl(A[i * n + i]));
    const long double nothing = LDBL_EPSILON / 4 * largest;
    bool is_done = false;
    for (int sweep = 0; sweep < SWEEPS && !is_done; sweep++) {
        is_done = true;
        for (size_t p = 0; p + 1 < n; p++)
            for (size_t q = p + 1; q < n; q++)
                if (fabsl(A[p * n + q]) > nothing) {
                    rotate(eigen, A, p, q);
                    is_done = false;
                }
    }
}

static bool solve(Eigen *eigen) {
    const size_t n = eigen->size;
    double *K = eigen->start, *M = K + n * n, *values = M + n * n;
    for (size_t i = 0; i < n * n; i++) {
        K[i] = (double)eigen->K[i];
        M[i] = (double)eigen->M[i];
    }
    if (LAPACKE_dsygvd(LAPACK_ROW_MAJOR, 1, 'V', 'L', (lapack_int)n, K, (lapack_int)n, M,
                       (lapack_int)n, values) != 0)
        return false;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            eigen->Y[i * n + j] = K[j * n + i];
    if (!orthonormalise(eigen))
        return false;
    long double *A = eigen->work + n * n;
    multiply(n, eigen->Y, eigen->K, eigen->work);
    multiply(n, eigen->work, eigen->Y, A);
    // Symmetric to the last bit, as the rotations keep it.
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++)
            A[i * n + j] = A[j * n + i] = (A[i * n + j] + A[j * n + i]) / 2;
    diagonalise(eigen, A);
    return true;
}

// Values and vectors in the order wanted, back in the problem's own scale.
static void put(const Eigen *eigen, const long double *scale, long double stiffest,
                long double *values, long double *vectors) {
    const size_t n = eigen->size;
    const long double *A = eigen->work + n * n;
    for (size_t i = 0; i < n; i++) {
        size_t place = i;
        const long double value = A[i * n + i] * stiffest;
        for (; place > 0 && values[place - 1] > value; place--)
            values[place] = values[place - 1];
        values[place] = value;
        memmove(vectors + (place + 1) * n, vectors + place * n, (i - place) * n * sizeof *vectors);
        long double *y = vectors + place * n, most = 0;
        for (size_t k = 0; k < n; k++) {
            y[k] = eigen->Y[i * n + k] * scale[k];
            if (fabsl(y[k]) > fabsl(most))
                most = y[k];
        }
        for (size_t k = 0; most < 0 && k < n; k++)
            y[k] = -y[k];
    }
}

Status linear_eigen(size_t size, const double *M, const double *K, long double *values,
                    long double *vectors) {
    const size_t cells = size * size;
    long double *room = calloc(5 * cells + size, sizeof *room);
    double *start = calloc(2 * cells + size, sizeof *start);
    if (room == NULL || start == NULL) {
        free(room);
        free(start);
        return STATUS_NO_MEMORY;
    }
    long double *scale = room + 5 * cells, stiffest = 0;
    Eigen eigen = {size, room, room + cells, room + 2 * cells, room + 3 * cells, start};
    bool is_sound = true;
    for (size_t i = 0; i < size; i++) {
        is_sound = is_sound && M[i * size + i] > 0;
        scale[i] = 1 / sqrtl(M[i * size + i]);
    }
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) {
            const long double both = scale[i] * scale[j];
            eigen.M[i * size + j] = mean(M, size, i, j) * both;
            eigen.K[i * size + j] = mean(K, size, i, j) * both;
            stiffest = fmaxl(stiffest, fabsl(eigen.K[i * size + j]));
        }
    is_sound = is_sound && isfinite(stiffest);
    for (size_t i = 0; i < cells && stiffest > 0; i++)
        eigen.K[i] /= stiffest;
    is_sound = is_sound && solve(&eigen);
    if (is_sound)
        put(&eigen, scale, stiffest, values, vectors);
    free(room);
    free(start);
    return is_sound ? STATUS_OK : STATUS_INVALID;
}
