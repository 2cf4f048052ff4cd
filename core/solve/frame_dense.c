// Precise integration (Zhong and Williams, Computers & Structures 56 (1995) 113-120) of a system
// too large for math/exponential.h: over a time so short that the fastest rate turns half a radian
// each column of the transition is a power series of the modes, made by the recurrence of an arc;
// then the time is doubled, the increment T = transition - I becoming 2 T + T T, and each form F
// becoming F + (I + T)' F (I + T). All in long double.
#include "core/solve/frame_dense.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TERMS = 22, NODES = 8, WORTH = 32 };

typedef long double Real;

typedef struct Work {
    const Frame *frame;
    size_t n, size;
    bool is_sine;
    Real omega, h;
    Real *T, *F, *G; // G: two rows, of value and slope
    Real *product;
    Real *series; // of one column: TERMS x storeys
    Real *speeds; // node after node, column after column, of all modes
    Real *pulls;  // D times those of one column
} Work;

// Coefficients in t / h of a_g for a unit of value or of slope.
static void base_series(const Work *work, bool is_slope, Real *a) {
    memset(a, 0, TERMS * sizeof *a);
    if (!work->is_sine) {
        a[is_slope ? 1 : 0] = is_slope ? work->h : 1;
        return;
    }
    Real scale = 1;
    for (int k = 0; k < TERMS; k++) {
        const bool is_odd = k % 2 == 1;
        if (is_odd == is_slope)
            a[k] = k / 2 % 2 == 0 ? scale : -scale;
        scale *= work->omega * work->h / (Real)(k + 1);
    }
}

// The modes' series from a unit of component j of y.
static void column_series(Work *work, size_t j) {
    const Frame *frame = work->frame;
    const size_t n = work->n;
    const Real h = work->h;
    Real a[TERMS] = {0}, *c = work->series, *speed = work->pulls;
    memset(c, 0, TERMS * n * sizeof *c);
    if (j < n)
        c[j] = 1;
    else if (j < 2 * n)
        c[n + j - n] = h;
    else
        base_series(work, j == 2 * n + 1, a);
    for (size_t k = 0; k + 2 < TERMS; k++) {
        const Real *now = c + k * n, *next = now + n;
        const Real scale = h * h / (Real)((k + 1) * (k + 2));
        for (size_t i = 0; i < n; i++)
            speed[i] = (Real)(k + 1) / h * next[i];
        for (size_t i = 0; i < n; i++) {
            Real sum = frame->omega2[i] * now[i] + frame->modes->participation[i] * a[k];
            for (size_t l = 0; l < n; l++)
                sum += frame->damping[i * n + l] * speed[l];
            c[(k + 2) * n + i] = -scale * sum;
        }
    }
}

static Real value_at(const Real *c, size_t stride, Real s) {
    Real sum = 0;
    for (size_t k = TERMS; k-- > 0;)
        sum = sum * s + c[k * stride];
    return sum;
}

static Real slope_at(const Real *c, size_t stride, Real s) {
    Real sum = 0;
    for (size_t k = TERMS; k-- > 1;)
        sum = sum * s + (Real)k * c[k * stride];
    return sum;
}

// T over h, and the speeds of all columns at the nodes.
static void make_small(Work *work, const Quadrature *rule) {
    const size_t n = work->n, size = work->size;
    memset(work->T, 0, size * size * sizeof *work->T);
    for (size_t j = 0; j < size; j++) {
        column_series(work, j);
        for (size_t i = 0; i < n; i++) {
            const Real *c = work->series + i;
            work->T[i * size + j] = value_at(c, n, 1) - c[0];
            // The identity of a column's own speed is c_1 = h.
            work->T[(n + i) * size + j] = (slope_at(c, n, 1) - c[n]) / work->h;
            for (size_t node = 0; node < rule->count; node++)
                work->speeds[(node * size + j) * n + i] =
                    slope_at(c, n, rule->node[node]) / work->h;
        }
    }
    Real a[TERMS];
    const size_t A = 2 * n, B = A + 1;
    base_series(work, false, a);
    a[0] = 0;
    work->T[A * size + A] = value_at(a, 1, 1);
    base_series(work, true, a);
    work->T[A * size + B] = value_at(a, 1, 1);
    if (work->is_sine) {
        work->T[B * size + A] = -work->T[A * size + B];
        work->T[B * size + B] = work->T[A * size + A];
    }
}

// F and G over h.
static void make_forms(Work *work, const Quadrature *rule) {
    const size_t n = work->n, size = work->size;
    const double *damping = work->frame->damping;
    memset(work->F, 0, size * size * sizeof *work->F);
    memset(work->G, 0, 2 * size * sizeof *work->G);
    for (size_t node = 0; node < rule->count; node++) {
        const Real *speeds = work->speeds + node * size * n;
        const Real weight = rule->weight[node] * work->h;
        Real a[TERMS], base[2];
        for (int row = 0; row < 2; row++) {
            base_series(work, row == 1, a);
            base[row] = value_at(a, 1, rule->node[node]);
        }
        for (size_t j = 0; j < size; j++) {
            const Real *p = speeds + j * n;
            Real share = 0;
            for (size_t i = 0; i < n; i++) {
                Real sum = 0;
                for (size_t l = 0; l < n; l++)
                    sum += damping[i * n + l] * p[l];
                work->pulls[i] = sum;
                share += work->frame->modes->participation[i] * p[i];
            }
            work->G[j] += weight * base[0] * share;
            work->G[size + j] += weight * base[1] * share;
            for (size_t k = 0; k <= j; k++) {
                Real sum = 0;
                for (size_t i = 0; i < n; i++)
                    sum += speeds[k * n + i] * work->pulls[i];
                work->F[k * size + j] += weight * sum;
            }
        }
    }
    for (size_t j = 0; j < size; j++)
        for (size_t k = 0; k < j; k++)
            work->F[j * size + k] = work->F[k * size + j];
}

