// Order after order, e_k being the coefficients of D q' + W^2 q and t = length s:
//   (k + 1)(k + 2) q_{k+2} = length^2 (-e_k - participation a_k + sum of shape_d N_dk)
//   (k + 1)(k + 2) r_{k+2} = length^2 (lean a_k + shape . e_k - sum over e of yield_de N_ek)
// with N_k = k r_k + c (k + 1) r_{k+1} / length in contact, and while resting hold . (lean a_k +
// shape . e_k), which makes r_{k+2} 0.
#include "core/solve/frame_arc.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROW = ROOT_DEGREE + 1, NODES = 8 };

Status frame_arc_room(FrameArc *arc, const Frame *frame, Problem *problem) {
    const size_t n = frame->storeys, m = frame->dampers;
    arc->block = malloc(((ROW + NODES + 2) * n + 2 * ROW * m + m) * sizeof *arc->block);
    if (arc->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    arc->q = arc->block;
    arc->work = arc->q + ROW * n;
    arc->r = arc->work + (NODES + 2) * n;
    arc->force = arc->r + ROW * m;
    return STATUS_OK;
}

void frame_arc_clear(FrameArc *arc) {
    free(arc->block);
}

// N of order k of all dampers, from the orders of r up to k + 1 and from e_k.
static void forces(FrameArc *arc, const Frame *frame, size_t k, const double *elastic,
                   double *push) {
    const size_t m = frame->dampers;
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double *r = arc->r + d * ROW;
        push[d] = damper->lean * arc->base[k] + frame_dot(damper->shape, elastic, frame->storeys);
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

void frame_arc_make(FrameArc *arc, const Frame *frame, const Slice *slice, double length) {
    const size_t n = frame->storeys, m = frame->dampers;
    arc->length = length;
    arc->rho = length * fmax(frame_rate(frame), slice->omega);
    arc->degree = arc_degree(arc->rho);
    arc_base_series(arc->base, arc->degree, slice, length);
    double *restrict speed = arc->work, *elastic = arc->work + n, *push = arc->force + ROW * m;
    for (size_t i = 0; i < n; i++) {
        arc->q[i] = frame->q[i];
        arc->q[n + i] = frame->p[i] * length;
    }
    for (size_t d = 0; d < m; d++) {
        const bool is_resting = frame->damper[d].phase == FRAME_RESTING;
        arc->r[d * ROW] = is_resting ? 0 : frame->damper[d].r;
        arc->r[d * ROW + 1] = is_resting ? 0 : frame->damper[d].w * length;
    }
    const double *share = frame->modes->participation;
    for (size_t k = 0; k < arc->degree; k++) {
        const double *q = arc->q + k * n, *next = q + n;
        const double per_time = (double)(k + 1) / length;
        for (size_t i = 0; i < n; i++)
            speed[i] = per_time * next[i];
        frame_elastic(frame, q, speed, elastic);
        forces(arc, frame, k, elastic, push);
        if (k + 2 > arc->degree)
            break;
        const double scale = length * length / (double)((k + 1) * (k + 2));
        double *restrict after = arc->q + (k + 2) * n;
        for (size_t i = 0; i < n; i++)
            after[i] = -elastic[i] - share[i] * arc->base[k];
        for (size_t d = 0; d < m; d++) {
            const double force = arc->force[d * ROW + k], *shape = frame->damper[d].shape;
            double sum = push[d];
            for (size_t e = 0; e < m; e++)
                sum -= frame->yield[d * m + e] * arc->force[e * ROW + k];
            arc->r[d * ROW + k + 2] = frame->damper[d].phase == FRAME_RESTING ? 0 : sum * scale;
            if (force != 0)
                for (size_t i = 0; i < n; i++)
                    after[i] += shape[i] * force;
        }
        for (size_t i = 0; i < n; i++)
            after[i] *= scale;
    }
}

void frame_arc_cut(FrameArc *arc, const Frame *frame, double s) {
    double power = 1;
    for (size_t k = 0; k <= arc->degree; k++, power *= s) {
        for (size_t i = 0; i < frame->storeys; i++)
            arc->q[k * frame->storeys + i] *= power;
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
    const size_t n = frame->storeys;
    for (size_t i = 0; i < n; i++)
        frame->q[i] = frame->p[i] = 0;
    // Small terms first; by powers rather than Horner's scheme where s is 1.
    double power[ROW];
    power[0] = 1;
    for (size_t k = 1; k <= arc->degree; k++)
        power[k] = power[k - 1] * s;
    for (size_t k = arc->degree; k > 0; k--) {
        const double *q = arc->q + k * n;
        const double slope = (double)k * power[k - 1];
        for (size_t i = 0; i < n; i++) {
            frame->q[i] += power[k] * q[i];
            frame->p[i] += slope * q[i];
        }
    }
    for (size_t i = 0; i < n; i++) {
        frame->q[i] += arc->q[i];
        frame->p[i] /= arc->length;
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper->phase == FRAME_RESTING)
            continue;
        const double *r = frame_arc_r(arc, d);
        damper->r = damper->w = 0;
        for (size_t k = arc->degree; k > 0; k--) {
            damper->r += power[k] * r[k];
            damper->w += (double)k * power[k - 1] * r[k];
        }
        damper->r += r[0];
        damper->w /= arc->length;
    }
    frame->ground = root_value(arc->base, arc->degree, s);
}

// Speeds of all modes at the nodes of a rule, node after node, times the arc's length.
static void speeds(const FrameArc *arc, size_t n, const Quadrature *rule, double *out) {
    double power[NODES];
    memset(out, 0, rule->count * n * sizeof *out);
    for (size_t j = 0; j < rule->count; j++)
        power[j] = 1;
    for (size_t k = 1; k <= arc->degree; k++) {
        const double *q = arc->q + k * n;
        for (size_t j = 0; j < rule->count; j++) {
            double *restrict of = out + j * n;
            const double factor = (double)k * power[j];
            for (size_t i = 0; i < n; i++)
                of[i] += factor * q[i];
            power[j] *= rule->node[j];
        }
    }
}

FrameWork frame_arc_work(const FrameArc *arc, const Frame *frame) {
    FrameWork work = {0, 0, arc->length * arc_integral(arc->base, arc->degree)};
    if (!(arc->length > 0))
        return work;
    const size_t n = frame->storeys;
    const Quadrature *rule = arc_quadrature(arc->rho);
    double *p = arc->work, *force = arc->work + NODES * n;
    speeds(arc, n, rule, p);
    for (size_t j = 0; j < rule->count; j++, p += n) {
        if (frame->diagonal != NULL) {
            for (size_t i = 0; i < n; i++)
                force[i] = frame->diagonal[i] * p[i];
        } else {
            memset(force, 0, n * sizeof *force);
            for (size_t k = 0; k < n; k++)
                for (size_t i = 0; i < n; i++)
                    force[i] += frame->damping[k * n + i] * p[k];
        }
        work.damping += rule->weight[j] * frame_dot(force, p, n) / arc->length;
        const double a = root_value(arc->base, arc->degree, rule->node[j]);
        if (a == 0)
            continue;
        double momentum = frame_dot(frame->carry, p, n);
        for (size_t d = 0; d < frame->dampers; d++)
            momentum += frame->damper[d].plan->mass *
                        root_slope(frame_arc_r(arc, d), arc->degree, rule->node[j]);
        work.input -= rule->weight[j] * a * momentum;
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
        const double w = root_slope(frame_arc_r(arc, d), arc->degree, rule->node[j]);
        *lost += rule->weight[j] * w * w;
    }
    *lost *= damper->contact.damping / arc->length;
}
