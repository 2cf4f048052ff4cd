#include "core/math/exponential.h"

#include <math.h>
#include <string.h>

enum { SIZE = EXPONENTIAL_SIZE * EXPONENTIAL_SIZE, TERMS = 24, NODES = 12 };

static void multiply(const long double *a, const long double *b, size_t n, long double *out) {
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += a[i * n + k] * b[k * n + j];
            out[i * n + j] = sum;
        }
}

// How often h must be halved until |A| h / 2^N <= 1/2, |A| being the largest row sum.
static int halvings(const long double *A, size_t n, long double h) {
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
static void increment_small(const long double *A, size_t n, long double h, long double *out) {
    long double term[SIZE], next[SIZE];
    for (size_t i = 0; i < n * n; i++)
        out[i] = term[i] = A[i] * h;
    for (int k = 2; k < TERMS; k++) {
        multiply(term, A, n, next);
        for (size_t i = 0; i < n * n; i++) {
            term[i] = next[i] * h / (long double)k;
            out[i] += term[i];
        }
    }
}

// (I + T)^2 - I = 2 T + T T.
void exponential_double(size_t n, long double *increment) {
    long double square[SIZE];
    multiply(increment, increment, n, square);
    for (size_t i = 0; i < n * n; i++)
        increment[i] = 2 * increment[i] + square[i];
}

void exponential_increment(const long double *A, size_t n, long double h, long double *increment) {
    const int count = halvings(A, n, h);
    increment_small(A, n, ldexpl(h, -count), increment);
    for (int i = 0; i < count; i++)
        exponential_double(n, increment);
}

void exponential(const long double *A, size_t n, long double h, long double *transition) {
    exponential_increment(A, n, h, transition);
    for (size_t i = 0; i < n; i++)
        transition[i * n + i] += 1;
}

// Nodes and weights of Gauss-Legendre quadrature on [0, 1], by Newton's method on the Legendre
// polynomial.
static void gauss(long double *node, long double *weight) {
    for (int i = 0; i < NODES; i++) {
        long double x = cosl(3.14159265358979323846L * ((long double)i + 0.75L) / (NODES + 0.5L));
        long double slope = 1;
        for (int pass = 0; pass < 8; pass++) {
            long double p0 = 1, p1 = x;
            for (int k = 2; k <= NODES; k++) {
                const long double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
                p0 = p1;
                p1 = p2;
            }
            slope = NODES * (x * p1 - p0) / (x * x - 1);
            x -= p1 / slope;
        }
        node[i] = (1 - x) / 2;
        weight[i] = 1 / ((1 - x * x) * slope * slope);
    }
}

// rows[k] = v' A^k h^k / k!, so that v' exp(A s h) = sum of rows[k] s^k.
static void row_series(const long double *A, size_t n, long double h, const long double *v,
                       long double rows[TERMS][EXPONENTIAL_SIZE]) {
    memcpy(rows[0], v, n * sizeof *v);
    for (int k = 1; k < TERMS; k++)
        for (size_t j = 0; j < n; j++) {
            long double sum = 0;
            for (size_t i = 0; i < n; i++)
                sum += rows[k - 1][i] * A[i * n + j];
            rows[k][j] = sum * h / (long double)k;
        }
}

void exponential_form(const long double *A, size_t n, long double h, const long double *c,
                      const long double *d, long double *form) {
    const int count = halvings(A, n, h);
    const long double small = ldexpl(h, -count);
    long double left[TERMS][EXPONENTIAL_SIZE], right[TERMS][EXPONENTIAL_SIZE];
    row_series(A, n, small, c, left);
    row_series(A, n, small, d, right);
    long double node[NODES], weight[NODES];
    gauss(node, weight);
    memset(form, 0, n * n * sizeof *form);
    for (int q = 0; q < NODES; q++) {
        long double a[EXPONENTIAL_SIZE] = {0}, b[EXPONENTIAL_SIZE] = {0};
        for (int k = TERMS; k-- > 0;)
            for (size_t j = 0; j < n; j++) {
                a[j] = a[j] * node[q] + left[k][j];
                b[j] = b[j] * node[q] + right[k][j];
            }
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                form[i * n + j] += weight[q] * small * (a[i] * b[j] + a[j] * b[i]) / 2;
    }
    long double T[SIZE];
    increment_small(A, n, small, T);
    for (int pass = 0; pass < count; pass++) {
        exponential_form_double(n, T, form);
        exponential_double(n, T);
    }
}

// The integral over twice the time is this one's plus the same from where the first half ends:
// F + (I + T)' F (I + T).
void exponential_form_double(size_t n, const long double *increment, long double *form) {
    long double E[SIZE], product[SIZE], second[SIZE];
    memcpy(E, increment, n * n * sizeof *E);
    for (size_t i = 0; i < n; i++)
        E[i * n + i] += 1;
    multiply(form, E, n, product);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            second[i * n + j] = 0;
            for (size_t k = 0; k < n; k++)
                second[i * n + j] += E[k * n + i] * product[k * n + j];
        }
    for (size_t i = 0; i < n * n; i++)
        form[i] += second[i];
}
