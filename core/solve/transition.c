// Over a time so short that the fastest rate turns half a radian, the increment T = exp(A h) - I is
// a Taylor series, and each form F, the integral of exp(A t)' Q exp(A t), a Gauss quadrature. Then
// the time is doubled: T becomes 2 T + T T, and F becomes F + (I + T)' F (I + T). Zhong and
// Williams, Computers & Structures 56 (1995) 113-120. All in long double. Products skip the zeros
// of their left factor, so that uncoupled modes stay apart.
#include "core/solve/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TERMS = 22, NODES = 8, PROGRESS_WORK = 1000000 };

typedef long double Real;

static const Real NEGLIGIBLE = 1e-23L; // last term of a series over its sum

typedef struct TransitionWork {
    const ModalState *state;
    const DamperState *dampers;
    size_t first, modes; // the modes
    size_t count;        // of the dampers
    size_t n, size;      // modes + count, and 2 n + 2
    Real h, omega;       // omega: of the base, 0 where it is linear
    Real *A, *T;
    Real *loss, *contact; // forms
    Real *input;          // rows of a form: of value and slope
    Real *term, *product;
    Real *rows;  // of exp(A t), node after node
    size_t work; // multiplications since the last progress call
} TransitionWork;

// out += left right, or left' right. `left` has `inner` columns (rows), out `rows` rows. Four terms
// are added at once, for stores of long double are slow. False: cancelled.
static bool transition_add(TransitionWork *work, const Real *left, bool is_transposed, size_t rows,
                           size_t inner, const Real *right, Real *restrict out) {
    const ModalState *state = work->state;
    const size_t size = work->size;
    for (size_t i = 0; i < rows; i++, out += size) {
        for (size_t k = 0; k < inner;) {
            Real factor[4] = {0};
            const Real *from[4] = {right, right, right, right};
            for (size_t count = 0; k < inner && count < 4; k++) {
                factor[count] = is_transposed ? left[k * size + i] : left[i * size + k];
                from[count] = right + k * size;
                count += factor[count] != 0;
            }
            for (size_t j = 0; j < size; j++)
                out[j] += (factor[0] * from[0][j] + factor[1] * from[1][j]) +
                          (factor[2] * from[2][j] + factor[3] * from[3][j]);
        }
        if ((work->work += inner * size) < PROGRESS_WORK)
            continue;
        work->work = 0;
        if (!progress_advance(state->run->progress,
                              modal_state_time(state) / state->plan->duration))
            return false;
    }
    return true;
}

// y' = A y.
static void transition_make_system(TransitionWork *work) {
    const ModalState *state = work->state;
    const size_t modes = work->modes, n = work->n, size = work->size, a = 2 * n, b = a + 1;
    Real *A = work->A;
    for (size_t i = 0; i < n; i++)
        A[i * size + n + i] = 1;
    for (size_t i = 0; i < modes; i++) {
        Real *row = A + (n + i) * size;
        row[i] = -(Real)state->omega2[work->first + i];
        for (size_t l = 0; l < modes; l++)
            row[n + l] =
                -(Real)state->damping[(work->first + i) * state->mode_count + work->first + l];
        row[a] = -(Real)state->modes->participation[work->first + i];
    }
    for (size_t d = 0; d < work->count; d++) { // w' without N is base_coupling a_g - shape . q''
        const DamperState *damper = &work->dampers[d];
        Real *row = A + (n + modes + d) * size;
        for (size_t i = 0; i < modes; i++)
            for (size_t j = 0; j < 2 * n; j++)
                row[j] -= damper->shape[i] * A[(n + i) * size + j];
        row[a] = damper->base_coupling;
    }
    for (size_t e = 0; e < work->count; e++) { // N = k r + c w
        const DamperState *damper = &work->dampers[e];
        if (damper->phase != PHASE_CONTACT)
            continue;
        const double *delassus =
            state->delassus + (size_t)(damper - state->damper) * state->dampers;
        const Real k = damper->contact.stiffness, c = damper->contact.damping;
        for (size_t i = 0; i < n; i++) {
            const double gain =
                i < modes ? damper->shape[i]
                          : -delassus[(size_t)(work->dampers - state->damper) + i - modes];
            A[(n + i) * size + modes + e] += gain * k;
            A[(n + i) * size + n + modes + e] += gain * c;
        }
    }
    A[a * size + b] = work->omega > 0 ? work->omega : 1;
    A[b * size + a] = -work->omega;
}

