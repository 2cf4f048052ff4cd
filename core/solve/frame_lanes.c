// Products and sums are of one lane each and none are contracted, and what is summed over lanes is
// summed in one order, so every width of vector gives the same bytes.
#include "core/solve/frame_lanes.h"

#include <math.h>
#include <stdint.h>

#define INLINE static inline __attribute__((always_inline))
#define LOAD(values) (*(const Vector *)(uintptr_t)(values))
#define STORE(values) (*(Vector *)(uintptr_t)(values))

enum { LANES = FRAME_LANES };
// Anywhere in memory.
typedef double Vector __attribute__((vector_size(8 * FRAME_LANES), aligned(8), may_alias));

#define TOTAL(s) (((s)[0] + (s)[4]) + ((s)[2] + (s)[6])) + (((s)[1] + (s)[5]) + ((s)[3] + (s)[7]))

INLINE void fly(const FrameGains *gains, size_t padded, size_t count, const double *a,
                const double *b, double *q, double *p, double *moved, double *sped) {
    const FrameGains g = *gains;
    for (size_t k = 0; k < count; k++, q += padded, p += padded, moved += padded) {
        const double base = a[k], slope = b[k];
        for (size_t i = 0; i < padded; i += LANES) {
            const Vector x = LOAD(q + i), v = LOAD(p + i);
            const Vector dx = (LOAD(g.q[0] + i) * x + LOAD(g.q[1] + i) * v) +
                              (LOAD(g.q[2] + i) * base + LOAD(g.q[3] + i) * slope);
            const Vector dv = (LOAD(g.p[0] + i) * x + LOAD(g.p[1] + i) * v) +
                              (LOAD(g.p[2] + i) * base + LOAD(g.p[3] + i) * slope);
            STORE(q + padded + i) = x + dx;
            STORE(p + padded + i) = v + dv;
            STORE(moved + padded + i) = LOAD(moved + i) + dx;
            STORE(sped + padded + i) = LOAD(sped + i) + dv;
        }
        sped += padded;
    }
}

INLINE void sum(size_t padded, size_t count, const double *a, const double *b, const double *q,
                const double *p, double *sums) {
    for (size_t i = 0; i < padded; i += LANES) {
        Vector s[FRAME_SUMS];
        for (size_t j = 0; j < FRAME_SUMS; j++)
            s[j] = LOAD(sums + j * padded + i);
        for (size_t k = 0; k < count; k++) {
            const Vector x = LOAD(q + k * padded + i), v = LOAD(p + k * padded + i);
            s[0] += x * x;
            s[1] += x * v;
            s[2] += v * v;
            s[3] += x * a[k];
            s[4] += x * b[k];
            s[5] += v * a[k];
            s[6] += v * b[k];
        }
        for (size_t j = 0; j < FRAME_SUMS; j++)
            STORE(sums + j * padded + i) = s[j];
    }
}

INLINE void mix(size_t padded, size_t count, const double *first, const double *x,
                const double *second, const double *y, double *out) {
    for (size_t i = 0; i < padded; i += LANES) {
        const Vector c = LOAD(first + i), d = LOAD(second + i);
        for (size_t k = i; k < count * padded; k += padded)
            STORE(out + k) = c * LOAD(x + k) + d * LOAD(y + k);
    }
}

INLINE void dot(size_t padded, size_t count, const double *row, const double *rows, double *out) {
    for (size_t k = 0; k < count; k++, rows += padded) {
        Vector s = LOAD(row) * LOAD(rows);
        for (size_t i = LANES; i < padded; i += LANES)
            s += LOAD(row + i) * LOAD(rows + i);
        out[k] = TOTAL(s);
    }
}

INLINE void largest(size_t padded, size_t count, const double *rows, double *out) {
    for (size_t i = 0; i < padded; i += LANES) {
        double most[LANES] = {0};
        for (size_t k = i; k < count * padded; k += padded)
            for (size_t j = 0; j < LANES; j++) {
                const double size = fabs(rows[k + j]);
                most[j] = size > most[j] ? size : most[j];
            }
        for (size_t j = 0; j < LANES; j++)
            out[i + j] = most[j];
    }
}

