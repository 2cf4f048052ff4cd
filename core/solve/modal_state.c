#include "core/solve/modal_state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/linear_system.h"

double modal_state_time(const ModalState *state) {
    return (double)state->sample / state->plan->sample_rate + state->offset;
}

double modal_state_clock(const ModalState *state) {
    return 4 * DBL_EPSILON * fmax(modal_state_time(state), state->interval);
}

Status modal_state_check(const ModalState *state, double step) {
    const EnergyState energy = modal_state_energy(state);
    double sum = energy.kinetic + energy.strain;
    for (size_t i = 0; i < state->mode_count; i++)
        sum += fabs(state->q[i]);
    for (size_t d = 0; d < state->dampers; d++)
        sum += fabs(state->damper[d].r);
    TRY(run_check(state->run, modal_state_time(state), step, isfinite(sum), state->problem));
    return impact_log_status(&state->impacts, state->problem);
}

double modal_state_room(const DamperState *damper, Side side) {
    if (damper->origin == FROM_MIDDLE)
        return damper->plan->clearance / 2;
    return damper->origin == (ContactOrigin)side ? 0 : damper->plan->clearance;
}

void modal_state_elastic(const ModalState *state, const double *q, const double *p,
                         double *restrict out) {
    const size_t padded = state->padded;
    if (state->diagonal != NULL) {
        state->lanes->mix(padded, 1, state->diagonal, p, state->omega2, q, out);
        return;
    }
    state->lanes->multiply(state->coupled, padded, p, modal_state_even(state->mode_count), out);
    for (size_t i = 0; i < padded; i++)
        out[i] += state->omega2[i] * q[i];
}

// The force of the present contact under a power law.
static ContactForce modal_state_power_force(const ModalState *state, const DamperState *damper) {
    const double sign = modal_state_sign(damper->side);
    return state->plan->law->force(&damper->contact, sign * damper->r, sign * damper->w);
}

double modal_state_constraint(const ModalState *state, size_t d, const double *elastic,
                              double ground) {
    double force = 0;
    for (size_t e = 0; e < state->dampers; e++)
        if (state->damper[e].phase == PHASE_RESTING)
            force += state->constraint_mass[d * state->dampers + e] *
                     (modal_state_dot(state->damper[e].shape, elastic, state->mode_count) +
                      state->damper[e].base_coupling * ground);
    return force;
}

void modal_state_gather(const ModalState *state, double *y) {
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(y, state->q, n * sizeof *y);
    memcpy(y + n, state->p, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        y[2 * n + d] = state->damper[d].r;
        y[2 * n + m + d] = state->damper[d].w;
    }
}

void modal_state_scatter(ModalState *state, const double *y) {
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(state->q, y, n * sizeof *y);
    memcpy(state->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        state->damper[d].r = y[2 * n + d];
        state->damper[d].w = y[2 * n + m + d];
    }
}

void modal_state_forces(ModalState *state) {
    modal_state_elastic(state, state->q, state->p, state->elastic);
    if (state->residual_influence != NULL)
        state->elastic[state->mode_count] = state->base_acceleration;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->force = 0;
        if (damper->phase == PHASE_CONTACT && state->plan->form == CONTACT_POWER)
            damper->force =
                modal_state_sign(damper->side) * modal_state_power_force(state, damper).value;
        else if (damper->phase == PHASE_CONTACT)
            damper->force =
                damper->contact.stiffness * damper->r + damper->contact.damping * damper->w;
        else if (damper->phase == PHASE_RESTING)
            damper->force =
                modal_state_constraint(state, d, state->elastic, state->base_acceleration);
    }
}

double *modal_state_expand(const ModalState *state, const double *modal, size_t rows) {
    const size_t slots = modal_state_even(state->slot_count);
    if (rows == 1)
        state->lanes->multiply(state->shape_matrix, state->tall, modal, slots,
                               state->storey_values);
    else
        state->lanes->multiply_four(state->shape_matrix, state->tall, modal, state->padded, slots,
                                    state->storey_values);
    return state->storey_values;
}

double modal_state_difference(const ModalState *state, const double *q, const double *other,
                              double least) {
    double bound = 0;
    for (size_t i = 0; i < state->mode_count; i++) {
        state->difference[i] = q[i] - other[i];
        bound += state->max_shape[i] * fabs(state->difference[i]);
    }
    if (bound <= least)
        return least;
    const double *values = modal_state_expand(state, state->difference, 1);
    for (size_t j = 0; j < state->storey_count; j++)
        least = fmax(least, fabs(values[j]));
    return least;
}

