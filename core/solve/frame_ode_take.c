// After a step: the state at its end, the integrals over it, and the largest forces on it.
#include <math.h>
#include <string.h>

#include "core/contact/power_law.h"
#include "core/solve/frame_ode_step.h"
#include "core/solve/recorder.h"

// The state at s.
void frame_ode_state(FrameOde *ode, const Slice *slice, double s, bool is_ended) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const double *row = ode->row;
    if (s < 1)
        frame_series_at(series, s, ode->row);
    else
        frame_series_end(series, ode->row);
    memcpy(frame->q, row + series->at_q, frame->mode_count * sizeof *frame->q);
    memcpy(frame->p, row + series->at_p, frame->mode_count * sizeof *frame->p);
    for (size_t d = 0; d < frame->dampers; d++) {
        frame->damper[d].w = row[d];
        if (frame->dampers > 1)
            frame->damper[d].r = row[series->at_r + d];
    }
    const SeriesContact *leader = &series->contact[0];
    const double Y = fmax(root_value(frame_series_root(series), series->degree, s), 0);
    double r = Y;
    for (int i = 1; i < series->root; i++)
        r *= Y;
    frame->damper[leader->damper].r = is_ended ? 0 : leader->sign * r;
    frame->ground = slice_at(slice, row[series->at_t]);
}

// p' D p of all nodes, into `loss`.
static void find_loss(FrameOde *ode, size_t rule, double *loss) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const size_t n = frame->mode_count, count = arc_rules[rule].count;
    memset(loss, 0, SERIES_NODES * sizeof *loss);
    for (size_t i = 0; i < n; i++) {
        double *p = ode->nodes + i * SERIES_NODES;
        frame_series_nodes(series, rule, series->z + series->at_p + i, series->stride,
                           series->degree, p);
        for (size_t k = 0; k < count && frame->diagonal != NULL; k++)
            loss[k] += frame->diagonal[i] * p[k] * p[k];
    }
    for (size_t i = 0; i < n && frame->diagonal == NULL; i++)
        for (size_t j = 0; j < n; j++) {
            const double *a = ode->nodes + i * SERIES_NODES, *b = ode->nodes + j * SERIES_NODES;
            for (size_t k = 0; k < count; k++)
                loss[k] += frame->damping[i * n + j] * a[k] * b[k];
        }
}

// Integrals over the step.
void frame_ode_sums(FrameOde *ode, const Slice *slice, FrameOdeStep *step) {
    const Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    const size_t rule = ode->error > 1e-8 ? 0 : ARC_RULES - 1, count = arc_rules[rule].count;
    const size_t n = frame->mode_count, m = frame->dampers, degree = series->degree;
    double weight[SERIES_NODES], Y[SERIES_NODES], ground[SERIES_NODES], loss[SERIES_NODES],
        momentum[SERIES_NODES] = {0};
    frame_series_nodes(series, rule, frame_series_root(series), 1, degree, Y);
    frame_series_nodes(series, rule, series->z + (series->is_sine ? series->at_a : series->at_t),
                       series->stride, degree, ground);
    find_loss(ode, rule, loss);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++)
            momentum[k] += frame->carry[i] * ode->nodes[i * SERIES_NODES + k];
    for (size_t d = 0; d < m; d++) {
        double *w = ode->nodes + d * SERIES_NODES; // the modes' are no longer wanted
        frame_series_nodes(series, rule, series->z + d, series->stride, degree, w);
        for (size_t k = 0; k < count; k++)
            momentum[k] += frame->damper[d].plan->mass * w[k];
    }
    for (size_t k = 0; k < count; k++) {
        weight[k] = arc_rules[rule].weight[k] * series->length * series->root;
        for (int i = 1; i < series->root; i++)
            weight[k] *= Y[k];
        ground[k] = series->is_sine ? ground[k] : slice_at(slice, ground[k]);
        step->input -= weight[k] * ground[k] * momentum[k];
        step->damping += weight[k] * loss[k];
        step->ground += weight[k] * ground[k];
    }
    for (size_t c = 0; c < series->contacts; c++) {
        const SeriesContact *contact = &series->contact[c];
        FrameOdeContact *at = &ode->contact[contact->damper];
        const double *w = ode->nodes + contact->damper * SERIES_NODES;
        double force[SERIES_NODES];
        at->impulse = at->work = 0;
        if (!contact->is_felt)
            continue;
        frame_series_nodes(series, rule, contact->force, 1, degree - 1, force);
        for (size_t k = 0; k < count; k++) {
            const double impulse = weight[k] * contact->sign * force[k];
            at->impulse += impulse;
            at->work += impulse * w[k];
        }
    }
}

// Largest forces on the way, and what they accelerate.
void frame_ode_peaks(FrameOde *ode, const Slice *slice) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        const SeriesContact *contact = &series->contact[c];
        FrameDamper *damper = &frame->damper[contact->damper];
        double s = -1;
        if (!contact->is_felt)
            continue;
        const double peak = arc_largest(contact->force, series->degree - 1,
                                        ledger_least_force(&frame->ledger, &damper->row), &s);
        ledger_force(&frame->ledger, &damper->row, peak);
        if (!(s > 0 && s < 1))
            continue;
        frame_ode_state(ode, slice, s, false);
        frame_feel(frame);
        frame_record_acceleration(frame);
    }
}

void frame_ode_rows(FrameOde *ode, double length) {
    Frame *frame = ode->frame;
    const FrameSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        FrameDamper *damper = &frame->damper[series->contact[c].damper];
        const FrameOdeContact *at = &ode->contact[series->contact[c].damper];
        const double p = frame_ode_penetration(damper), n = at->terms.exponent;
        const double strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
        ledger_stretch(&frame->ledger, &damper->row, length, at->impulse,
                       at->work - (strain - at->strain));
    }
}
