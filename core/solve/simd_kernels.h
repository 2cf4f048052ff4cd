// The general engine's long loops over modes, eight at once, by whatever vectors the processor has.
// Not their physics: frame_flight.h, frame_record.h. Used by core/solve/frame*.c.
#ifndef CORE_SOLVE_SIMD_KERNELS_H
#define CORE_SOLVE_SIMD_KERNELS_H

#include <stddef.h>
#include <stdint.h>

enum { FRAME_LANES = 8 };

// Values of all modes, filled up with zeros to whole vectors.
static inline size_t frame_lanes_padded(size_t modes) {
    return (modes + FRAME_LANES - 1) / FRAME_LANES * FRAME_LANES;
}

// Whole vectors lie in whole lines of the processor's memory: how much to ask for, and where such
// room begins.
static inline size_t frame_lanes_room(size_t values) {
    return values + FRAME_LANES;
}
static inline double *frame_lanes_start(double *room) {
    const size_t line = FRAME_LANES * sizeof *room;
    return room + (line - (uintptr_t)room % line) % line / sizeof *room;
}

// What q and p of each mode gain in a step from (q, p, a, b).
typedef struct FrameGains {
    double *q[4], *p[4];
} FrameGains;
enum { FRAME_FOUR = 4 };
enum { FRAME_SUMS = 7 }; // over (q q, q p, p p, q a, q b, p a, p b)

// One order of an arc's series (frame_arc.h): from q's orders k and k + 1, which follow each other,
// elastic = viscous per_time q_{k+1} + omega2 q_k, after = -scale (elastic + share base) and
// push[d] = shapes_d . elastic. Where viscous is NULL elastic is given.
typedef struct FrameOrder {
    size_t padded, dampers;
    const double *viscous, *omega2, *share, *shapes, *q;
    double per_time, base, scale;
    double *elastic, *after, *push;
} FrameOrder;

// Rows are of `padded` values each, one after the other. The bytes are the same with all vectors.
typedef struct FrameLanes {
    // Rows 1 to count of q and p, and of what they have gained since row 0, from the one before
    // each; a and b have one value a step.
    void (*fly)(const FrameGains *gains, size_t padded, size_t count, const double *a,
                const double *b, double *q, double *p, double *moved, double *sped);
    // FRAME_SUMS rows of sums over rows 0 to count - 1.
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
    void (*order)(const FrameOrder *order);
    // out[j] = sum over k of factors[j * stride + k] rows[k], j and j + 1 together: out has an even
    // number of rows. The last of the rows, of degree + 1 of them, first.
    void (*series)(size_t padded, size_t degree, const double *rows, size_t count,
                   const double *factors, size_t stride, double *out);
    // out[k] = sum of weights |rows[k]|.
    void (*reach)(size_t padded, size_t count, const double *weights, const double *rows,
                  double *out);
    // squares += rows' rows, of the first `modes` columns: row after row, whole vectors of rows,
    // those beyond the diagonal being of no use.
    void (*square)(size_t modes, size_t padded, size_t count, const double *rows, double *squares);
    // out = matrix y, column after column of `rows` values, whole vectors; an even number of
    // columns.
    void (*multiply)(const double *matrix, size_t rows, const double *y, size_t columns,
                     double *out);
    // Four times the same with y's that lie `stride` values apart, to four rows of out.
    void (*multiply_four)(const double *matrix, size_t rows, const double *y, size_t stride,
                          size_t columns, double *out);
} FrameLanes;

enum { FRAME_LANES_KINDS = 3 };
extern const FrameLanes frame_lanes_kinds[FRAME_LANES_KINDS]; // the narrowest vectors first
size_t frame_lanes_widest(void);                              // that this processor has

#endif
