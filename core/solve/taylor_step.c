// The coefficients of order k + 2 follow from those of lower orders. With e_k of D q' + W^2 q and
// t = length s:
//   (k + 1)(k + 2) q_{k+2} = length^2 (-e_k - participation a_k + sum of shape_d N_dk)
//   (k + 1)(k + 2) r_{k+2} = length^2 (base_coupling a_k + shape . e_k - sum over e of delassus_de
//   N_ek)
// with N_k = k r_k + c (k + 1) r_{k+1} / length in contact. At rest N_k = constraint_mass .
// (base_coupling a_k + shape . e_k), which makes r_{k+2} 0.
#include "core/solve/engine.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROW = POLYNOMIAL_DEGREE_MAX + 1, NODES = 8, MODES = 4 };

// s^k and its derivative.
static void taylor_step_powers(size_t degree, double s, double *power, double *slope) {
    power[0] = 1;
    slope[0] = 0;
    for (size_t k = 1; k <= degree; k++) {
        power[k] = power[k - 1] * s;
        slope[k] = (double)k * power[k - 1];
    }
}

Status taylor_step_allocate(TaylorStep *arc, const ModalState *state, Problem *problem) {
    const size_t n = state->padded, m = state->dampers;
    const SimdArray arrays[] = {
        {&arc->q, (ROW + 1) * n}, // one order more is written than kept
        {&arc->work, (NODES + 2) * n},
        {&arc->r, ROW * m},
        {&arc->force, ROW * m},
        {&arc->push, m},
        {&arc->slopes, LINEAR_MOTION_RULES * NODES * ROW},
    };
    arc->block = simd_kernels_allocate(arrays, COUNT(arrays));
    if (arc->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                           state->mode_count);
    for (size_t kind = 0; kind < LINEAR_MOTION_RULES; kind++) {
        const Quadrature *rule = &linear_motion_rules[kind];
        for (size_t node = 0; node < rule->count; node++) {
            double power[ROW];
            taylor_step_powers(POLYNOMIAL_DEGREE_MAX, rule->node[node], power,
                               arc->slopes + (kind * NODES + node) * ROW);
        }
    }
    return STATUS_OK;
}

void taylor_step_clear(TaylorStep *arc) {
    free(arc->block);
}

// The elastic forces e_k of all modes, q_{k+2} without the dampers, and shape . e_k of the dampers.
static void taylor_step_make_elastic(TaylorStep *arc, const ModalState *state, size_t k,
                                     double scale, double *speed, double *elastic, double *push) {
    const size_t n = state->padded;
    const double *q = arc->q + k * n;
    const TaylorOrder order = {.padded = n,
                               .dampers = state->dampers,
                               .viscous = state->diagonal,
                               .omega2 = state->omega2,
                               .share = state->participation,
                               .shapes = state->shapes,
                               .q = q,
                               .per_time = (double)(k + 1) / arc->length,
                               .base = arc->base[k],
                               .scale = scale,
                               .elastic = elastic,
                               .after = arc->q + (k + 2) * n,
                               .push = push};
    if (state->diagonal == NULL) {
        for (size_t i = 0; i < n; i++)
            speed[i] = order.per_time * q[n + i];
        modal_state_elastic(state, q, speed, elastic);
    }
    state->lanes->order(&order);
}

// N of order k of all dampers. `push` holds shape . e_k and becomes r'' without N.
static void taylor_step_make_forces(TaylorStep *arc, const ModalState *state, size_t k,
                                    double *push) {
    const size_t m = state->dampers;
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double *r = arc->r + d * ROW;
        push[d] += damper->base_coupling * arc->base[k];
        arc->force[d * ROW + k] =
            damper->phase == PHASE_CONTACT
                ? damper->contact.stiffness * r[k] +
                      damper->contact.damping * (double)(k + 1) * r[k + 1] / arc->length
                : 0;
    }
    for (size_t d = 0; d < m && state->resting > 0; d++) {
        if (state->damper[d].phase != PHASE_RESTING)
            continue;
        for (size_t e = 0; e < m; e++)
            arc->force[d * ROW + k] += state->constraint_mass[d * m + e] * push[e];
    }
}

// Order k + 2 of r, and the part of the dampers in that of q.
static void taylor_step_make_order(TaylorStep *arc, const ModalState *state, size_t k, double scale,
                                   const double *push) {
    const size_t n = state->padded, m = state->dampers;
    double *restrict after = arc->q + (k + 2) * n;
    for (size_t d = 0; d < m; d++) {
        const double force = arc->force[d * ROW + k] * scale, *shape = state->damper[d].shape;
        double sum = push[d];
        for (size_t e = 0; e < m; e++)
            sum -= state->delassus[d * m + e] * arc->force[e * ROW + k];
        arc->r[d * ROW + k + 2] = state->damper[d].phase == PHASE_RESTING ? 0 : sum * scale;
        if (force != 0)
            for (size_t i = 0; i < n; i++)
                after[i] += shape[i] * force;
    }
}

