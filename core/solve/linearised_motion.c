// Between events a small change y of the state (q, p, r, w) follows the system without its base, so
// its step is the run's own Taylor step from y. An event where g(state) = 0 comes late by
//
//     late = -(g' y) / (dg/dt),
//
// and the motion, f before and F after the event, which maps the state by R, makes of y
//
//     R' (y + f late) - F late
//
// (saltation: Aizerman and Gantmakher 1958; Leine and Nijmeijer 2004, section 7). R is linear: the
// same stops press as in the event itself. Not followed: contact parameters that depend on the
// approach speed.
#include "core/solve/engine.h"

#include <stdlib.h>
#include <string.h>

Status linearised_motion_make(LinearisedMotion *motion, const ModalState *state, Problem *problem) {
    memset(motion, 0, sizeof *motion);
    motion->size = 2 * (state->mode_count + state->dampers);
    const SimdArray arrays[] = {
        {&motion->late, motion->size},  {&motion->before, motion->size},
        {&motion->after, motion->size}, {&motion->squares, state->storey_count},
        {&motion->state, motion->size}, {&motion->work, state->padded},
    };
    motion->block = simd_kernels_allocate(arrays, COUNT(arrays));
    motion->phases = calloc(state->dampers + 1, sizeof *motion->phases);
    if (motion->block == NULL || motion->phases == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the linearised motion");
    return taylor_step_allocate(&motion->arc, state, problem);
}

void linearised_motion_clear(LinearisedMotion *motion) {
    taylor_step_clear(&motion->arc);
    free(motion->phases);
    free(motion->block);
}

// The run's own state gives way to columns, and returns.
static void linearised_motion_save(LinearisedMotion *motion, const ModalState *state) {
    modal_state_gather(state, motion->state);
    motion->base_acceleration = state->base_acceleration;
}

static void linearised_motion_restore(const LinearisedMotion *motion, ModalState *state) {
    modal_state_scatter(state, motion->state);
    state->base_acceleration = motion->base_acceleration;
}

// Displacement of a storey as a polynomial over a step.
static void linearised_motion_measure(LinearisedMotion *motion, size_t storey, const double *c,
                                      size_t degree, double rho, double length) {
    double s;
    const Quadrature *rule = linear_motion_quadrature(rho);
    motion->peak = linear_motion_largest(c, degree, motion->peak, &s);
    for (size_t k = 0; k < rule->count; k++) {
        const double x = polynomial_value(c, degree, rule->node[k]);
        motion->squares[storey] += length * rule->weight[k] * x * x;
    }
}

static void linearised_motion_measure_arc(LinearisedMotion *motion, const ModalState *state,
                                          const TaylorStep *arc) {
    const size_t n = state->mode_count;
    for (size_t j = 0; j < state->storey_count; j++) {
        double c[POLYNOMIAL_DEGREE_MAX + 1];
        for (size_t k = 0; k <= arc->degree; k++)
            c[k] = modal_state_dot(state->modes->shapes + j * n, arc->q + k * state->padded, n);
        linearised_motion_measure(motion, j, c, arc->degree, arc->rho, arc->length);
    }
}

void linearised_motion_step(LinearisedMotion *motion, ModalState *state, const TaylorStep *arc) {
    if (motion->is_measured)
        linearised_motion_measure_arc(motion, state, arc);
    if (motion->count == 0)
        return;
    linearised_motion_save(motion, state);
    for (size_t i = 0; i < motion->count; i++) {
        double *y = motion->columns + i * motion->size;
        modal_state_scatter(state, y);
        taylor_step_make(&motion->arc, state, &(Slice){0, 0, 0}, arc->length);
        taylor_step_state(&motion->arc, state, 1);
        modal_state_gather(state, y);
    }
    linearised_motion_restore(motion, state);
}

void linearised_motion_begin_step(LinearisedMotion *motion, const ModalState *state) {
    linearised_motion_save(motion, state);
}

void linearised_motion_end_step(LinearisedMotion *motion, const ModalState *state, double length) {
    const size_t n = state->mode_count;
    for (size_t j = 0; j < state->storey_count && motion->is_measured; j++) {
        const double *shape = state->modes->shapes + j * n;
        const double x = modal_state_dot(shape, motion->state, n),
                     slope = length * modal_state_dot(shape, motion->state + n, n),
                     moved = modal_state_dot(shape, state->q, n) - x,
                     end = length * modal_state_dot(shape, state->p, n);
        const double c[] = {x, slope, 3 * moved - 2 * slope - end, slope + end - 2 * moved};
        linearised_motion_measure(motion, j, c, COUNT(c) - 1, 1, length);
    }
}

// The derivative of the state, after modal_state_forces.
static void linearised_motion_rates(const ModalState *state, double *rates) {
    const size_t n = state->mode_count, m = state->dampers;
    memcpy(rates, state->p, n * sizeof *rates);
    for (size_t i = 0; i < n; i++) {
        double sum = -state->elastic[i] - state->participation[i] * state->base_acceleration;
        for (size_t d = 0; d < m; d++)
            sum += state->damper[d].shape[i] * state->damper[d].force;
        rates[n + i] = sum;
    }
    for (size_t d = 0; d < m; d++) {
        const bool is_resting = state->damper[d].phase == PHASE_RESTING;
        rates[2 * n + d] = is_resting ? 0 : state->damper[d].w;
        rates[2 * n + m + d] = is_resting ? 0 : modal_state_acceleration(state, d);
    }
}

// Change of g, which is 0 at the event, by a change of the state and of a_g.
static double linearised_motion_gap(const LinearisedMotion *motion, ModalState *state,
                                    const ContactEvent *event, const double *y, double ground) {
    const size_t n = state->mode_count, m = state->dampers, d = event->damper;
    const DamperState *damper = &state->damper[d];
    const double r = y[2 * n + d], w = y[2 * n + m + d];
    const bool by_force = damper->phase == PHASE_CONTACT
                              ? state->plan->separation == SEPARATION_ZERO_FORCE
                              : damper->phase == PHASE_INSIDE && event->is_inwards;
    if (damper->phase != PHASE_RESTING)
        return by_force ? damper->contact.stiffness * r + damper->contact.damping * w : r;
    memcpy(state->q, y, n * sizeof *y);
    memcpy(state->p, y + n, n * sizeof *y);
    modal_state_elastic(state, state->q, state->p, motion->work);
    return modal_state_constraint(state, d, motion->work, ground);
}

void linearised_motion_begin_event(LinearisedMotion *motion, ModalState *state,
                                   const ContactEvent *event) {
    modal_state_forces(state);
    if (motion->count == 0)
        return;
    for (size_t d = 0; d < state->dampers; d++)
        motion->phases[d] = state->damper[d].phase;
    linearised_motion_rates(state, motion->before);
    if (event->is_jump)
        return; // follows another event, which made it late
    Slice slice;
    (void)base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    linearised_motion_save(motion, state);
    const double rate =
        linearised_motion_gap(motion, state, event, motion->before,
                              slice.omega > 0 ? slice.omega * slice.slope : slice.slope);
    for (size_t i = 0; i < motion->count; i++) {
        const double change =
            linearised_motion_gap(motion, state, event, motion->columns + i * motion->size, 0);
        motion->late[i] = change != 0 ? -change / rate : 0;
    }
    linearised_motion_restore(motion, state);
}

static bool linearised_motion_has_stopped(const LinearisedMotion *motion, const ModalState *state,
                                          size_t d) {
    return state->damper[d].phase == PHASE_RESTING && motion->phases[d] != PHASE_RESTING;
}

// The change of all speeds by the collision of the dampers that bounced, or of those that stopped,
// with those that rest through it.
static void linearised_motion_collide(const LinearisedMotion *motion, ModalState *state,
                                      bool is_bounce) {
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        const bool has_stopped = linearised_motion_has_stopped(motion, state, d),
                   hits = is_bounce ? damper->is_bounced : has_stopped;
        damper->is_pressing = hits || (damper->phase == PHASE_RESTING && !has_stopped);
        damper->approach_speed = hits ? modal_state_sign(damper->side) * damper->w : 0;
        damper->separation_speed =
            is_bounce ? damper->contact.restitution * damper->approach_speed : 0;
        if (has_stopped && !is_bounce)
            damper->r = 0;
    }
    collision_transmit(state);
}

