#include "core/solve/modal_state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/symmetric_matrix.h"

double modal_state_time(const ModalState *state) {
    return (double)state->sample / state->plan->sample_rate + state->offset;
}

double modal_state_clock(const ModalState *state) {
    return 4 * DBL_EPSILON * fmax(modal_state_time(state), state->interval);
}

double modal_state_room(const DamperState *damper, Side side) {
    if (damper->origin == FROM_MIDDLE)
        return damper->plan->clearance / 2;
    return damper->origin == (ContactOrigin)side ? 0 : damper->plan->clearance;
}

double modal_state_middle(const DamperState *damper) {
    const double stop = damper->plan->clearance / 2;
    const double origin =
        damper->origin == FROM_MIDDLE ? 0 : modal_state_sign((Side)damper->origin) * stop;
    return damper->plan->offset + origin;
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

// What a power law says of the present contact.
static ContactForce power_now(const ModalState *state, const DamperState *damper) {
    const double sign = modal_state_sign(damper->side);
    return state->plan->law->force(&damper->contact, sign * damper->r, sign * damper->w);
}

void modal_state_forces(ModalState *state) {
    modal_state_elastic(state, state->q, state->p, state->elastic);
    if (state->residual_influence != NULL)
        state->elastic[state->mode_count] = state->base_acceleration;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->force = 0;
        if (damper->phase == PHASE_CONTACT && state->plan->form == CONTACT_POWER)
            damper->force = modal_state_sign(damper->side) * power_now(state, damper).value;
        else if (damper->phase == PHASE_CONTACT)
            damper->force =
                damper->contact.stiffness * damper->r + damper->contact.damping * damper->w;
        if (damper->phase != PHASE_RESTING)
            continue;
        for (size_t e = 0; e < state->dampers; e++)
            if (state->damper[e].phase == PHASE_RESTING)
                damper->force +=
                    state->constraint_mass[d * state->dampers + e] *
                    (modal_state_dot(state->damper[e].shape, state->elastic, state->mode_count) +
                     state->damper[e].base_coupling * state->base_acceleration);
    }
}

const double *modal_state_expand_four(const ModalState *state, const double *modal) {
    state->lanes->multiply_four(state->shape_matrix, state->tall, modal, state->padded,
                                modal_state_even(state->slot_count), state->storey_values);
    return state->storey_values;
}

const double *modal_state_expand(const ModalState *state, const double *modal) {
    state->lanes->multiply(state->shape_matrix, state->tall, modal,
                           modal_state_even(state->slot_count), state->storey_values);
    return state->storey_values;
}

double modal_state_displacement(const ModalState *state, size_t storey) {
    return modal_state_dot(state->modes->shapes + storey * state->mode_count, state->q,
                           state->mode_count);
}

double modal_state_velocity(const ModalState *state, size_t storey) {
    return modal_state_dot(state->modes->shapes + storey * state->mode_count, state->p,
                           state->mode_count);
}

double modal_state_storey_acceleration(const ModalState *state, size_t storey) {
    const size_t n = state->mode_count;
    double sum = -modal_state_dot(state->modes->shapes + storey * n, state->elastic, n);
    if (state->residual_influence != NULL)
        sum += state->residual_influence[storey] * state->base_acceleration;
    for (size_t d = 0; d < state->dampers; d++)
        sum += state->mobility[d * state->storey_count + storey] * state->damper[d].force;
    return sum;
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
            energy.strain += power_now(state, damper).strain;
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

double modal_state_size(const ModalState *state) {
    return modal_state_size_of(state, state->q, state->p);
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

// The inverse of `yield` among the dampers that rest, by Gauss and Jordan; it is positive definite.
static void invert_hold(ModalState *state) {
    const size_t n = state->dampers;
    double *left = state->scratch, *right = state->constraint_mass;
    for (size_t i = 0; i < n; i++) {
        const bool is_held = state->damper[i].phase == PHASE_RESTING;
        for (size_t j = 0; j < n; j++) {
            const bool are_held = is_held && state->damper[j].phase == PHASE_RESTING;
            left[i * n + j] = are_held ? state->delassus[i * n + j] : i == j;
            right[i * n + j] = is_held && i == j;
        }
    }
    for (size_t k = 0; k < n; k++) {
        const double pivot = left[k * n + k];
        for (size_t j = 0; j < n; j++) {
            left[k * n + j] /= pivot;
            right[k * n + j] /= pivot;
        }
        for (size_t i = 0; i < n; i++) {
            const double factor = left[i * n + k];
            if (i == k || factor == 0)
                continue;
            for (size_t j = 0; j < n; j++) {
                left[i * n + j] -= factor * left[k * n + j];
                right[i * n + j] -= factor * right[k * n + j];
            }
        }
    }
}

void modal_state_constrain(ModalState *state) {
    state->resting = 0;
    for (size_t d = 0; d < state->dampers; d++)
        state->resting += state->damper[d].phase == PHASE_RESTING;
    if (state->resting > 0)
        invert_hold(state);
}