// T, and the rows of exp(A t) of p, w and a_g at the nodes.
static bool transition_make_series(TransitionWork *work, const Quadrature *rule) {
    const size_t size = work->size, square = size * size, rows = (work->n + 1) * size;
    Real power[NODES];
    for (size_t i = 0; i < size; i++)
        work->term[i * size + i] = 1;
    for (size_t node = 0; node < NODES; node++)
        power[node] = 1;
    bool is_done = false;
    for (int k = 0; k < TERMS && !is_done; k++) {
        for (size_t node = 0; node < rule->count; node++) {
            for (size_t i = 0; i < rows; i++)
                work->rows[node * rows + i] += power[node] * work->term[work->n * size + i];
            power[node] *= rule->node[node];
        }
        memset(work->product, 0, square * sizeof *work->product);
        if (!transition_add(work, work->A, false, size, size, work->term, work->product))
            return false;
        is_done = true;
        for (size_t i = 0; i < square; i++) {
            const Real term = work->term[i] = work->h / (Real)(k + 1) * work->product[i];
            work->T[i] += term;
            is_done = is_done && fabsl(term) <= NEGLIGIBLE * fabsl(work->T[i]);
        }
    }
    return true;
}

// The integrals of p' D p, of a contact's c w^2, and of a_g times the momentum it acts on.
static bool transition_make_forms(TransitionWork *work, const Quadrature *rule) {
    const ModalState *state = work->state;
    const DamperState *damper = work->dampers;
    const size_t n = work->n, modes = work->modes, size = work->size;
    Real *product = work->product;
    for (size_t node = 0; node < rule->count; node++) {
        const Real *p = work->rows + node * (n + 1) * size, *w = p + modes * size,
                   *base = p + n * size;
        const Real weight = rule->weight[node] * work->h;
        memset(product, 0, modes * size * sizeof *product);
        if (!transition_add(work, work->A + n * size + n, false, modes, modes, p, product))
            return false;
        for (size_t i = 0; i < modes * size; i++)
            product[i] *= -weight; // A has -D
        if (!transition_add(work, p, true, size, modes, product, work->loss))
            return false;
        memset(product, 0, size * sizeof *product);
        for (size_t i = 0; i < modes; i++) {
            const Real share = state->modes->participation[work->first + i] +
                               (work->count > 0 ? (Real)damper->plan->mass * damper->shape[i] : 0);
            for (size_t j = 0; j < size; j++)
                product[j] += weight * share * p[i * size + j];
        }
        for (size_t j = 0; j < size && work->count > 0; j++)
            product[j] += weight * damper->plan->mass * w[j];
        if (!transition_add(work, base + 2 * n, true, 2, 1, product, work->input))
            return false;
        for (size_t j = 0; j < size && work->count > 0; j++)
            product[j] = weight * damper->contact.damping * w[j];
        if (work->count > 0 && !transition_add(work, w, true, size, 1, product, work->contact))
            return false;
    }
    for (size_t i = 0; i < size; i++) // of D only the symmetric part counts
        for (size_t j = 0; j <= i; j++)
            work->loss[i * size + j] = work->loss[j * size + i] =
                (work->loss[i * size + j] + work->loss[j * size + i]) / 2;
    return true;
}

// F + (I + T)' F (I + T); the left factor of the rows of `input` is the base's part of T.
static bool transition_double_form(TransitionWork *work, Real *form) {
    const size_t size = work->size, a = 2 * work->n;
    const bool is_input = form == work->input;
    const size_t rows = is_input ? 2 : size;
    memcpy(work->product, form, rows * size * sizeof *form);
    if (!transition_add(work, form, false, rows, size, work->T, work->product))
        return false;
    for (size_t i = 0; i < rows * size; i++)
        form[i] += work->product[i];
    return transition_add(work, is_input ? work->T + a * size + a : work->T, true, rows, rows,
                          work->product, form);
}

static bool transition_double(TransitionWork *work, bool has_forms) {
    const size_t size = work->size, square = size * size;
    if (has_forms &&
        (!transition_double_form(work, work->input) || !transition_double_form(work, work->loss) ||
         (work->count > 0 && !transition_double_form(work, work->contact))))
        return false;
    for (size_t i = 0; i < square; i++)
        work->product[i] = 2 * work->T[i];
    if (!transition_add(work, work->T, false, size, size, work->T, work->product))
        return false;
    memcpy(work->T, work->product, square * sizeof *work->T);
    work->h *= 2;
    return true;
}