void linearised_motion_end_event(LinearisedMotion *motion, ModalState *state,
                                 const ContactEvent *event) {
    if (motion->count == 0)
        return;
    modal_state_forces(state);
    linearised_motion_rates(state, motion->after);
    const DamperState *hit = &state->damper[event->damper];
    const bool is_hit = state->plan->form == CONTACT_IMPULSIVE &&
                        motion->phases[event->damper] == PHASE_FLIGHT,
               is_bounce = is_hit && hit->plan->clearance > 0;
    bool has_stopped = false;
    for (size_t d = 0; d < state->dampers; d++)
        has_stopped = has_stopped || (is_hit && linearised_motion_has_stopped(motion, state, d));
    linearised_motion_save(motion, state);
    for (size_t i = 0; i < motion->count; i++) {
        double *y = motion->columns + i * motion->size;
        for (size_t k = 0; k < motion->size; k++)
            y[k] += motion->before[k] * motion->late[i];
        modal_state_scatter(state, y);
        if (is_bounce)
            linearised_motion_collide(motion, state, true);
        if (has_stopped)
            linearised_motion_collide(motion, state, false);
        modal_state_gather(state, y);
        for (size_t k = 0; k < motion->size; k++)
            y[k] -= motion->after[k] * motion->late[i];
    }
    linearised_motion_restore(motion, state);
}
