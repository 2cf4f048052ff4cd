// A problem scaled by the diagonal of M has entries of order 1, so that LAPACK (dsygvd) neither
// overflows nor underflows. The error of its vectors Y is double rounding of the largest value,
// which is large for small values. They are the start of a refinement in long double: Y is made
// M-orthonormal by the Cholesky factor of Y M Y', and Jacobi rotations diagonalise Y K Y'. One or
// two sweeps suffice, because the rotations converge quadratically.
#include "core/math/symmetric_matrix.h"

#include <float.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SWEEPS = 30 }; // limit; from a unit matrix Jacobi needs at most ten

static double symmetric_matrix_entry(const double *A, size_t size, size_t i, size_t j) {
    return A[i * size + j] / 2 + A[j * size + i] / 2;
}

// Scales A by the rows and columns.
static void symmetric_matrix_scale(const double *A, size_t size, const double *scale,
                                   double *scaled) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++)
            scaled[i * size + j] = symmetric_matrix_entry(A, size, i, j) * scale[i] * scale[j];
}

int symmetric_matrix_find_indefinite(size_t size, const double *A, double margin) {
    double *scaled = malloc(size * size * sizeof *scaled);
    if (scaled == NULL)
        return -1;
    int found = 0;
    for (size_t i = 0; i < size && found == 0; i++) {
        const double own = A[i * size + i];
        for (size_t j = 0; j <= i && found == 0; j++) {
            const double other = A[j * size + j], entry = symmetric_matrix_entry(A, size, i, j);
            const double max = sqrt(fabs(own)) * sqrt(fabs(other));
            // |A_ij| <= sqrt(A_ii A_jj) in every semi-definite matrix.
            if (own < 0 || (i != j && fabs(entry) > max * (1 + fabs(margin))))
                found = (int)(i + 1);
            scaled[i * size + j] = i == j ? 1 + margin : max > 0 ? entry / max : 0;
        }
        if (own == 0 && margin <= 0)
            found = (int)(i + 1);
    }
    if (found == 0)
        found = LAPACKE_dpotrf(LAPACK_ROW_MAJOR, 'L', (lapack_int)size, scaled, (lapack_int)size);
    free(scaled);
    return found;
}

Status symmetric_matrix_solve(size_t size, const double *A, const double *b, double *x) {
    double *scaled = calloc(size * size + size, sizeof *scaled);
    if (scaled == NULL)
        return STATUS_NO_MEMORY;
    double *scale = scaled + size * size;
    for (size_t i = 0; i < size; i++)
        scale[i] = 1 / sqrt(A[i * size + i]);
    symmetric_matrix_scale(A, size, scale, scaled);
    for (size_t i = 0; i < size; i++)
        x[i] = b[i] * scale[i];
    const lapack_int n = (lapack_int)size,
                     found = LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', n, 1, scaled, n, x, 1);
    for (size_t i = 0; i < size; i++)
        x[i] *= scale[i];
    free(scaled);
    return found == 0 ? STATUS_OK : STATUS_INVALID;
}

Status symmetric_matrix_eigenvalues(size_t size, const double *M, const double *K, double *values) {
    const size_t n = size;
    values[0] = K[0] / M[0];
    if (n == 1)
        return STATUS_OK;
    double *scaled = malloc((2 * n * n + n) * sizeof *scaled);
    if (scaled == NULL)
        return STATUS_NO_MEMORY;
    double *mass = scaled + n * n, *scale = mass + n * n;
    for (size_t i = 0; i < n; i++)
        scale[i] = 1 / sqrt(M[i * n + i]);
    symmetric_matrix_scale(K, n, scale, scaled);
    symmetric_matrix_scale(M, n, scale, mass);
    const lapack_int order = (lapack_int)n,
                     found = LAPACKE_dsygv(LAPACK_ROW_MAJOR, 1, 'N', 'L', order, scaled, order,
                                           mass, order, values);
    free(scaled);
    return found == 0 ? STATUS_OK : STATUS_INVALID;
}

// The scaled problem and the scratch memory of the refinement.
typedef struct EigenProblem {
    size_t size;
    long double *M, *K, *Y; // rows of Y are vectors
    long double *work;
    double *start; // input and output of LAPACK
} EigenProblem;

// C = A B' for square row-major matrices.
static void symmetric_matrix_multiply(size_t size, const long double *A, const long double *B,
                                      long double *C) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) {
            long double sum = 0;
            for (size_t k = 0; k < size; k++)
                sum += A[i * size + k] * B[j * size + k];
            C[i * size + j] = sum;
        }
}

