// After a step: the state at its end, the integrals over it, and the largest forces on it.
#include <math.h>
#include <string.h>

#include "core/contact/power_law.h"
#include "core/solve/power_contact_step.h"
#include "core/solve/recorder.h"

// The state at s.
void power_contact_state(PowerContact *ode, const Slice *slice, double s, bool is_ended) {
    ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    const double *row = ode->row;
    if (s < 1)
        power_series_at(series, s, ode->row);
    else
        power_series_end(series, ode->row);
    memcpy(state->q, row + series->at_q, state->mode_count * sizeof *state->q);
    memcpy(state->p, row + series->at_p, state->mode_count * sizeof *state->p);
    for (size_t d = 0; d < state->dampers; d++) {
        state->damper[d].w = row[d];
        if (state->dampers > 1)
            state->damper[d].r = row[series->at_r + d];
    }
    const SeriesContact *leader = &series->contact[0];
    const double Y = fmax(root_value(power_series_root(series), series->degree, s), 0);
    double r = Y;
    for (int i = 1; i < series->root; i++)
        r *= Y;
    state->damper[leader->damper].r = is_ended ? 0 : leader->sign * r;
    state->base_acceleration = slice_at(slice, row[series->at_t]);
}

// p' D p of all nodes, into `loss`.
static void find_loss(PowerContact *ode, size_t rule, double *loss) {
    const ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    const size_t n = state->mode_count, count = arc_rules[rule].count;
    memset(loss, 0, SERIES_NODES * sizeof *loss);
    for (size_t i = 0; i < n; i++) {
        double *p = ode->nodes + i * SERIES_NODES;
        power_series_nodes(series, rule, series->z + series->at_p + i, series->stride,
                           series->degree, p);
        for (size_t k = 0; k < count && state->diagonal != NULL; k++)
            loss[k] += state->diagonal[i] * p[k] * p[k];
    }
    for (size_t i = 0; i < n && state->diagonal == NULL; i++)
        for (size_t j = 0; j < n; j++) {
            const double *a = ode->nodes + i * SERIES_NODES, *b = ode->nodes + j * SERIES_NODES;
            for (size_t k = 0; k < count; k++)
                loss[k] += state->damping[i * n + j] * a[k] * b[k];
        }
}

// Integrals over the step.
void power_contact_sums(PowerContact *ode, const Slice *slice, PowerContactStep *step) {
    const ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    const size_t rule = ode->error > 1e-8 ? 0 : ARC_RULES - 1, count = arc_rules[rule].count;
    const size_t n = state->mode_count, m = state->dampers, degree = series->degree;
    double weight[SERIES_NODES], Y[SERIES_NODES], ground[SERIES_NODES], loss[SERIES_NODES],
        momentum[SERIES_NODES] = {0};
    power_series_nodes(series, rule, power_series_root(series), 1, degree, Y);
    power_series_nodes(series, rule, series->z + (series->is_sine ? series->at_a : series->at_t),
                       series->stride, degree, ground);
    find_loss(ode, rule, loss);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++)
            momentum[k] += state->momentum_weights[i] * ode->nodes[i * SERIES_NODES + k];
    for (size_t d = 0; d < m; d++) {
        double *w = ode->nodes + d * SERIES_NODES; // the modes' are no longer wanted
        power_series_nodes(series, rule, series->z + d, series->stride, degree, w);
        for (size_t k = 0; k < count; k++)
            momentum[k] += state->damper[d].plan->mass * w[k];
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
        PowerContactContact *at = &ode->contact[contact->damper];
        const double *w = ode->nodes + contact->damper * SERIES_NODES;
        double force[SERIES_NODES];
        at->impulse = at->work = 0;
        if (!contact->is_felt)
            continue;
        power_series_nodes(series, rule, contact->force, 1, degree - 1, force);
        for (size_t k = 0; k < count; k++) {
            const double impulse = weight[k] * contact->sign * force[k];
            at->impulse += impulse;
            at->work += impulse * w[k];
        }
    }
}

// Largest forces on the way, and what they accelerate.
void power_contact_peaks(PowerContact *ode, const Slice *slice) {
    ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        const SeriesContact *contact = &series->contact[c];
        DamperState *damper = &state->damper[contact->damper];
        double s = -1;
        if (!contact->is_felt)
            continue;
        const double peak = arc_largest(contact->force, series->degree - 1,
                                        impact_log_least_force(&state->impacts, &damper->row), &s);
        impact_log_force(&state->impacts, &damper->row, peak);
        if (!(s > 0 && s < 1))
            continue;
        power_contact_state(ode, slice, s, false);
        modal_state_forces(state);
        recorder_acceleration(state);
    }
}

void power_contact_rows(PowerContact *ode, double length) {
    ModalState *state = ode->state;
    const PowerSeries *series = &ode->series;
    for (size_t c = 0; c < series->contacts; c++) {
        DamperState *damper = &state->damper[series->contact[c].damper];
        const PowerContactContact *at = &ode->contact[series->contact[c].damper];
        const double p = power_contact_penetration(damper), n = at->terms.exponent;
        const double strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
        impact_log_stretch(&state->impacts, &damper->row, length, at->impulse,
                           at->work - (strain - at->strain));
    }
}