double modal_state_acceleration(const ModalState *state, size_t d) {
    const DamperState *damper = &state->damper[d];
    double sum = damper->base_coupling * state->base_acceleration +
                 modal_state_dot(damper->shape, state->elastic, state->mode_count);
    for (size_t e = 0; e < state->dampers; e++)
        sum -= state->delassus[d * state->dampers + e] * state->damper[e].force;
    return sum;
}

EnergyState modal_state_energy(const ModalState *state) {
    EnergyState energy = {0.5 * modal_state_dot(state->p, state->p, state->mode_count), 0};
    for (size_t i = 0; i < state->mode_count; i++)
        energy.strain += 0.5 * state->omega2[i] * state->q[i] * state->q[i];
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double z = modal_state_dot(damper->shape, state->p, state->mode_count) + damper->w;
        energy.kinetic += 0.5 * damper->plan->mass * z * z;
        if (damper->phase == PHASE_CONTACT && state->plan->form == CONTACT_POWER)
            energy.strain += modal_state_power_force(state, damper).strain;
        else if (damper->phase == PHASE_CONTACT)
            energy.strain += 0.5 * damper->contact.stiffness * damper->r * damper->r;
    }
    return energy;
}

double modal_state_size_of(const ModalState *state, const double *q, const double *p) {
    double squares[4] = {0, 0, 0, 0};
    size_t i = 0;
    for (; i + 2 <= state->mode_count; i += 2)
        for (size_t j = 0; j < 2; j++) {
            squares[j] += p[i + j] * p[i + j];
            squares[2 + j] += state->omega2[i + j] * q[i + j] * q[i + j];
        }
    if (i < state->mode_count)
        squares[0] += p[i] * p[i] + state->omega2[i] * q[i] * q[i];
    return sqrt((squares[0] + squares[1]) + (squares[2] + squares[3]));
}

// With lambda^2 + c lambda + k = 0 for the Rayleigh quotients c and k of any mode, |lambda| is at
// most the larger of c and sqrt(k); a contact adds to each quotient no more than its own over m_e.
double modal_state_rate(const ModalState *state) {
    double stiff = state->stiff, viscous = state->viscous;
    bool is_touching = false;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        if (damper->phase != PHASE_CONTACT)
            continue;
        is_touching = true;
        stiff += damper->contact.stiffness / damper->effective_mass;
        viscous += damper->contact.damping / damper->effective_mass;
    }
    return is_touching ? fmax(fmax(sqrt(stiff), viscous), state->rate) : state->rate;
}

// constraint_mass is the inverse of delassus among the dampers at rest, and 0 elsewhere.
void modal_state_constrain(ModalState *state) {
    const size_t n = state->dampers;
    double *left = state->scratch, *right = state->constraint_mass;
    state->resting = 0;
    for (size_t i = 0; i < n; i++) {
        const bool is_resting = state->damper[i].phase == PHASE_RESTING;
        state->resting += is_resting;
        for (size_t j = 0; j < n; j++) {
            const bool are_resting = is_resting && state->damper[j].phase == PHASE_RESTING;
            left[i * n + j] = are_resting ? state->delassus[i * n + j] : i == j;
            right[i * n + j] = is_resting && i == j;
        }
    }
    if (state->resting > 0)
        (void)linear_system_solve(left, right, n, n); // positive definite
}

// (M^-1)_jk from the modes; 0 where it is only rounding, so that an impact on one storey does not
// move a mass that rests on another.
static double modal_state_mobility(const Modes *modes, size_t j, size_t k) {
    const double *a = modes->shapes + j * modes->count, *b = modes->shapes + k * modes->count;
    long double sum = 0, size = 0;
    for (size_t i = 0; i < modes->count; i++) {
        const long double term = (long double)a[i] * b[i];
        sum += term;
        size += fabsl(term);
    }
    return fabsl(sum) <= 4 * DBL_EPSILON * size ? 0 : (double)sum;
}

static void modal_state_make_damper(ModalState *state, size_t d) {
    const Plan *plan = state->plan;
    const size_t n = state->mode_count, storeys = state->storey_count;
    DamperState *damper = &state->damper[d];
    const PlanDamper *planned = &plan->dampers[d];
    *damper = (DamperState){
        .plan = planned,
        .shape = state->shapes + d * state->padded,
        .base_coupling =
            plan->influence[planned->storey] - 1 -
            (state->residual_influence != NULL ? state->residual_influence[planned->storey] : 0),
        .phase = PHASE_FLIGHT,
        .origin = FROM_MIDDLE,
        .r = planned->position,
        .w = planned->velocity};
    memcpy(state->shapes + d * state->padded, state->modes->shapes + planned->storey * n,
           n * sizeof *state->shapes);
    for (size_t j = 0; j < storeys; j++) {
        state->mobility[d * storeys + j] = modal_state_mobility(state->modes, planned->storey, j);
        damper->max_mobility = fmax(damper->max_mobility, fabs(state->mobility[d * storeys + j]));
    }
    for (size_t e = 0; e < state->dampers; e++)
        state->delassus[d * state->dampers + e] =
            modal_state_mobility(state->modes, planned->storey, plan->dampers[e].storey) +
            (d == e ? 1 / planned->mass : 0);
    damper->effective_mass = 1 / state->delassus[d * state->dampers + d];
    double stiff = 0, size = 0;
    for (size_t i = 0; i < n; i++) {
        state->momentum_weights[i] += planned->mass * damper->shape[i];
        stiff += damper->shape[i] * damper->shape[i] * state->omega2[i];
        size += damper->shape[i] * damper->shape[i];
    }
    damper->elastic_bound = sqrt(stiff) + sqrt(size) * state->viscous;
}

