#include "core/math/matrix_exponential.h"

#include <math.h>

enum { SIZE = MATRIX_EXPONENTIAL_MAX * MATRIX_EXPONENTIAL_MAX, TERMS = 18 };

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

void matrix_exponential_increment(const long double *A, size_t n, long double h,
                                  long double *increment) {
    const int count = matrix_exponential_halvings(A, n, h);
    long double square[SIZE];
    matrix_exponential_series(A, n, ldexpl(h, -count), increment);
    for (int i = 0; i < count; i++) { // (I + T)^2 - I = 2 T + T T
        matrix_exponential_multiply(increment, increment, n, square);
        for (size_t j = 0; j < n * n; j++)
            increment[j] = 2 * increment[j] + square[j];
    }
}
