// Order after order, e_k being the coefficients of D q' + W^2 q and t = length s:
//   (k + 1)(k + 2) q_{k+2} = length^2 (-e_k - participation a_k + sum of shape_d N_dk)
//   (k + 1)(k + 2) r_{k+2} = length^2 (lean a_k + shape . e_k - sum over e of yield_de N_ek)
// with N_k = k r_k + c (k + 1) r_{k+1} / length in contact, and while resting hold . (lean a_k +
// shape . e_k), which makes r_{k+2} 0.
#include "core/solve/taylor_step.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROW = ROOT_DEGREE + 1, NODES = 8, MODES = 4 };

// s^k and its derivative.
static void powers(size_t degree, double s, double *power, double *slope) {
    power[0] = 1;
    slope[0] = 0;
    for (size_t k = 1; k <= degree; k++) {
        power[k] = power[k - 1] * s;
        slope[k] = (double)k * power[k - 1];
    }
}

Status frame_arc_room(FrameArc *arc, const Frame *frame, Problem *problem) {
    const size_t n = frame->padded, m = frame->dampers;
    arc->block = calloc(
        frame_lanes_room((ROW + 1 + NODES + 2) * n + (2 * ROW + 1) * m + ARC_RULES * NODES * ROW),
        sizeof *arc->block);
    if (arc->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                           frame->mode_count);
    arc->q = frame_lanes_start(arc->block);
    arc->work = arc->q + (ROW + 1) * n; // an order more is written than is kept
    arc->r = arc->work + (NODES + 2) * n;
    arc->force = arc->r + ROW * m;
    arc->slopes = arc->force + ROW * m + m;
    for (size_t kind = 0; kind < ARC_RULES; kind++) {
        const Quadrature *rule = &arc_rules[kind];
        for (size_t node = 0; node < rule->count; node++) {
            double power[ROW];
            powers(ROOT_DEGREE, rule->node[node], power, arc->slopes + (kind * NODES + node) * ROW);
        }
    }
    return STATUS_OK;
}

void frame_arc_clear(FrameArc *arc) {
    free(arc->block);
}

// The elastic forces e_k of all modes, what q_{k+2} is without the dampers, and what pushes these.
static void elastic_order(FrameArc *arc, const Frame *frame, size_t k, double scale, double *speed,
                          double *elastic, double *push) {
    const size_t n = frame->padded;
    const double *q = arc->q + k * n;
    const FrameOrder order = {.padded = n,
                              .dampers = frame->dampers,
                              .viscous = frame->diagonal,
                              .omega2 = frame->omega2,
                              .share = frame->share,
                              .shapes = frame->shapes,
                              .q = q,
                              .per_time = (double)(k + 1) / arc->length,
                              .base = arc->base[k],
                              .scale = scale,
                              .elastic = elastic,
                              .after = arc->q + (k + 2) * n,
                              .push = push};
    if (frame->diagonal == NULL) {
        for (size_t i = 0; i < n; i++)
            speed[i] = order.per_time * q[n + i];
        frame_elastic(frame, q, speed, elastic);
    }
    frame->lanes->order(&order);
}

// N of order k of all dampers, from the orders of r up to k + 1 and from shape . e_k.
static void forces(FrameArc *arc, const Frame *frame, size_t k, double *push) {
    const size_t m = frame->dampers;
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double *r = arc->r + d * ROW;
        push[d] += damper->lean * arc->base[k];
        arc->force[d * ROW + k] =
            damper->phase == FRAME_CONTACT
                ? damper->contact.stiffness * r[k] +
                      damper->contact.damping * (double)(k + 1) * r[k + 1] / arc->length
                : 0;
    }
    for (size_t d = 0; d < m && frame->resting > 0; d++) {
        if (frame->damper[d].phase != FRAME_RESTING)
            continue;
        for (size_t e = 0; e < m; e++)
            arc->force[d * ROW + k] += frame->hold[d * m + e] * push[e];
    }
}

// What the dampers do to order k + 2.
static void answer(FrameArc *arc, const Frame *frame, size_t k, double scale, const double *push) {
    const size_t n = frame->padded, m = frame->dampers;
    double *restrict after = arc->q + (k + 2) * n;
    for (size_t d = 0; d < m; d++) {
        const double force = arc->force[d * ROW + k] * scale, *shape = frame->damper[d].shape;
        double sum = push[d];
        for (size_t e = 0; e < m; e++)
            sum -= frame->yield[d * m + e] * arc->force[e * ROW + k];
        arc->r[d * ROW + k + 2] = frame->damper[d].phase == FRAME_RESTING ? 0 : sum * scale;
        if (force != 0)
            for (size_t i = 0; i < n; i++)
                after[i] += shape[i] * force;
    }
}