// Growth rate of the energy over the largest damping of a mode: a scene's damping dissipates but
// for rounding.
static const double NEARLY = 1e-9;

// D, which need not be symmetric, and its norm.
static Status modal_state_make_damping(ModalState *state) {
    const size_t n = state->mode_count;
    const double *damping = state->damping = state->modes->damping;
    double rows = 0, columns = 0, squares = 0, largest = 0;
    for (size_t i = 0; i < n; i++) {
        double row = 0, column = 0;
        for (size_t j = 0; j < n; j++) {
            row += fabs(damping[i * n + j]);
            column += fabs(damping[j * n + i]);
            squares += damping[i * n + j] * damping[i * n + j];
        }
        rows = fmax(rows, row);
        columns = fmax(columns, column);
        state->diagonal[i] = damping[i * n + i];
        largest = fmax(largest, state->diagonal[i]);
    }
    state->viscous = fmin(sqrt(rows * columns), sqrt(squares));
    state->growth = NEARLY * largest;
    if (state->modes->is_classical)
        return STATUS_OK;
    state->diagonal = NULL;
    state->coupled = calloc(modal_state_even(n) * state->padded, sizeof *state->coupled);
    if (state->coupled == NULL)
        return STATUS_NO_MEMORY;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            state->coupled[j * state->padded + i] = damping[i * n + j];
    return STATUS_OK;
}

// q = shapes' M x, as the modes are normalised. `momentum` is scratch.
static void modal_state_make_modal(const ModalState *state, const double *values,
                                   long double *momentum, double *modal) {
    const size_t n = state->mode_count, storeys = state->storey_count;
    for (size_t j = 0; j < storeys; j++) {
        momentum[j] = 0;
        for (size_t k = 0; k < storeys; k++)
            momentum[j] += (long double)state->plan->mass[j * storeys + k] * values[k];
    }
    for (size_t i = 0; i < n; i++) {
        long double sum = 0;
        for (size_t j = 0; j < storeys; j++)
            sum += state->modes->shapes[j * n + i] * momentum[j];
        modal[i] = (double)sum;
    }
}

static Status modal_state_allocate(ModalState *state) {
    const size_t n = state->padded, m = state->dampers, tall = state->tall;
    const SimdArray arrays[] = {
        {&state->omega2, n},
        {&state->diagonal, n},
        {&state->momentum_weights, n},
        {&state->participation, n},
        {&state->q, n},
        {&state->p, n},
        {&state->elastic, n},
        {&state->max_shape, n},
        {&state->max_drift, n},
        {&state->base_shear, n},
        {&state->max_base_shear, n},
        {&state->shapes, m * n},
        {&state->shape_matrix, modal_state_even(state->slot_count) * tall},
        {&state->storey_values, FLIGHT_ROWS * tall},
        {&state->difference, n},
        {&state->largest, n},
        {&state->mobility, m * tall},
        {&state->delassus, m * m},
        {&state->constraint_mass, m * m},
        {&state->scratch, m * m},
        {&state->residual_influence, tall},
    };
    state->block = simd_kernels_allocate(arrays, COUNT(arrays));
    state->damper = calloc(m > 0 ? m : 1, sizeof *state->damper);
    return state->block == NULL || state->damper == NULL ? STATUS_NO_MEMORY : STATUS_OK;
}

// residual_influence; 0 where it is only rounding.
static void modal_state_make_residual(ModalState *state) {
    const size_t n = state->mode_count;
    double most = 0;
    for (size_t j = 0; j < state->storey_count; j++) {
        const double own = state->plan->influence[j];
        long double sum = own, size = fabs(own);
        for (size_t i = 0; i < n; i++) {
            const long double term =
                (long double)state->modes->shapes[j * n + i] * state->modes->participation[i];
            sum -= term;
            size += fabsl(term);
        }
        state->residual_influence[j] = fabsl(sum) <= 8 * DBL_EPSILON * size ? 0 : (double)sum;
        state->shape_matrix[n * state->tall + j] = -state->residual_influence[j];
        most = fmax(most, fabs(state->residual_influence[j]));
    }
    state->max_shape[n] = most;
    for (size_t j = 0; j < state->storey_count; j++)
        for (size_t k = 0; k < state->storey_count; k++)
            state->base_shear[n] -= state->plan->influence[j] *
                                    state->plan->mass[j * state->storey_count + k] *
                                    state->residual_influence[k];
}