// Four rows at once, so that each value that is loaded serves four times.
INLINE void square(size_t modes, size_t padded, size_t count, const double *rows, double *squares) {
    enum { MANY = 4 };
    size_t i = 0;
    for (; i + MANY <= modes; i += MANY) {
        double *out = squares + i * padded;
        for (size_t j = 0; j < i + MANY; j += LANES) {
            Vector s[MANY];
            for (size_t l = 0; l < MANY; l++)
                s[l] = LOAD(out + l * padded + j);
            for (size_t k = 0; k < count; k++) {
                const double *row = rows + k * padded;
                const Vector other = LOAD(row + j);
                for (size_t l = 0; l < MANY; l++)
                    s[l] += row[i + l] * other;
            }
            for (size_t l = 0; l < MANY; l++)
                STORE(out + l * padded + j) = s[l];
        }
    }
    for (; i < modes; i++)
        for (size_t j = 0; j <= i; j += LANES) {
            Vector s = LOAD(squares + i * padded + j);
            for (size_t k = 0; k < count * padded; k += padded)
                s += rows[k + i] * LOAD(rows + k + j);
            STORE(squares + i * padded + j) = s;
        }
}

// `many` vectors of rows from row i on; even and odd columns apart, so that no sum waits long.
INLINE void multiply_some(const double *matrix, size_t rows, size_t i, size_t many, const double *y,
                          size_t columns, double *out) {
    Vector even[4], odd[4];
    for (size_t l = 0; l < many; l++) {
        even[l] = LOAD(matrix + i + l * LANES) * y[0];
        odd[l] = LOAD(matrix + rows + i + l * LANES) * y[1];
    }
    for (size_t j = 2; j < columns; j += 2)
        for (size_t l = 0; l < many; l++) {
            const double *at = matrix + j * rows + i + l * LANES;
            even[l] += LOAD(at) * y[j];
            odd[l] += LOAD(at + rows) * y[j + 1];
        }
    for (size_t l = 0; l < many; l++)
        STORE(out + i + l * LANES) = even[l] + odd[l];
}

INLINE void multiply(const double *matrix, size_t rows, const double *y, size_t columns,
                     double *out) {
    size_t i = 0;
    for (; i + 4 * LANES <= rows; i += 4 * LANES)
        multiply_some(matrix, rows, i, 4, y, columns, out);
    switch ((rows - i) / LANES) {
    case 3:
        multiply_some(matrix, rows, i, 3, y, columns, out);
        break;
    case 2:
        multiply_some(matrix, rows, i, 2, y, columns, out);
        break;
    case 1:
        multiply_some(matrix, rows, i, 1, y, columns, out);
        break;
    default:
        break;
    }
}

// clang-format off
#define KIND(name, target)                                                                         \
    target static void fly_##name(const FrameGains *g, size_t padded, size_t count,                \
                                  const double *a, const double *b, double *q, double *p,          \
                                  double *moved, double *sped) {                                   \
        fly(g, padded, count, a, b, q, p, moved, sped);                                            \
    }                                                                                              \
    target static void sum_##name(size_t padded, size_t count, const double *a, const double *b,   \
                                  const double *q, const double *p, double *sums) {                \
        sum(padded, count, a, b, q, p, sums);                                                      \
    }                                                                                              \
    target static void mix_##name(size_t padded, size_t count, const double *first,                \
                                  const double *x, const double *second, const double *y,          \
                                  double *out) {                                                   \
        mix(padded, count, first, x, second, y, out);                                              \
    }                                                                                              \
    target static void dot_##name(size_t padded, size_t count, const double *row,                  \
                                  const double *rows, double *out) {                               \
        dot(padded, count, row, rows, out);                                                        \
    }                                                                                              \
    target static void largest_##name(size_t padded, size_t count, const double *rows,             \
                                      double *out) {                                               \
        largest(padded, count, rows, out);                                                         \
    }                                                                                              \
    target static void square_##name(size_t modes, size_t padded, size_t count,                    \
                                     const double *rows, double *squares) {                        \
        square(modes, padded, count, rows, squares);                                               \
    }                                                                                              \
    target static void multiply_##name(const double *matrix, size_t rows, const double *y,         \
                                       size_t columns, double *out) {                              \
        multiply(matrix, rows, y, columns, out);                                                   \
    }

#define ROW(name)                                                                                  \
    {fly_##name, sum_##name, mix_##name, dot_##name, largest_##name, square_##name, multiply_##name}
// clang-format on

KIND(plain, )
#ifdef __x86_64__
KIND(wide, __attribute__((target("avx2"))))
KIND(widest, __attribute__((target("avx512f,avx512dq"))))
const FrameLanes frame_lanes_kinds[FRAME_LANES_KINDS] = {ROW(plain), ROW(wide), ROW(widest)};
#else
const FrameLanes frame_lanes_kinds[FRAME_LANES_KINDS] = {ROW(plain), ROW(plain), ROW(plain)};
#endif

size_t frame_lanes_widest(void) {
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        return 2;
    if (__builtin_cpu_supports("avx2"))
        return 1;
#endif
    return 0;
}