static bool taylor_step_is_single(const ModalState *state) {
    return state->mode_count == 1 && state->dampers == 1 && state->diagonal != NULL;
}

// All orders of one mode and one damper: the same bytes as those of the loops below, in a third of
// the time, half of that of a motion followed by cycle_flow.h.
static void taylor_step_make_single(TaylorStep *arc, const ModalState *state) {
    const DamperState *damper = state->damper;
    const bool is_resting = damper->phase == PHASE_RESTING,
               touches = damper->phase == PHASE_CONTACT;
    const double length = arc->length, shape = damper->shape[0], viscous = state->diagonal[0],
                 omega2 = state->omega2[0], share = state->participation[0],
                 stiffness = damper->contact.stiffness, damping = damper->contact.damping;
    double *const r = arc->r, *const force = arc->force, *after = arc->q + 2 * state->padded;
    double q = arc->q[0], next = arc->q[state->padded];
    for (size_t k = 0; k < arc->degree; k++, after += state->padded) {
        const double order = (double)(k + 1), base = arc->base[k],
                     scale = length * length / (double)((k + 1) * (k + 2));
        const double elastic = viscous * (order / length * next) + omega2 * q;
        const double push = shape * elastic + damper->base_coupling * base;
        const double N = touches      ? stiffness * r[k] + damping * order * r[k + 1] / length
                         : is_resting ? state->constraint_mass[0] * push
                                      : 0;
        force[k] = N;
        q = next;
        next = -scale * (elastic + share * base);
        if (N != 0)
            next += shape * (N * scale);
        if (k + 2 <= arc->degree)
            r[k + 2] = is_resting ? 0 : (push - state->delassus[0] * N) * scale;
        *after = next;
    }
}

void taylor_step_make(TaylorStep *arc, const ModalState *state, const Slice *slice, double length) {
    const size_t n = state->padded, m = state->dampers;
    arc->length = length;
    arc->rho = length * fmax(modal_state_rate(state), slice->omega);
    if (arc->rho != arc->last_rho)
        arc->degree = linear_motion_degree(arc->rho);
    arc->last_rho = arc->rho;
    linear_motion_base_series(arc->base, arc->degree, slice, length);
    arc->base_degree = slice->omega > 0 ? arc->degree : 1;
    double *speed = arc->work, *elastic = arc->work + n, *push = arc->push;
    for (size_t i = 0; i < n; i++) {
        arc->q[i] = state->q[i];
        arc->q[n + i] = state->p[i] * length;
    }
    for (size_t d = 0; d < m; d++) {
        const bool is_resting = state->damper[d].phase == PHASE_RESTING;
        arc->r[d * ROW] = is_resting ? 0 : state->damper[d].r;
        arc->r[d * ROW + 1] = is_resting ? 0 : state->damper[d].w * length;
    }
    if (taylor_step_is_single(state)) {
        taylor_step_make_single(arc, state);
        return;
    }
    for (size_t k = 0; k < arc->degree; k++) {
        const double scale = length * length / (double)((k + 1) * (k + 2));
        taylor_step_make_elastic(arc, state, k, scale, speed, elastic, push);
        taylor_step_make_forces(arc, state, k, push);
        if (k + 2 <= arc->degree)
            taylor_step_make_order(arc, state, k, scale, push);
    }
}

void taylor_step_cut(TaylorStep *arc, const ModalState *state, double s) {
    double power = 1;
    for (size_t k = 0; k <= arc->degree; k++, power *= s) {
        for (size_t i = 0; i < state->padded; i++)
            arc->q[k * state->padded + i] *= power;
        for (size_t d = 0; d < state->dampers; d++) {
            arc->r[d * ROW + k] *= power;
            if (k < arc->degree)
                arc->force[d * ROW + k] *= power;
        }
        arc->base[k] *= power;
    }
    arc->length *= s;
    arc->rho *= s;
}

// The end of a step of one mode and one damper: the same bytes as those of the loops below.
static void taylor_step_end_single(const TaylorStep *arc, ModalState *state) {
    const double *r = arc->r, *q = arc->q + arc->degree * state->padded;
    double sum[4] = {0, 0, 0, 0};
    for (size_t k = arc->degree; k > 0; k--, q -= state->padded) {
        sum[0] += *q;
        sum[1] += (double)k * *q;
        sum[2] += r[k];
        sum[3] += (double)k * r[k];
    }
    state->q[0] = sum[0] + *q;
    state->p[0] = sum[1] / arc->length;
    if (state->damper->phase != PHASE_RESTING) {
        state->damper->r = sum[2] + r[0];
        state->damper->w = sum[3] / arc->length;
    }
    state->base_acceleration = polynomial_value(arc->base, arc->base_degree, 1);
}