// Copies of the modes, padded, and what follows from them.
static void modal_state_make_modes(ModalState *state) {
    const size_t n = state->mode_count;
    const Modes *modes = state->modes;
    for (size_t i = 0; i < n; i++) {
        state->omega2[i] = modes->omega[i] * modes->omega[i];
        state->stiff = fmax(state->stiff, state->omega2[i]);
        state->participation[i] = state->momentum_weights[i] = modes->participation[i];
        state->base_shear[i] = modes->participation[i];
        for (size_t j = 0; j < state->storey_count; j++) {
            const double shape = modes->shapes[j * n + i];
            const double below = j > 0 ? modes->shapes[(j - 1) * n + i] : 0;
            if (state->plan->has_drifts)
                state->max_drift[i] = fmax(state->max_drift[i], fabs(shape - below));
            state->max_shape[i] = fmax(state->max_shape[i], fabs(shape));
            state->shape_matrix[i * state->tall + j] = shape;
        }
    }
    if (state->slot_count > n)
        modal_state_make_residual(state);
    else
        state->residual_influence = NULL;
    for (size_t i = 0; i < state->slot_count; i++)
        state->max_base_shear[i] = fabs(state->base_shear[i]);
}

static void modal_state_start(ModalState *state, Run *run, Problem *problem) {
    const Plan *plan = run->plan;
    memset(state, 0, sizeof *state);
    state->run = run;
    state->has_stops = run->plan->damper_count > 0 && !run->is_clear;
    state->plan = plan;
    state->problem = problem;
    state->modes = plan->modes.count == 0 ? &state->own_modes : &plan->modes;
    state->lanes = &simd_kernels_kinds[simd_kernels_widest()];
    state->dampers = plan->damper_count;
    state->interval = 1 / plan->sample_rate;
    state->storey_count = plan->storeys;
    state->tall = simd_kernels_padded(plan->storeys);
    state->mode_count = plan->modes.count == 0 ? plan->storeys : plan->modes.count;
    state->slot_count = state->mode_count + plan->is_truncated;
    state->padded = simd_kernels_padded(state->slot_count);
}

Status modal_state_make(ModalState *state, Run *run, Problem *problem) {
    const Plan *plan = run->plan;
    const size_t n = plan->storeys;
    modal_state_start(state, run, problem);
    if (plan->modes.count == 0)
        TRY(modes_make(&state->own_modes, n, plan->mass, plan->stiffness, plan->damping,
                       plan->influence, problem));
    if (modal_state_allocate(state) != STATUS_OK || modal_state_make_damping(state) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    modal_state_make_modes(state);
    state->participation_norm = sqrt(modal_state_dot(
        state->modes->participation, state->modes->participation, state->mode_count));
    state->rate = fmax(fmax(sqrt(state->stiff), state->viscous), 1e-300);
    // During a shorter pulse there are only Taylor steps.
    state->base_omega = run->base->omega * state->interval <= 4 || run->base->form == BASE_SINE
                            ? run->base->omega
                            : 0;
    const long double turn = (long double)state->base_omega * state->interval;
    state->base_rotation[0] = (double)cosl(turn);
    state->base_rotation[1] = (double)sinl(turn);
    bool is_sound = isfinite(state->rate) && isfinite(run->base->omega);
    for (size_t d = 0; d < state->dampers; d++) {
        modal_state_make_damper(state, d);
        const double m = state->damper[d].effective_mass;
        is_sound = is_sound && m > 0 && isfinite(m);
    }
    if (!is_sound)
        return problem_set(
            problem, STATUS_UNSTABLE,
            "the scene's masses and stiffnesses are too far apart for double precision");
    long double *momentum = malloc(n * sizeof *momentum);
    if (momentum == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    modal_state_make_modal(state, plan->displacement, momentum, state->q);
    modal_state_make_modal(state, plan->velocity, momentum, state->p);
    free(momentum);
    base_cursor_make(&state->base, run->base, plan->sample_rate);
    state->base_acceleration = base_cursor_at(&state->base, 0);
    return STATUS_OK;
}

void modal_state_clear(ModalState *state) {
    modes_clear(&state->own_modes);
    free(state->damper);
    free(state->coupled);
    free(state->block);
}
