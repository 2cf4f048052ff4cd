// Loops over all modes, eight at once, by the vectors that the processor has.
#ifndef CORE_SOLVE_SIMD_KERNELS_H
#define CORE_SOLVE_SIMD_KERNELS_H

#include <stddef.h>

enum { SIMD_WIDTH = 8 };

// Number of values in whole vectors that hold `modes` values.
static inline size_t simd_kernels_padded(size_t modes) {
    return (modes + SIMD_WIDTH - 1) / SIMD_WIDTH * SIMD_WIDTH;
}

// One of several arrays in one block.
typedef struct SimdArray {
    double **values;
    size_t size;
} SimdArray;
// Makes the arrays, one after the other from a cache line on, all values 0. Returns the block,
// which the caller frees; NULL: no memory.
double *simd_kernels_allocate(const SimdArray *arrays, size_t count);

// Increments of q and p of each mode in a step, as factors of (q, p, a, b).
typedef struct FlightGains {
    double *q[4], *p[4];
} FlightGains;
enum { FLIGHT_ROWS = 4 };
enum { FLIGHT_SUMS = 7 }; // over (q q, q p, p p, q a, q b, p a, p b)

// One order of a Taylor step: from orders k and k + 1 of q, which follow each other, elastic =
// viscous per_time q_{k+1} + omega2 q_k, after = -scale (elastic + share base) and push[d] =
// shapes_d . elastic. Where viscous is NULL elastic is given.
typedef struct TaylorOrder {
    size_t padded, dampers;
    const double *viscous, *omega2, *share, *shapes, *q;
    double per_time, base, scale;
    double *elastic, *after, *push;
} TaylorOrder;

// Rows are of `padded` values each, one after the other. The bytes are the same with all vectors.
typedef struct SimdKernels {
    // Rows 1 to count of q and p, and of their increments since row 0, each from the row before it.
    // a and b have one value per step.
    void (*fly)(const FlightGains *gains, size_t padded, size_t count, const double *a,
                const double *b, double *q, double *p, double *moved, double *sped);
    // FLIGHT_SUMS rows of sums over rows 0 to count - 1.
    void (*sum)(size_t padded, size_t count, const double *a, const double *b, const double *q,
                const double *p, double *sums);
    // out = first x + second y, row after row.
    void (*mix)(size_t padded, size_t count, const double *first, const double *x,
                const double *second, const double *y, double *out);
    // out[k] = row . rows[k].
    void (*dot)(size_t padded, size_t count, const double *row, const double *rows, double *out);
    // out[k] = sum of weights rows[k]^2.
    void (*weigh)(size_t padded, size_t count, const double *weights, const double *rows,
                  double *out);
    void (*order)(const TaylorOrder *order);
    // out[j] = sum over k of factors[j * stride + k] rows[k], j and j + 1 together: out has an even
    // number of rows. The last of the rows, of degree + 1 of them, first.
    void (*series)(size_t padded, size_t degree, const double *rows, size_t count,
                   const double *factors, size_t stride, double *out);
    // out[k] = sum of weights |rows[k]|.
    void (*weighted_abs)(size_t padded, size_t count, const double *weights, const double *rows,
                         double *out);
    // out = the largest |rows[k]|, column by column.
    void (*largest)(size_t padded, size_t count, const double *rows, double *out);
    // squares += rows' rows of the first `modes` columns, row after row. Only the lower triangle is
    // complete.
    void (*square)(size_t modes, size_t padded, size_t count, const double *rows, double *squares);
    // out = matrix y, column after column of `rows` values, whole vectors; an even number of
    // columns.
    void (*multiply)(const double *matrix, size_t rows, const double *y, size_t columns,
                     double *out);
    // Four times the same with y's that lie `stride` values apart, to four rows of out.
    void (*multiply_four)(const double *matrix, size_t rows, const double *y, size_t stride,
                          size_t columns, double *out);
} SimdKernels;

enum { SIMD_KINDS = 3 };
extern const SimdKernels simd_kernels_kinds[SIMD_KINDS]; // the narrowest vectors first
size_t simd_kernels_widest(void);                        // that this processor has

#endif
