// Precise integration (Zhong and Williams, Computers & Structures 56 (1995) 113-120) of a system
// too large for math/exponential.h: over a time so short that the fastest rate turns half a radian
// each column of the transition is a power series of the modes, made by the recurrence of an arc;
// then the time is doubled, the increment T = transition - I becoming 2 T + T T, and each form F
// becoming F + (I + T)' F (I + T). All in long double.
#include "core/solve/transition.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TERMS = 22, NODES = 8, WATCH_PRODUCTS = 1000000 };

typedef long double Real;

typedef struct DenseWork {
    const ModalState *state;
    const DamperState *contact; // or NULL
    size_t modes;
    size_t n, size; // n: freedoms, the damper's the last
    bool is_sine;
    Real omega, h;
    Real *T, *F, *C, *G; // C: the contact's form; G: two rows, of value and slope
    Real *share;         // what a_g does to each freedom's momentum
    Real *product;
    Real *series; // of one column: TERMS x storeys
    Real *speeds; // node after node, column after column, of all modes
    Real *pulls;  // D times those of one column
    size_t done;  // products since Progress was asked
} DenseWork;

// Coefficients in t / h of a_g for a unit of value or of slope.
static void base_series(const DenseWork *work, bool is_slope, Real *a) {
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

// Before so many products.
static bool goes_on(DenseWork *work, size_t products) {
    const ModalState *state = work->state;
    if ((work->done += products) < WATCH_PRODUCTS)
        return true;
    work->done = 0;
    return progress_advance(state->run->progress, modal_state_time(state) / state->plan->duration);
}

// Four sums, so that none waits long for the one before.
static Real dot(const double *row, const Real *values, size_t count) {
    Real sum[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (size_t j = 0; j < 4; j++)
            sum[j] += row[i + j] * values[i + j];
    for (; i < count; i++)
        sum[0] += row[i] * values[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static Real dot_long(const Real *row, const Real *values, size_t count) {
    Real sum[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 4 <= count; i += 4)
        for (size_t j = 0; j < 4; j++)
            sum[j] += row[i + j] * values[i + j];
    for (; i < count; i++)
        sum[0] += row[i] * values[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// Of all freedoms.
static void accelerate(const DenseWork *work, const Real *at, const Real *speed, Real base,
                       Real *out) {
    const ModalState *state = work->state;
    const DamperState *contact = work->contact;
    const size_t n = work->modes;
    const Real force =
        contact == NULL ? 0
                        : contact->contact.stiffness * at[n] + contact->contact.damping * speed[n];
    Real push = 0;
    for (size_t i = 0; i < n; i++) {
        const Real elastic = state->omega2[i] * at[i] + dot(state->damping + i * n, speed, n);
        out[i] = -elastic - state->modes->participation[i] * base;
        if (contact == NULL)
            continue;
        out[i] += contact->shape[i] * force;
        push += contact->shape[i] * elastic;
    }
    if (contact != NULL)
        out[n] = push + contact->base_coupling * base - force / contact->effective_mass;
}

// The freedoms' series from a unit of component j of y.
static void column_series(DenseWork *work, size_t j) {
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
        for (size_t i = 0; i < n; i++)
            speed[i] = (Real)(k + 1) / h * next[i];
        accelerate(work, now, speed, a[k], c + (k + 2) * n);
        for (size_t i = 0; i < n; i++)
            c[(k + 2) * n + i] *= h * h / (Real)((k + 1) * (k + 2));
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

// T over h, and the speeds of all columns at the nodes. False: cancelled.
static bool make_small(DenseWork *work, const Quadrature *rule) {
    const size_t n = work->n, size = work->size;
    memset(work->T, 0, size * size * sizeof *work->T);
    for (size_t j = 0; j < size; j++) {
        if (!goes_on(work, TERMS * n * n))
            return false;
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
    return true;
}

// F, C and G over h. False: cancelled.
static bool make_forms(DenseWork *work, const Quadrature *rule) {
    const size_t n = work->n, size = work->size, modes = work->modes;
    const Real viscous = work->contact == NULL ? 0 : work->contact->contact.damping;
    const double *damping = work->state->damping;
    memset(work->F, 0, size * size * sizeof *work->F);
    memset(work->C, 0, size * size * sizeof *work->C);
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
            const Real *p = speeds + j * n, share = dot_long(work->share, p, n);
            if (!goes_on(work, 2 * n * n))
                return false;
            // What is lost is p' D p: of D its symmetric part.
            for (size_t i = 0; i < modes; i++)
                work->pulls[i] = dot(damping + i * modes, p, modes) / 2;
            for (size_t l = 0; l < modes; l++)
                for (size_t i = 0; i < modes; i++)
                    work->pulls[i] += p[l] / 2 * damping[l * modes + i];
            work->G[j] += weight * base[0] * share;
            work->G[size + j] += weight * base[1] * share;
            for (size_t k = 0; k <= j; k++) {
                const Real *other = speeds + k * n;
                work->F[k * size + j] += weight * dot_long(other, work->pulls, modes);
                work->C[k * size + j] += weight * viscous * other[n - 1] * p[n - 1];
            }
        }
    }
    for (size_t j = 0; j < size; j++)
        for (size_t k = 0; k < j; k++) {
            work->F[j * size + k] = work->F[k * size + j];
            work->C[j * size + k] = work->C[k * size + j];
        }
    return true;
}

// out += a b. False: cancelled.
static bool add_product(DenseWork *work, const Real *a, const Real *b, size_t rows, Real *out) {
    const size_t size = work->size;
    for (size_t i = 0; i < rows; i++) {
        if (!goes_on(work, size * size))
            return false;
        for (size_t k = 0; k < size; k++) {
            const Real factor = a[i * size + k];
            if (factor != 0)
                for (size_t j = 0; j < size; j++)
                    out[i * size + j] += factor * b[k * size + j];
        }
    }
    return true;
}

static void transpose(Real *matrix, size_t size) {
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < i; j++) {
            const Real held = matrix[i * size + j];
            matrix[i * size + j] = matrix[j * size + i];
            matrix[j * size + i] = held;
        }
}

// form += (I + T)' form (I + T). False: cancelled.
static bool form_twice(DenseWork *work, Real *form) {
    const size_t size = work->size;
    Real *T = work->T, *product = work->product;
    memcpy(product, form, size * size * sizeof *product);
    if (!add_product(work, form, T, size, product)) // form E
        return false;
    transpose(T, size);
    for (size_t i = 0; i < size * size; i++)
        form[i] += product[i];
    const bool is_whole = add_product(work, T, product, size, form);
    transpose(T, size);
    return is_whole;
}

// Everything over twice the time. False: cancelled.
static bool twice(DenseWork *work) {
    const size_t size = work->size, A = 2 * work->n, bytes = size * size * sizeof(Real);
    Real *T = work->T, *product = work->product;
    memcpy(product, work->G, 2 * size * sizeof *product);
    if (!add_product(work, work->G, T, 2, product))
        return false;
    for (size_t row = 0; row < 2; row++)
        for (size_t s = 0; s < 2; s++) {
            const Real factor = T[(A + s) * size + A + row] + (s == row ? 1 : 0);
            for (size_t j = 0; j < size; j++)
                work->G[row * size + j] += factor * product[s * size + j];
        }
    if (!form_twice(work, work->F) || (work->contact != NULL && !form_twice(work, work->C)))
        return false;
    memcpy(product, T, bytes);
    for (size_t i = 0; i < size * size; i++)
        product[i] *= 2;
    if (!add_product(work, T, T, size, product))
        return false;
    memcpy(T, product, bytes);
    work->h *= 2;
    return true;
}

static void fill(Transition *dense, const DenseWork *work) {
    const size_t size = work->size, gains = 2 * work->n;
    for (size_t j = 0; j < size; j++) {
        for (size_t i = 0; i < gains; i++)
            dense->gain[j * dense->rows + i] = (double)work->T[i * size + j];
        for (size_t i = 0; i < size; i++)
            dense->loss[j * dense->rows + i] = (double)work->F[i * size + j];
        for (size_t i = 0; i < size && dense->contact != NULL; i++)
            dense->contact[j * dense->rows + i] = (double)work->C[i * size + j];
        for (size_t row = 0; row < 2; row++)
            dense->input[row][j] = (double)work->G[row * size + j];
    }
}

static double rate_of(const ModalState *state) {
    return fmax(modal_state_rate(state), state->base_omega);
}

static Status make_room(Transition *dense, size_t freedoms, bool is_contact) {
    const size_t size = 2 * freedoms + 2, rows = simd_kernels_padded(size);
    dense->block = calloc((is_contact ? 3 : 2) * rows * size + 2 * size, sizeof *dense->block);
    if (dense->block == NULL)
        return STATUS_NO_MEMORY;
    dense->freedoms = freedoms;
    dense->size = size;
    dense->rows = rows;
    dense->gain = dense->block;
    dense->loss = dense->gain + rows * size;
    dense->input[0] = dense->loss + rows * size;
    dense->input[1] = dense->input[0] + size;
    dense->contact = is_contact ? dense->input[1] + size : NULL;
    return STATUS_OK;
}

static Status make(Transition *dense, size_t levels, DenseWork *work, Problem *problem) {
    const ModalState *state = work->state;
    size_t left = 0; // doublings
    for (; work->h * rate_of(state) > 0.5L; work->h /= 2)
        left++;
    const Quadrature *rule = linear_motion_quadrature(0.5);
    bool is_whole = make_small(work, rule) && make_forms(work, rule);
    for (; is_whole; left--) {
        if (left < levels) {
            if (make_room(&dense[left], work->n, work->contact != NULL) != STATUS_OK)
                return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                                   state->mode_count);
            fill(&dense[left], work);
        }
        if (left == 0)
            return STATUS_OK;
        is_whole = twice(work);
    }
    return problem_set(problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                       modal_state_time(state));
}

Status transition_make(Transition *dense, size_t levels, const ModalState *state,
                       const DamperState *contact, Problem *problem) {
    const size_t n = state->mode_count + (contact != NULL), size = 2 * n + 2, square = size * size;
    memset(dense, 0, levels * sizeof *dense);
    Real *room =
        malloc((4 * square + 2 * size + (2 + TERMS) * n + NODES * size * n) * sizeof *room);
    if (room == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                           state->mode_count);
    DenseWork work = {.state = state,
                      .contact = contact,
                      .modes = state->mode_count,
                      .n = n,
                      .size = size,
                      .is_sine = state->base_omega > 0,
                      .omega = state->base_omega,
                      .h = state->interval};
    work.T = room;
    work.F = work.T + square;
    work.C = work.F + square;
    work.product = work.C + square;
    work.G = work.product + square;
    work.share = work.G + 2 * size;
    work.pulls = work.share + n;
    work.series = work.pulls + n;
    work.speeds = work.series + TERMS * n;
    const double mass = contact == NULL ? 0 : contact->plan->mass;
    for (size_t i = 0; i < state->mode_count; i++)
        work.share[i] =
            state->modes->participation[i] + (contact == NULL ? 0 : (Real)mass * contact->shape[i]);
    if (contact != NULL)
        work.share[state->mode_count] = mass;
    const Status status = make(dense, levels, &work, problem);
    free(room);
    return status;
}

double transition_form(const Transition *dense, const SimdKernels *lanes, const double *form,
                       const double *y, double *scratch) {
    lanes->multiply(form, dense->rows, y, dense->size, scratch);
    return modal_state_dot(y, scratch, dense->size);
}

void transition_clear(Transition *dense) {
    free(dense->block);
}
