// Newmark's method with the average acceleration (beta = 1/4, gamma = 1/2): over a step
//
//   p1 = p0 + h/2 (a0 + a1)      q1 = q0 + h p0 + h^2/4 (a0 + a1)
//
// with the equations of motion at its end. G = I + h/2 D + h^2/4 W^2 is inverted once per step
// length. G a1 = (terms of the step's start) + S N, where the columns of S are the mode shapes of
// the dampers' storeys. Each r'' at the end is therefore linear in the contact forces there,
//
//   r'' = b - Q N,   Q = S' G^-1 S + 1/m on the diagonal,
//
// which leaves one equation N = N(r, r') per contact. Newton's method solves them, in one iteration
// where the contact law is linear. N. M. Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67-94.
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/math/linear_system.h"
#include "core/solve/time_stepping.h"

enum { NEWTON_MAX = 60 };

typedef struct Newmark {
    double length;        // step of the tables [s]
    double *inverse;      // G^-1: its diagonal where D is diagonal, else all of it
    double *matrix;       // scratch: G
    double *lift;         // G^-1 S, damper after damper
    double *soften;       // Q, dampers x dampers
    double *from;         // y at the step's start
    double *end;          // a1 of the modes [m/s^2]
    double *left, *right; // Newton's linear system
    double *bare;         // b: r'' at the step's end without contact forces [m/s^2]
    double values[];
} Newmark;

static Status newmark_make(TimeStepping *stepping) {
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers, size = stepping->size;
    const size_t square = state->diagonal != NULL ? n : n * n;
    const size_t values = 2 * square + m * n + 2 * m * m + size + n + 2 * m;
    TRY(time_stepping_make_method(stepping, sizeof(Newmark) + values * sizeof(double)));
    Newmark *newmark = stepping->method;
    newmark->inverse = newmark->values;
    newmark->matrix = newmark->inverse + square;
    newmark->lift = newmark->matrix + square;
    newmark->soften = newmark->lift + m * n;
    newmark->left = newmark->soften + m * m;
    newmark->from = newmark->left + m * m;
    newmark->end = newmark->from + size;
    newmark->right = newmark->end + n;
    newmark->bare = newmark->right + m;
    return STATUS_OK;
}

static Status newmark_invert(const TimeStepping *stepping, double length) {
    const Newmark *newmark = stepping->method;
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count;
    const double half = length / 2, quarter = length * length / 4;
    if (state->diagonal != NULL) {
        for (size_t i = 0; i < n; i++)
            newmark->inverse[i] = 1 / (1 + half * state->diagonal[i] + quarter * state->omega2[i]);
        return STATUS_OK;
    }
    for (size_t i = 0; i < n * n; i++) {
        const bool is_diagonal = i % (n + 1) == 0;
        newmark->inverse[i] = is_diagonal;
        newmark->matrix[i] =
            half * state->damping[i] + (is_diagonal ? 1 + quarter * state->omega2[i / n] : 0);
    }
    return linear_system_solve(newmark->matrix, newmark->inverse, n, n)
               ? STATUS_OK
               : problem_set(state->problem, STATUS_UNSTABLE,
                             "newmark's matrices leave what double precision can hold with a step "
                             "of %.4g s",
                             length);
}

// out = G^-1 in.
static void newmark_solve(const TimeStepping *stepping, const double *in, double *restrict out) {
    const Newmark *newmark = stepping->method;
    const size_t n = stepping->state.mode_count;
    for (size_t i = 0; i < n; i++)
        out[i] = stepping->state.diagonal != NULL
                     ? newmark->inverse[i] * in[i]
                     : modal_state_dot(newmark->inverse + i * n, in, n);
}

static Status newmark_make_tables(TimeStepping *stepping, double length) {
    Newmark *newmark = stepping->method;
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    TRY(newmark_invert(stepping, length));
    newmark->length = length;
    for (size_t d = 0; d < m; d++) {
        newmark_solve(stepping, state->damper[d].shape, newmark->lift + d * n);
        for (size_t e = 0; e < m; e++)
            newmark->soften[e * m + d] =
                modal_state_dot(state->damper[e].shape, newmark->lift + d * n, n) +
                (d == e ? 1 / state->damper[d].plan->mass : 0);
    }
    return STATUS_OK;
}