// Makes the rows of Y M-orthonormal: Y becomes L^-1 Y, where L L' = Y M Y'.
static bool symmetric_matrix_orthonormalise(EigenProblem *problem) {
    const size_t n = problem->size;
    long double *L = problem->work + n * n, *Y = problem->Y;
    symmetric_matrix_multiply(n, Y, problem->M, problem->work);
    symmetric_matrix_multiply(n, problem->work, Y, L);
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

static void symmetric_matrix_rotate_rows(size_t n, long double *p, long double *q, long double c,
                                         long double s) {
    for (size_t k = 0; k < n; k++) {
        const long double a = p[k], b = q[k];
        p[k] = c * a - s * b;
        q[k] = s * a + c * b;
    }
}

// Rotates rows and columns p and q of A so that A_pq = 0, and the rows of Y.
static void symmetric_matrix_rotate(EigenProblem *problem, long double *A, size_t p, size_t q) {
    const size_t n = problem->size;
    const long double apq = A[p * n + q], app = A[p * n + p], aqq = A[q * n + q];
    const long double theta = (aqq - app) / (2 * apq);
    const long double t = copysignl(1, theta) / (fabsl(theta) + sqrtl(theta * theta + 1));
    const long double c = 1 / sqrtl(t * t + 1), s = t * c;
    symmetric_matrix_rotate_rows(n, A + p * n, A + q * n, c, s);
    symmetric_matrix_rotate_rows(n, problem->Y + p * n, problem->Y + q * n, c, s);
    for (size_t k = 0; k < n; k++) {
        A[k * n + p] = A[p * n + k];
        A[k * n + q] = A[q * n + k];
    }
    A[p * n + p] = app - t * apq;
    A[q * n + q] = aqq + t * apq;
    A[p * n + q] = A[q * n + p] = 0;
}

// Diagonalises A; the eigenvalues are on its diagonal.
static void symmetric_matrix_diagonalise(EigenProblem *problem, long double *A) {
    const size_t n = problem->size;
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
                    symmetric_matrix_rotate(problem, A, p, q);
                    is_done = false;
                }
    }
}

static bool symmetric_matrix_diagonalise_pair(EigenProblem *problem) {
    const size_t n = problem->size;
    double *K = problem->start, *M = K + n * n, *values = M + n * n;
    for (size_t i = 0; i < n * n; i++) {
        K[i] = (double)problem->K[i];
        M[i] = (double)problem->M[i];
    }
    if (LAPACKE_dsygvd(LAPACK_ROW_MAJOR, 1, 'V', 'L', (lapack_int)n, K, (lapack_int)n, M,
                       (lapack_int)n, values) != 0)
        return false;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            problem->Y[i * n + j] = K[j * n + i];
    if (!symmetric_matrix_orthonormalise(problem))
        return false;
    long double *A = problem->work + n * n;
    symmetric_matrix_multiply(n, problem->Y, problem->K, problem->work);
    symmetric_matrix_multiply(n, problem->work, problem->Y, A);
    // Exactly symmetric; the rotations preserve this.
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < i; j++)
            A[i * n + j] = A[j * n + i] = (A[i * n + j] + A[j * n + i]) / 2;
    symmetric_matrix_diagonalise(problem, A);
    return true;
}

// Sorts values and vectors and removes the scale.
static void symmetric_matrix_sort(const EigenProblem *problem, const long double *scale,
                                  long double stiffest, long double *values, long double *vectors) {
    const size_t n = problem->size;
    const long double *A = problem->work + n * n;
    for (size_t i = 0; i < n; i++) {
        size_t place = i;
        const long double value = A[i * n + i] * stiffest;
        for (; place > 0 && values[place - 1] > value; place--)
            values[place] = values[place - 1];
        values[place] = value;
        memmove(vectors + (place + 1) * n, vectors + place * n, (i - place) * n * sizeof *vectors);
        long double *y = vectors + place * n, max = 0;
        for (size_t k = 0; k < n; k++) {
            y[k] = problem->Y[i * n + k] * scale[k];
            if (fabsl(y[k]) > fabsl(max))
                max = y[k];
        }
        for (size_t k = 0; max < 0 && k < n; k++)
            y[k] = -y[k];
    }
}

Status symmetric_matrix_eigen(size_t size, const double *M, const double *K, long double *values,
                              long double *vectors) {
    const size_t cells = size * size;
    long double *buffer = calloc(5 * cells + size, sizeof *buffer);
    double *start = calloc(2 * cells + size, sizeof *start);
    if (buffer == NULL || start == NULL) {
        free(buffer);
        free(start);
        return STATUS_NO_MEMORY;
    }
    long double *scale = buffer + 5 * cells, stiffest = 0;
    EigenProblem problem = {size, buffer, buffer + cells, buffer + 2 * cells, buffer + 3 * cells,
                            start};
    bool is_valid = true;
    for (size_t i = 0; i < size; i++) {
        is_valid = is_valid && M[i * size + i] > 0;
        scale[i] = 1 / sqrtl(M[i * size + i]);
    }
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) {
            const long double both = scale[i] * scale[j];
            problem.M[i * size + j] = symmetric_matrix_entry(M, size, i, j) * both;
            problem.K[i * size + j] = symmetric_matrix_entry(K, size, i, j) * both;
            stiffest = fmaxl(stiffest, fabsl(problem.K[i * size + j]));
        }
    is_valid = is_valid && isfinite(stiffest);
    for (size_t i = 0; i < cells && stiffest > 0; i++)
        problem.K[i] /= stiffest;
    is_valid = is_valid && symmetric_matrix_diagonalise_pair(&problem);
    if (is_valid)
        symmetric_matrix_sort(&problem, scale, stiffest, values, vectors);
    free(buffer);
    free(start);
    return is_valid ? STATUS_OK : STATUS_INVALID;
}
