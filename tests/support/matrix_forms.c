#include "tests/support/matrix_forms.h"

#include <math.h>
#include <string.h>

#include "core/math/matrix_exponential.h"

enum { MAX = MATRIX_EXPONENTIAL_MAX, TERMS = 18, NODES = 8 };

void matrix_exponential(const long double *A, size_t n, long double h, long double *transition) {
    matrix_exponential_increment(A, n, h, transition);
    for (size_t i = 0; i < n; i++)
        transition[i * n + i] += 1;
}

// Gauss-Legendre quadrature on [0, 1]; the error for products of two solutions over |A| h <= 1/2 is
// below 1e-22.
// clang-format off
static const long double gauss[NODES][2] = {
    {0.0198550717512318841582L, 0.0506142681451881295763L},
    {0.1016667612931866302042L, 0.1111905172266872352722L},
    {0.2372337950418355070911L, 0.1568533229389436436690L},
    {0.4082826787521750975303L, 0.1813418916891809914826L},
    {0.5917173212478249024697L, 0.1813418916891809914826L},
    {0.7627662049581644929089L, 0.1568533229389436436690L},
    {0.8983332387068133697958L, 0.1111905172266872352722L},
    {0.9801449282487681158418L, 0.0506142681451881295763L},
};
// clang-format on

// rows[k] = v' A^k h^k / k!, so that v' exp(A s h) = sum of rows[k] s^k.
static void row_series(const long double *A, size_t n, long double h, const long double *v,
                       long double rows[TERMS][MAX]) {
    memcpy(rows[0], v, n * sizeof *v);
    for (int k = 1; k < TERMS; k++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t i = 0; i < n; i++)
                sum += rows[k - 1][i] * A[i * n + j];
            rows[k][j] = sum * h / (long double)k;
        }
}

// The form of one pair by the Taylor series; |A| h <= 1/2.
static void form_series(const long double *A, size_t n, long double h,
                        const long double *const pair[2], long double *form) {
    long double left[TERMS][MAX], right[TERMS][MAX];
    row_series(A, n, h, pair[0], left);
    row_series(A, n, h, pair[1], right);
    memset(form, 0, n * n * sizeof *form);
    for (int q = 0; q < NODES; q++) {
        long double a[MAX] = {0}, b[MAX] = {0};
        for (int k = TERMS; k-- > 0;)
            for (size_t j = 0; j < n; j++) {
                a[j] = a[j] * gauss[q][0] + left[k][j];
                b[j] = b[j] * gauss[q][0] + right[k][j];
            }
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                form[i * n + j] += gauss[q][1] * h * (a[i] * b[j] + a[j] * b[i]) / 2;
    }
}

// The form over half the time twice, the second half from where the first one ends.
void matrix_exponential_forms(const long double *A, size_t n, long double h, size_t count,
                              const long double *const pairs[][2], long double *forms) {
    long double norm = 0;
    for (size_t i = 0; i < n * n; i++)
        norm += fabsl(A[i]);
    if (norm * h <= 0.5L) {
        for (size_t i = 0; i < count; i++)
            form_series(A, n, h, pairs[i], forms + i * n * n);
        return;
    }
    long double E[MAX * MAX];
    matrix_exponential_forms(A, n, h / 2, count, pairs, forms);
    matrix_exponential(A, n, h / 2, E);
    for (size_t f = 0; f < count; f++) {
        long double *form = forms + f * n * n, FE[MAX * MAX] = {0};
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < n; k++)
                for (size_t j = 0; j < n; j++)
                    FE[i * n + j] += form[i * n + k] * E[k * n + j];
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < n; k++)
                for (size_t j = 0; j < n; j++)
                    form[i * n + j] += E[k * n + i] * FE[k * n + j];
    }
}