void frame_arc_make(FrameArc *arc, const Frame *frame, const Slice *slice, double length) {
    const size_t n = frame->padded, m = frame->dampers;
    arc->length = length;
    arc->rho = length * fmax(frame_rate(frame), slice->omega);
    arc->degree = arc_degree(arc->rho);
    arc_base_series(arc->base, arc->degree, slice, length);
    arc->base_degree = slice->omega > 0 ? arc->degree : 1;
    double *speed = arc->work, *elastic = arc->work + n, *push = arc->force + ROW * m;
    for (size_t i = 0; i < n; i++) {
        arc->q[i] = frame->q[i];
        arc->q[n + i] = frame->p[i] * length;
    }
    for (size_t d = 0; d < m; d++) {
        const bool is_resting = frame->damper[d].phase == FRAME_RESTING;
        arc->r[d * ROW] = is_resting ? 0 : frame->damper[d].r;
        arc->r[d * ROW + 1] = is_resting ? 0 : frame->damper[d].w * length;
    }
    for (size_t k = 0; k < arc->degree; k++) {
        const double scale = length * length / (double)((k + 1) * (k + 2));
        elastic_order(arc, frame, k, scale, speed, elastic, push);
        forces(arc, frame, k, push);
        if (k + 2 <= arc->degree)
            answer(arc, frame, k, scale, push);
    }
}

void frame_arc_cut(FrameArc *arc, const Frame *frame, double s) {
    double power = 1;
    for (size_t k = 0; k <= arc->degree; k++, power *= s) {
        for (size_t i = 0; i < frame->padded; i++)
            arc->q[k * frame->padded + i] *= power;
        for (size_t d = 0; d < frame->dampers; d++) {
            arc->r[d * ROW + k] *= power;
            if (k < arc->degree)
                arc->force[d * ROW + k] *= power;
        }
        arc->base[k] *= power;
    }
    arc->length *= s;
    arc->rho *= s;
}

void frame_arc_state(const FrameArc *arc, Frame *frame, double s) {
    const size_t n = frame->padded;
    double factors[2 * ROW], *const power = factors, *const slope = factors + ROW;
    // Small terms first, and by powers rather than Horner's scheme, where s is 1.
    powers(arc->degree, s, power, slope);
    frame->lanes->series(n, arc->degree, arc->q, 2, factors, ROW, arc->work);
    memcpy(frame->q, arc->work, n * sizeof *arc->work);
    for (size_t i = 0; i < n; i++)
        frame->p[i] = arc->work[n + i] / arc->length;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper->phase == FRAME_RESTING)
            continue;
        const double *r = frame_arc_r(arc, d);
        damper->r = damper->w = 0;
        for (size_t k = arc->degree; k > 0; k--) {
            damper->r += power[k] * r[k];
            damper->w += slope[k] * r[k];
        }
        damper->r += r[0];
        damper->w /= arc->length;
    }
    frame->ground = root_value(arc->base, arc->base_degree, s);
}

// The derivatives of s^k at a rule's nodes, node after node; after an odd one's last come zeros.
static const double *node_slopes(const FrameArc *arc, const Quadrature *rule) {
    return arc->slopes + (size_t)(rule - arc_rules) * NODES * ROW;
}

// The derivative of a series at a node.
static double slope_of(const FrameArc *arc, const double *series, const double *slope) {
    return frame_dot(series + 1, slope + 1, arc->degree);
}

// p . D p at all nodes.
static void damping_power(const Frame *frame, const double *p, size_t count, double *scratch,
                          double *power) {
    const size_t n = frame->padded;
    if (frame->diagonal != NULL) {
        frame->lanes->weigh(n, count, frame->diagonal, p, power);
        return;
    }
    for (size_t j = 0; j < count; j++, p += n) {
        frame->lanes->multiply(frame->coupled, n, p, frame->mode_count + frame->mode_count % 2,
                               scratch);
        frame->lanes->dot(n, 1, scratch, p, &power[j]);
    }
}

FrameWork frame_arc_work(const FrameArc *arc, const Frame *frame) {
    FrameWork work = {0, 0, arc->length * arc_integral(arc->base, arc->base_degree)};
    if (!(arc->length > 0))
        return work;
    const size_t n = frame->padded;
    const Quadrature *rule = arc_quadrature(arc->rho);
    const double *slopes = node_slopes(arc, rule);
    double *p = arc->work, power[NODES], momentum[NODES]; // times the arc's length
    frame->lanes->series(n, arc->degree, arc->q, rule->count, slopes, ROW, p);
    damping_power(frame, p, rule->count, p + NODES * n, power);
    for (size_t j = 0; j < rule->count; j++)
        work.damping += rule->weight[j] * power[j] / arc->length;
    if (arc->base[0] == 0 && arc->base[1] == 0)
        return work;
    frame->lanes->dot(n, rule->count, frame->carry, p, momentum);
    for (size_t j = 0; j < rule->count; j++) {
        for (size_t d = 0; d < frame->dampers; d++)
            momentum[j] +=
                frame->damper[d].plan->mass * slope_of(arc, frame_arc_r(arc, d), slopes + j * ROW);
        work.input -=
            rule->weight[j] * root_value(arc->base, arc->base_degree, rule->node[j]) * momentum[j];
    }
    return work;
}

void frame_arc_contact(const FrameArc *arc, const Frame *frame, size_t d, double *impulse,
                       double *lost) {
    const FrameDamper *damper = &frame->damper[d];
    *impulse = arc->length * arc_integral(frame_arc_force(arc, d), arc->degree - 1);
    *lost = 0;
    if (damper->phase != FRAME_CONTACT || damper->contact.damping == 0)
        return;
    const Quadrature *rule = arc_quadrature(arc->rho);
    for (size_t j = 0; j < rule->count; j++) {
        const double w = slope_of(arc, frame_arc_r(arc, d), node_slopes(arc, rule) + j * ROW);
        *lost += rule->weight[j] * w * w;
    }
    *lost *= damper->contact.damping / arc->length;
}
