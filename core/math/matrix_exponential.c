#include "core/math/matrix_exponential.h"

#include <math.h>
#include <string.h>

enum { SIZE = MATRIX_EXPONENTIAL_MAX * MATRIX_EXPONENTIAL_MAX, TERMS = 18, NODES = 8 };

static void matrix_exponential_multiply(const long double *a, const long double *b, size_t n,
                                        long double *out) {
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += a[i * n + k] * b[k * n + j];
            out[i * n + j] = sum;
        }
}

// The smallest N with |A| h / 2^N <= 1/2, where |A| is the largest row sum.
static int matrix_exponential_halvings(const long double *A, size_t n, long double h) {
    long double norm = 0;
    for (size_t i = 0; i < n; i++) {
        long double sum = 0;
        for (size_t j = 0; j < n; j++)
            sum += fabsl(A[i * n + j]);
        norm = fmaxl(norm, sum);
    }
    int count = 0;
    for (long double rest = norm * h; rest > 0.5L && count < 16000; rest *= 0.5L)
        count++;
    return count;
}

// exp(A h) - I by its Taylor series; |A| h <= 1/2.
static void matrix_exponential_series(const long double *A, size_t n, long double h,
                                      long double *out) {
    long double term[SIZE], next[SIZE];
    for (size_t i = 0; i < n * n; i++)
        out[i] = term[i] = A[i] * h;
    for (int k = 2; k < TERMS; k++) {
        matrix_exponential_multiply(term, A, n, next);
        for (size_t i = 0; i < n * n; i++) {
            term[i] = next[i] * h / (long double)k;
            out[i] += term[i];
        }
    }
}

// (I + T)^2 - I = 2 T + T T.
static void matrix_exponential_double(size_t n, long double *increment) {
    long double square[SIZE];
    matrix_exponential_multiply(increment, increment, n, square);
    for (size_t i = 0; i < n * n; i++)
        increment[i] = 2 * increment[i] + square[i];
}

void matrix_exponential_increment(const long double *A, size_t n, long double h,
                                  long double *increment) {
    const int count = matrix_exponential_halvings(A, n, h);
    matrix_exponential_series(A, n, ldexpl(h, -count), increment);
    for (int i = 0; i < count; i++)
        matrix_exponential_double(n, increment);
}

void matrix_exponential(const long double *A, size_t n, long double h, long double *transition) {
    matrix_exponential_increment(A, n, h, transition);
    for (size_t i = 0; i < n; i++)
        transition[i * n + i] += 1;
}

// Gauss-Legendre quadrature on [0, 1]; the error for products of two solutions over |A| h <= 1/2 is
// below 1e-22.
// clang-format off
static const long double matrix_exponential_gauss[NODES][2] = {
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
static void matrix_exponential_row_series(const long double *A, size_t n, long double h,
                                          const long double *v,
                                          long double rows[TERMS][MATRIX_EXPONENTIAL_MAX]) {
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
static void matrix_exponential_form_series(const long double *A, size_t n, long double h,
                                           const long double *const pair[2], long double *form) {
    long double left[TERMS][MATRIX_EXPONENTIAL_MAX], right[TERMS][MATRIX_EXPONENTIAL_MAX];
    matrix_exponential_row_series(A, n, h, pair[0], left);
    matrix_exponential_row_series(A, n, h, pair[1], right);
    memset(form, 0, n * n * sizeof *form);
    for (int q = 0; q < NODES; q++) {
        long double a[MATRIX_EXPONENTIAL_MAX] = {0}, b[MATRIX_EXPONENTIAL_MAX] = {0};
        for (int k = TERMS; k-- > 0;)
            for (size_t j = 0; j < n; j++) {
                a[j] = a[j] * matrix_exponential_gauss[q][0] + left[k][j];
                b[j] = b[j] * matrix_exponential_gauss[q][0] + right[k][j];
            }
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                form[i * n + j] +=
                    matrix_exponential_gauss[q][1] * h * (a[i] * b[j] + a[j] * b[i]) / 2;
    }
}

// The integral over twice the time is the sum of both halves: F + (I + T)' F (I + T).
static void matrix_exponential_form_double(size_t n, const long double *increment,
                                           long double *form) {
    long double E[SIZE], matrix_exponential_product[SIZE], second[SIZE];
    memcpy(E, increment, n * n * sizeof *E);
    for (size_t i = 0; i < n; i++)
        E[i * n + i] += 1;
    matrix_exponential_multiply(form, E, n, matrix_exponential_product);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            second[i * n + j] = 0;
            for (size_t k = 0; k < n; k++)
                second[i * n + j] += E[k * n + i] * matrix_exponential_product[k * n + j];
        }
    for (size_t i = 0; i < n * n; i++)
        form[i] += second[i];
}

void matrix_exponential_forms(const long double *A, size_t n, long double h, size_t count,
                              const long double *const pairs[][2], long double *forms) {
    const int halved = matrix_exponential_halvings(A, n, h);
    const long double small = ldexpl(h, -halved);
    for (size_t i = 0; i < count; i++)
        matrix_exponential_form_series(A, n, small, pairs[i], forms + i * n * n);
    if (halved == 0)
        return;
    long double T[SIZE];
    matrix_exponential_series(A, n, small, T);
    for (int pass = 0; pass < halved; pass++) {
        for (size_t i = 0; i < count; i++)
            matrix_exponential_form_double(n, T, forms + i * n * n);
        matrix_exponential_double(n, T);
    }
}
