// Newmark's method with the average acceleration (beta = 1/4, gamma = 1/2): over a step
//
//   p1 = p0 + h/2 (a0 + a1)      q1 = q0 + h p0 + h^2/4 (a0 + a1)
//
// with the equations of motion at its end. G = I + h/2 D + h^2/4 W^2 is made once. With G a1 =
// (what is known) + S N, the columns of S being the dampers' shapes, each r'' at the end is linear
// in the contact forces there,
//
//   r'' = b - Q N,   Q = S' G^-1 S + 1/m on the diagonal,
//
// which leaves as many equations N = N(r, r') as there are contacts: Newton's method solves them,
// in one go where the law is linear.
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/steps_run.h"

enum { NEWTON_MAX = 60 };

typedef struct Newmark {
    double length;   // of the step that the tables are for [s]
    double *inverse; // G^-1: its diagonal, or all of it
    double *lift;    // G^-1 S, damper after damper
    double *soften;  // Q
    double *shift;   // of the dampers: a_g's part in r'' beside that in a1
    double *rates, *from, *end, *force, *left, *right, *bare;
    double *block;
} Newmark;

static void swap(double *a, double *b) {
    const double kept = *a;
    *a = *b;
    *b = kept;
}

static Status no_memory(const Steps *steps) {
    return problem_set(steps->state.problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                       steps->state.mode_count);
}

static Status newmark_make(Steps *steps) {
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers, size = steps->size;
    const size_t square = state->diagonal != NULL ? n : n * n;
    Newmark *own = calloc(1, sizeof *own);
    steps->own = own;
    if (own == NULL)
        return no_memory(steps);
    const size_t sizes[] = {square, m * n, m * m, m, size, size, n, m, m * m, m, m};
    double **const arrays[] = {&own->inverse, &own->lift,  &own->soften, &own->shift,
                               &own->rates,   &own->from,  &own->end,    &own->force,
                               &own->left,    &own->right, &own->bare};
    size_t total = 0;
    for (size_t i = 0; i < COUNT(sizes); i++)
        total += sizes[i];
    own->block = calloc(total, sizeof *own->block);
    if (own->block == NULL)
        return no_memory(steps);
    double *at = own->block;
    for (size_t i = 0; i < COUNT(sizes); i++) {
        *arrays[i] = at;
        at += sizes[i];
    }
    for (size_t d = 0; d < m; d++)
        own->shift[d] = state->damper[d].base_coupling -
                        modal_state_dot(state->damper[d].shape, state->modes->participation, n);
    return STATUS_OK;
}

static void newmark_clear(Steps *steps) {
    Newmark *own = steps->own;
    if (own != NULL)
        free(own->block);
    free(own);
    steps->own = NULL;
}

// left x = right by Gauss with pivots, for `columns` right sides, which stand in rows of so many
// values; the answers take their place.
static bool eliminate(double *left, double *right, size_t n, size_t columns) {
    for (size_t k = 0; k < n; k++) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(left[i * n + k]) > fabs(left[pivot * n + k]))
                pivot = i;
        if (!(fabs(left[pivot * n + k]) > 0) || !isfinite(left[pivot * n + k]))
            return false;
        for (size_t j = k; j < n && pivot != k; j++)
            swap(&left[k * n + j], &left[pivot * n + j]);
        for (size_t j = 0; j < columns && pivot != k; j++)
            swap(&right[k * columns + j], &right[pivot * columns + j]);
        for (size_t i = k + 1; i < n; i++) {
            const double factor = left[i * n + k] / left[k * n + k];
            for (size_t j = k; j < n && factor != 0; j++)
                left[i * n + j] -= factor * left[k * n + j];
            for (size_t j = 0; j < columns && factor != 0; j++)
                right[i * columns + j] -= factor * right[k * columns + j];
        }
    }
    for (size_t i = n; i-- > 0;) {
        double *row = right + i * columns;
        for (size_t k = i + 1; k < n; k++)
            for (size_t j = 0; j < columns; j++)
                row[j] -= left[i * n + k] * right[k * columns + j];
        for (size_t j = 0; j < columns; j++)
            row[j] /= left[i * n + i];
    }
    return true;
}

static Status invert(const Steps *steps, double length) {
    const Newmark *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count;
    const double half = length / 2, quarter = length * length / 4;
    if (state->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            own->inverse[i] = 1 / (1 + half * state->diagonal[i] + quarter * state->omega2[i]);
        return STATUS_OK;
    }
    double *G = malloc(n * n * sizeof *G);
    if (G == NULL)
        return no_memory(steps);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            G[i * n + j] =
                half * state->damping[i * n + j] + (i == j ? 1 + quarter * state->omega2[i] : 0);
            own->inverse[i * n + j] = i == j;
        }
    const bool is_found = eliminate(G, own->inverse, n, n);
    free(G);
    return is_found ? STATUS_OK
                    : problem_set(state->problem, STATUS_UNSTABLE,
                                  "newmark's matrices leave what double precision can hold with a "
                                  "step of %.4g s",
                                  length);
}

// out = G^-1 in.
static void solve(const Steps *steps, const double *in, double *restrict out) {
    const Newmark *own = steps->own;
    const size_t n = steps->state.mode_count;
    for (size_t i = 0; i < n; i++)
        out[i] = steps->state.diagonal != NULL ? own->inverse[i] * in[i]
                                               : modal_state_dot(own->inverse + i * n, in, n);
}