// out += a b.
static void add_product(const Real *a, const Real *b, size_t rows, size_t size, Real *out) {
    for (size_t i = 0; i < rows; i++)
        for (size_t k = 0; k < size; k++) {
            const Real factor = a[i * size + k];
            if (factor != 0)
                for (size_t j = 0; j < size; j++)
                    out[i * size + j] += factor * b[k * size + j];
        }
}

static void transpose(Real *matrix, size_t size) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < i; j++) {
            const Real held = matrix[i * size + j];
            matrix[i * size + j] = matrix[j * size + i];
            matrix[j * size + i] = held;
        }
}

// Everything over twice the time.
static void twice(Work *work) {
    const size_t size = work->size, A = 2 * work->n, bytes = size * size * sizeof(Real);
    Real *T = work->T, *product = work->product;
    memcpy(product, work->G, 2 * size * sizeof *product);
    add_product(work->G, T, 2, size, product);
    for (size_t row = 0; row < 2; row++)
        for (size_t s = 0; s < 2; s++) {
            const Real factor = T[(A + s) * size + A + row] + (s == row ? 1 : 0);
            for (size_t j = 0; j < size; j++)
                work->G[row * size + j] += factor * product[s * size + j];
        }
    memcpy(product, work->F, bytes);
    add_product(work->F, T, size, size, product); // F E
    transpose(T, size);
    for (size_t i = 0; i < size * size; i++)
        work->F[i] += product[i];
    add_product(T, product, size, size, work->F);
    transpose(T, size);
    memcpy(product, T, bytes);
    for (size_t i = 0; i < size * size; i++)
        product[i] *= 2;
    add_product(T, T, size, size, product);
    memcpy(T, product, bytes);
    work->h *= 2;
}

static void fill(FrameDense *dense, const Work *work) {
    const size_t size = work->size, rows = 2 * work->n;
    for (size_t j = 0; j < size; j++) {
        for (size_t i = 0; i < rows; i++)
            dense->gain[j * rows + i] = (double)work->T[i * size + j];
        for (size_t i = 0; i < size; i++)
            dense->loss[j * size + i] = (double)work->F[i * size + j];
        for (size_t row = 0; row < 2; row++)
            dense->input[row][j] = (double)work->G[row * size + j];
    }
}

static double rate_of(const Frame *frame) {
    return fmax(frame->rate, frame->turning);
}

static Status make(FrameDense *dense, const Frame *frame, Real *room, Problem *problem) {
    const size_t n = frame->storeys, size = dense->size;
    Work work = {.frame = frame,
                 .n = n,
                 .size = size,
                 .is_sine = frame->turning > 0,
                 .omega = frame->turning,
                 .h = frame->interval};
    work.T = room;
    work.F = work.T + size * size;
    work.product = work.F + size * size;
    work.G = work.product + size * size;
    work.pulls = work.G + 2 * size;
    work.series = work.pulls + n;
    work.speeds = work.series + TERMS * n;
    size_t count = 0;
    for (; work.h * rate_of(frame) > 0.5L; work.h /= 2)
        count++;
    const Quadrature *rule = arc_quadrature(0.5);
    make_small(&work, rule);
    make_forms(&work, rule);
    for (size_t i = 0; i < count; i++) {
        if (!watch_advance(frame->run->watch, 0))
            return problem_set(problem, STATUS_CANCELLED, "cancelled at t = 0 s");
        twice(&work);
    }
    fill(dense, &work);
    return STATUS_OK;
}

Status frame_dense_make(FrameDense *dense, const Frame *frame, Problem *problem) {
    const size_t n = frame->storeys, size = 2 * n + 2, square = size * size;
    memset(dense, 0, sizeof *dense);
    if (frame->plan->count < WORTH * n || !(frame->interval * rate_of(frame) < 0x1p40))
        return STATUS_OK;
    Real *room =
        malloc((3 * square + 2 * size + (1 + TERMS) * n + NODES * size * n) * sizeof *room);
    dense->block = malloc((2 * n * size + square + 2 * size) * sizeof *dense->block);
    if (room == NULL || dense->block == NULL) {
        free(room);
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    }
    dense->size = size;
    dense->gain = dense->block;
    dense->loss = dense->gain + 2 * n * size;
    dense->input[0] = dense->loss + square;
    dense->input[1] = dense->input[0] + size;
    const Status status = make(dense, frame, room, problem);
    free(room);
    return status;
}

void frame_dense_clear(FrameDense *dense) {
    free(dense->block);
}