// Finds the contact forces at the step's end. `r` and `w` are the predictions with r'' = 0 there.
static Status newmark_find_forces(TimeStepping *stepping, double length, const double *r,
                                  const double *w) {
    const Newmark *newmark = stepping->method;
    const ModalState *state = &stepping->state;
    const size_t m = state->dampers;
    const double half = length / 2, quarter = length * length / 4;
    const bool is_linear = state->plan->form == CONTACT_LINEAR;
    bool is_any = false;
    for (size_t d = 0; d < m; d++)
        is_any = is_any || state->damper[d].phase == PHASE_CONTACT;
    for (int round = 0; is_any && round < NEWTON_MAX; round++) {
        for (size_t d = 0; d < m; d++) {
            double pull = newmark->bare[d];
            for (size_t e = 0; e < m; e++) {
                pull -= newmark->soften[d * m + e] * stepping->force[e];
                newmark->left[d * m + e] = d == e;
            }
            newmark->right[d] = 0;
            if (state->damper[d].phase != PHASE_CONTACT)
                continue;
            const ContactForce law =
                step_contact_force(state, d, r[d] + quarter * pull, w[d] + half * pull);
            newmark->right[d] = law.value - stepping->force[d];
            const double yielding = quarter * law.by_penetration + half * law.by_speed;
            for (size_t e = 0; e < m; e++)
                newmark->left[d * m + e] += yielding * newmark->soften[d * m + e];
        }
        if (!linear_system_solve(newmark->left, newmark->right, m, 1))
            break;
        bool is_done = true;
        for (size_t d = 0; d < m; d++) {
            stepping->force[d] += newmark->right[d];
            is_done =
                is_done && fabs(newmark->right[d]) <= 1e-13 * fabs(stepping->force[d]) + DBL_MIN;
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

static Status newmark_step(TimeStepping *stepping, double length) {
    Newmark *newmark = stepping->method;
    const ModalState *state = &stepping->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double half = length / 2, quarter = length * length / 4, ground = stepping->ground[2];
    if (length != newmark->length)
        TRY(newmark_make_tables(stepping, length));
    double *q = stepping->y, *p = q + n, *r = p + n, *w = r + m, *rates = stepping->rows;
    const double *force = stepping->force;
    memcpy(newmark->from, stepping->y, stepping->size * sizeof *newmark->from);
    time_stepping_forces(stepping, stepping->y);
    time_stepping_rate(stepping, stepping->y, stepping->ground[0], rates);
    // Predict the end without its acceleration.
    for (size_t i = 0; i < n + m; i++) {
        double *place = i < n ? q + i : r + (i - n), *speed = i < n ? p + i : w + (i - n);
        const double a = i < n ? rates[n + i] : rates[2 * n + m + (i - n)];
        *place += length * *speed + quarter * a;
        *speed += half * a;
    }
    time_stepping_elastic(state, q, p, stepping->elastic);
    for (size_t i = 0; i < n; i++)
        stepping->elastic[i] = -stepping->elastic[i] - state->modes->participation[i] * ground;
    newmark_solve(stepping, stepping->elastic, newmark->end);
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double shift =
            damper->base_coupling - modal_state_dot(damper->shape, state->modes->participation, n);
        newmark->bare[d] = shift * ground - modal_state_dot(damper->shape, newmark->end, n);
    }
    TRY(newmark_find_forces(stepping, length, r, w));
    for (size_t d = 0; d < m; d++) {
        double pull = newmark->bare[d];
        for (size_t e = 0; e < m; e++)
            pull -= newmark->soften[d * m + e] * force[e];
        r[d] += quarter * pull;
        w[d] += half * pull;
        for (size_t i = 0; i < n && force[d] != 0; i++)
            newmark->end[i] += newmark->lift[d * n + i] * force[d];
    }
    for (size_t i = 0; i < n; i++) {
        q[i] += quarter * newmark->end[i];
        p[i] += half * newmark->end[i];
    }
    time_stepping_integrate(stepping, newmark->from, stepping->y, length, false);
    return STATUS_OK;
}

static double newmark_step_cost(size_t modes, size_t dampers, bool is_coupled, double *setup) {
    const double n = (double)modes, m = (double)dampers;
    *setup = is_coupled ? n * n * n / 20 : 0;
    return 4 + 0.15 * n * (1 + m) + (is_coupled ? 0.02 : 0.008) * n * n;
}

static const Stepper newmark_stepper = {.order = 2,
                                        .between = "it is of order 2",
                                        .make = newmark_make,
                                        .step = newmark_step,
                                        .cost = newmark_step_cost,
                                        .equations = 0.03};

const Solver solver_newmark = {
    .kind = {"newmark",
             "Newmark's method with the average acceleration, contacts switched at step ends",
             accuracy_step_fields, sizeof(AccuracyStep)},
    .run = time_stepping_run,
    .decide = time_stepping_decide,
    .cost = time_stepping_cost,
    .stepper = &newmark_stepper,
};