// Column after column.
static Status transition_store(Transition *transition, const TransitionWork *work) {
    const size_t size = work->size, rows = simd_kernels_padded(size);
    const bool is_contact = work->count > 0;
    const SimdArray arrays[] = {{&transition->gain, rows * size},
                                {&transition->loss, rows * size},
                                {&transition->contact, is_contact ? rows * size : 0},
                                {&transition->input[0], size},
                                {&transition->input[1], size}};
    transition->block = simd_kernels_allocate(arrays, COUNT(arrays));
    if (transition->block == NULL)
        return STATUS_NO_MEMORY;
    transition->size = size;
    transition->rows = rows;
    for (size_t j = 0; j < size; j++) {
        for (size_t i = 0; i < 2 * work->n; i++)
            transition->gain[j * rows + i] = (double)work->T[i * size + j];
        for (size_t i = 0; i < size; i++)
            transition->loss[j * rows + i] = (double)work->loss[i * size + j];
        for (size_t i = 0; i < size && is_contact; i++)
            transition->contact[j * rows + i] = (double)work->contact[i * size + j];
        for (size_t row = 0; row < 2; row++)
            transition->input[row][j] = (double)work->input[row * size + j];
    }
    return STATUS_OK;
}

// Either `levels` transitions or an increment.
static Status transition_run(TransitionWork *work, Transition *transitions, size_t levels,
                             double *increment) {
    const ModalState *state = work->state;
    const double own = fmax(sqrt(state->omega2[work->first]),
                            state->damping[work->first * (state->mode_count + 1)]);
    const Real rate =
        fmaxl(work->modes < state->mode_count ? own : modal_state_rate(state), work->omega);
    size_t left = 0; // doublings
    for (; work->h * rate > 0.5L && left < 16000; work->h /= 2)
        left++;
    const Quadrature *rule = levels > 0 ? linear_motion_quadrature(0.5) : &(Quadrature){0};
    bool is_whole =
        transition_make_series(work, rule) && (levels == 0 || transition_make_forms(work, rule));
    for (; is_whole; left--) {
        if (left < levels)
            TRY(transition_store(&transitions[left], work));
        if (left == 0)
            break;
        is_whole = transition_double(work, levels > 0);
    }
    for (size_t i = 0; i < work->size * work->size && increment != NULL && is_whole; i++)
        increment[i] = (double)work->T[i];
    return is_whole ? STATUS_OK : STATUS_CANCELLED;
}

static Status transition_start(const ModalState *state, size_t first, size_t modes,
                               const DamperState *dampers, size_t count, double length,
                               Transition *transitions, size_t levels, double *increment,
                               Problem *problem) {
    const size_t n = modes + count, size = 2 * n + 2, square = size * size;
    Real *block =
        calloc((levels > 0 ? 6 : 4) * square + 2 * size + (levels > 0 ? NODES * (n + 1) * size : 0),
               sizeof *block);
    TransitionWork work = {.state = state,
                           .dampers = dampers,
                           .first = first,
                           .modes = modes,
                           .count = count,
                           .n = n,
                           .size = size,
                           .h = length,
                           .omega = levels > 0 ? state->base_omega : 0};
    Status status = STATUS_NO_MEMORY;
    if (block != NULL) {
        work.A = block;
        work.T = work.A + square;
        work.term = work.T + square;
        work.product = work.term + square;
        work.input = work.product + square;
        work.loss = work.input + 2 * size;
        work.contact = work.loss + square;
        work.rows = work.contact + square;
        transition_make_system(&work);
        status = transition_run(&work, transitions, levels, increment);
    }
    free(block);
    return status == STATUS_NO_MEMORY
               ? problem_set(problem, status, "no memory for a run of %zu modes", state->mode_count)
           : status == STATUS_CANCELLED
               ? problem_set(problem, status, "cancelled at t = %.6g s", modal_state_time(state))
               : STATUS_OK;
}

Status transition_make(Transition *transitions, size_t levels, const ModalState *state,
                       const DamperState *contact, Problem *problem) {
    memset(transitions, 0, levels * sizeof *transitions);
    return transition_start(state, 0, state->mode_count, contact, contact != NULL, state->interval,
                            transitions, levels, NULL, problem);
}

Status transition_make_mode(Transition *transition, const ModalState *state, size_t mode,
                            Problem *problem) {
    *transition = (Transition){0};
    return transition_start(state, mode, 1, NULL, 0, state->interval, transition, 1, NULL, problem);
}

Status transition_increment(const ModalState *state, double length, double *increment,
                            Problem *problem) {
    return transition_start(state, 0, state->mode_count, state->damper, state->dampers, length,
                            NULL, 0, increment, problem);
}

void transition_clear(Transition *transition) {
    free(transition->block);
}