static Status make_tables(Steps *steps, double length) {
    Newmark *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    TRY(invert(steps, length));
    own->length = length;
    for (size_t d = 0; d < m; d++) {
        solve(steps, state->damper[d].shape, own->lift + d * n);
        for (size_t e = 0; e < m; e++)
            own->soften[e * m + d] = modal_state_dot(state->damper[e].shape, own->lift + d * n, n) +
                                     (d == e ? 1 / state->damper[d].plan->mass : 0);
    }
    return STATUS_OK;
}

// Contact forces at the step's end, from those at its start; `r` and `w` are as they would be there
// with r'' = 0 at the end, `bare` is r'' without any force.
static Status find_forces(Steps *steps, double length, const double *r, const double *w) {
    const Newmark *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t m = state->dampers;
    const double half = length / 2, quarter = length * length / 4;
    const bool is_linear = state->plan->form == CONTACT_LINEAR;
    bool is_any = false;
    for (size_t d = 0; d < m; d++)
        is_any = is_any || state->damper[d].phase == PHASE_CONTACT;
    for (int round = 0; is_any && round < NEWTON_MAX; round++) {
        for (size_t d = 0; d < m; d++) {
            double pull = own->bare[d];
            for (size_t e = 0; e < m; e++) {
                pull -= own->soften[d * m + e] * own->force[e];
                own->left[d * m + e] = d == e;
            }
            own->right[d] = 0;
            if (state->damper[d].phase != PHASE_CONTACT)
                continue;
            const ContactForce law =
                steps_contact(state, d, r[d] + quarter * pull, w[d] + half * pull);
            own->right[d] = law.value - own->force[d];
            const double yielding = quarter * law.by_penetration + half * law.by_speed;
            for (size_t e = 0; e < m; e++)
                own->left[d * m + e] += yielding * own->soften[d * m + e];
        }
        if (!eliminate(own->left, own->right, m, 1))
            break;
        bool is_done = true;
        for (size_t d = 0; d < m; d++) {
            own->force[d] += own->right[d];
            is_done = is_done && fabs(own->right[d]) <= 1e-13 * fabs(own->force[d]) + DBL_MIN;
        }
        if (is_done || (is_linear && round == 1))
            return STATUS_OK;
    }
    return !is_any ? STATUS_OK
                   : problem_set(state->problem, STATUS_UNSTABLE,
                                 "newmark finds no contact force at t = %.6g s with a step of %.4g "
                                 "s: the step is too long for the contact, take %.2g s",
                                 modal_state_time(state), length, length / 10);
}

static Status newmark_step(Steps *steps, double length) {
    Newmark *own = steps->own;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double half = length / 2, quarter = length * length / 4, ground = steps->ground[2];
    if (length != own->length)
        TRY(make_tables(steps, length));
    double *q = steps->y, *p = q + n, *r = p + n, *w = r + m;
    memcpy(own->from, steps->y, steps->size * sizeof *own->from);
    for (size_t d = 0; d < m; d++)
        own->force[d] =
            state->damper[d].phase == PHASE_CONTACT ? steps_contact(state, d, r[d], w[d]).value : 0;
    steps_rate(steps, steps->y, steps->ground[0], own->force, own->rates);
    // As it would be without an acceleration at the end.
    for (size_t i = 0; i < n + m; i++) {
        double *place = i < n ? q + i : r + (i - n), *speed = i < n ? p + i : w + (i - n);
        const double a = i < n ? own->rates[n + i] : own->rates[2 * n + m + (i - n)];
        *place += length * *speed + quarter * a;
        *speed += half * a;
    }
    steps_elastic(state, q, p, steps->elastic);
    for (size_t i = 0; i < n; i++)
        steps->elastic[i] = -steps->elastic[i] - state->modes->participation[i] * ground;
    solve(steps, steps->elastic, own->end);
    for (size_t d = 0; d < m; d++)
        own->bare[d] =
            own->shift[d] * ground - modal_state_dot(state->damper[d].shape, own->end, n);
    TRY(find_forces(steps, length, r, w));
    for (size_t d = 0; d < m; d++) {
        double pull = own->bare[d];
        for (size_t e = 0; e < m; e++)
            pull -= own->soften[d * m + e] * own->force[e];
        r[d] += quarter * pull;
        w[d] += half * pull;
        for (size_t i = 0; i < n && own->force[d] != 0; i++)
            own->end[i] += own->lift[d * n + i] * own->force[d];
    }
    for (size_t i = 0; i < n; i++) {
        q[i] += quarter * own->end[i];
        p[i] += half * own->end[i];
    }
    steps_sum(steps, own->from, steps->y, length, false);
    return STATUS_OK;
}

static double newmark_cost(size_t modes, size_t dampers, bool is_coupled, double *making) {
    const double n = (double)modes, m = (double)dampers;
    *making = is_coupled ? n * n * n / 20 : 0;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.02 : 0.008) * n * n;
}

static const Stepper stepper = {.name = "newmark",
                                .between = "it is of order 2",
                                .order = 2,
                                .make = newmark_make,
                                .step = newmark_step,
                                .clear = newmark_clear,
                                .cost = newmark_cost};

static Status run_all(Run *run, Response *response, Problem *problem) {
    return steps_run(run, &stepper, response, problem);
}

static Status decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    return steps_decide(accuracy, &stepper, base_interval, plan, problem);
}

static double cost(const Accuracy *accuracy, double base_interval, const Plan *plan) {
    return steps_cost(accuracy, &stepper, base_interval, plan);
}

const Solver solver_newmark = {
    .kind = {"newmark",
             "Newmark's method with the average acceleration, contacts switched at step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = run_all,
    .decide = decide,
    .cost = cost,
};