void taylor_step_state(const TaylorStep *arc, ModalState *state, double s) {
    const size_t n = state->padded;
    if (s == 1 && taylor_step_is_single(state)) {
        taylor_step_end_single(arc, state);
        return;
    }
    double factors[2 * ROW], *const power = factors, *const slope = factors + ROW;
    // By powers rather than Horner's scheme, which adds the small terms first where s is 1.
    taylor_step_powers(arc->degree, s, power, slope);
    state->lanes->series(n, arc->degree, arc->q, 2, factors, ROW, arc->work);
    memcpy(state->q, arc->work, n * sizeof *arc->work);
    for (size_t i = 0; i < n; i++)
        state->p[i] = arc->work[n + i] / arc->length;
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (damper->phase == PHASE_RESTING)
            continue;
        const double *r = taylor_step_r(arc, d);
        damper->r = damper->w = 0;
        for (size_t k = arc->degree; k > 0; k--) {
            damper->r += power[k] * r[k];
            damper->w += slope[k] * r[k];
        }
        damper->r += r[0];
        damper->w /= arc->length;
    }
    state->base_acceleration = polynomial_value(arc->base, arc->base_degree, s);
}

// The derivatives of s^k at the nodes of a rule, node after node; zeros follow.
static const double *taylor_step_node_slopes(const TaylorStep *arc, const Quadrature *rule) {
    return arc->slopes + (size_t)(rule - linear_motion_rules) * NODES * ROW;
}

// The derivative of a series at a node.
static double taylor_step_slope(const TaylorStep *arc, const double *series, const double *slope) {
    return modal_state_dot(series + 1, slope + 1, arc->degree);
}

// p . D p at all nodes.
static void taylor_step_damping_power(const ModalState *state, const double *p, size_t count,
                                      double *scratch, double *power) {
    const size_t n = state->padded;
    if (state->diagonal != NULL) {
        state->lanes->weigh(n, count, state->diagonal, p, power);
        return;
    }
    for (size_t j = 0; j < count; j++, p += n) {
        state->lanes->multiply(state->coupled, n, p, state->mode_count + state->mode_count % 2,
                               scratch);
        state->lanes->dot(n, 1, scratch, p, &power[j]);
    }
}

StepWork taylor_step_work(const TaylorStep *arc, const ModalState *state) {
    StepWork work = {0, 0, arc->length * linear_motion_integral(arc->base, arc->base_degree)};
    if (!(arc->length > 0))
        return work;
    const size_t n = state->padded;
    const Quadrature *rule = linear_motion_quadrature(arc->rho);
    const double *slopes = taylor_step_node_slopes(arc, rule);
    double *p = arc->work, power[NODES], momentum[NODES]; // times the arc's length
    state->lanes->series(n, arc->degree, arc->q, rule->count, slopes, ROW, p);
    taylor_step_damping_power(state, p, rule->count, p + NODES * n, power);
    for (size_t j = 0; j < rule->count; j++)
        work.damping += rule->weight[j] * power[j] / arc->length;
    if (arc->base[0] == 0 && arc->base[1] == 0)
        return work;
    state->lanes->dot(n, rule->count, state->momentum_weights, p, momentum);
    for (size_t j = 0; j < rule->count; j++) {
        for (size_t d = 0; d < state->dampers; d++)
            momentum[j] += state->damper[d].plan->mass *
                           taylor_step_slope(arc, taylor_step_r(arc, d), slopes + j * ROW);
        work.input -= rule->weight[j] *
                      polynomial_value(arc->base, arc->base_degree, rule->node[j]) * momentum[j];
    }
    return work;
}

void taylor_step_contact(const TaylorStep *arc, const ModalState *state, size_t d, double *impulse,
                         double *lost) {
    const DamperState *damper = &state->damper[d];
    *impulse = arc->length * linear_motion_integral(taylor_step_force(arc, d), arc->degree - 1);
    *lost = 0;
    if (damper->phase != PHASE_CONTACT || damper->contact.damping == 0)
        return;
    const Quadrature *rule = linear_motion_quadrature(arc->rho);
    for (size_t j = 0; j < rule->count; j++) {
        const double w = taylor_step_slope(arc, taylor_step_r(arc, d),
                                           taylor_step_node_slopes(arc, rule) + j * ROW);
        *lost += rule->weight[j] * w * w;
    }
    *lost *= damper->contact.damping / arc->length;
}
