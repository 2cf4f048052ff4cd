// An integration step is a row of Taylor polynomials in the transformed time (power_series.h). It
// is as long as the truncation error allows, at most as long as requested, and ends at the first of
//
//   in contact:  p falls to 0, the release;  p' passes the kink of the law;  N is no more
//   negligible in flight:   the gap to a stop closes, a touch
//
// located as roots of the polynomials. The contact nearest to its start or end leads: its p defines
// the transformed time, and the other forces are smooth enough meanwhile. N is left out below the
// penetration where it would change the mass's speed by less than the error. This starts contacts
// that have no series: a touch without speed, or an exponent that no root makes an integer.
#include "core/solve/power_contact.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/contact/power_law.h"
#include "core/solve/recorder.h"

enum { ORDER_MAX = 22, KINKS_MAX = 8 };

static const double STEP_PART = 0.1; // truncation error of a step over the contact's tolerance
static const double ROUNDING = DBL_EPSILON / 4;
static const double STEP_COST = 800; // of a step besides its orders, in multiplications
static const double ORDER_BASE = 2.5,
                    ORDER_SLOPE = 0.55; // cheapest order = base - slope log(error)
static const double SPAN = 0.3;         // usual step, in (root of depth) / speed
static const double ONSET_MARGIN = 0.9; // N is left out below this part of the onset

// Scales and sums of a damper's contact.
typedef struct PowerContactDamper {
    ContactParameters parameters; // that terms and law are made of
    ContactTerms terms;
    SeriesLaw law;
    double speed;         // scale of p' [m/s]
    double depth;         // scale of p [m]
    double acceleration;  // p'' without N [m/s^2]
    double onset;         // N is negligible below this p [m]
    int kink_passed;      // at the end of the last step: 1 upwards, -1 downwards, 0 none
    double strain;        // energy in the buffer at the start of the step [J]
    double impulse, work; // of N over the step [N s], [J]
} PowerContactDamper;

// What ends a step early: the onset of N, a kink of the law (passed upwards 1, downwards -1), or
// else the event.
typedef struct StepEnd {
    bool is_found, is_onset;
    int kink;
    ContactEvent event;
} StepEnd;

Status power_contact_make(PowerContact *contact, ModalState *state, double tolerance,
                          Problem *problem) {
    memset(contact, 0, sizeof *contact);
    contact->state = state;
    contact->tolerance = tolerance;
    contact->error = fmax(STEP_PART * tolerance, ROUNDING);
    const double order = ORDER_BASE - ORDER_SLOPE * log(contact->error);
    contact->order_max = order > ORDER_MAX ? ORDER_MAX : (size_t)order;
    if (state->plan->form != CONTACT_POWER || state->dampers == 0)
        return STATUS_OK;
    const size_t n = state->mode_count, m = state->dampers;
    TRY(power_series_make(&contact->series, state, problem));
    contact->damper = calloc(m, sizeof *contact->damper);
    contact->block = calloc(m + n + state->padded + contact->series.stride + SERIES_NODES * (m + n),
                            sizeof *contact->block);
    if (contact->damper == NULL || contact->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    contact->row = contact->block;
    contact->elastic = contact->row + contact->series.stride;
    contact->inverse_modal = contact->elastic + state->padded;
    contact->inverse_speed = contact->inverse_modal + n;
    contact->nodes = contact->inverse_speed + m;
    return STATUS_OK;
}

void power_contact_clear(PowerContact *contact) {
    power_series_clear(&contact->series);
    free(contact->damper);
    free(contact->block);
}

bool power_contact_is_active(const PowerContact *contact) {
    for (size_t d = 0; contact->damper != NULL && d < contact->state->dampers; d++)
        if (contact->state->damper[d].phase == PHASE_CONTACT)
            return true;
    return false;
}

static double power_contact_root(double value, int root) {
    return root == 1   ? value
           : root == 2 ? sqrt(value)
           : root == 3 ? cbrt(value)
                       : sqrt(sqrt(value));
}

static double power_contact_penetration(const DamperState *damper) {
    return fmax(modal_state_sign(damper->side) * damper->r, 0);
}

// Penetration at which k p^n is `force`.
static double power_contact_depth(const ContactTerms *terms, double force) {
    return pow(force / terms->stiffness, 1 / terms->exponent);
}

// Energy in the buffer [J].
static double power_contact_strain(const PowerContactDamper *at, double p) {
    const double n = at->terms.exponent;
    return at->terms.stiffness * power_law_pow(p, n) * p / (n + 1);
}

// Penetration up to which N changes the speed of an impact by at most the part `error`.
static double power_contact_impact_onset(const PowerContactDamper *at, double error) {
    const double n = at->terms.exponent, m = at->terms.viscous_exponent;
    return at->depth * pow(error, 1 / ((at->terms.viscous > 0 ? fmin(n, m) : n) + 1));
}

// Penetration below which N is negligible in a contact with the present speed w.
static double power_contact_onset(const PowerContactDamper *at, double error, double w,
                                  double mass) {
    const double m = at->terms.viscous_exponent;
    double p = at->law.is_integer ? 0 : power_contact_impact_onset(at, error);
    // A mass that is pressed in almost without speed: p = acceleration t^2 / 2.
    if (!(at->acceleration > 0) || !(w * w < 1e-3 * at->acceleration * at->depth))
        return p;
    double pressed = power_contact_depth(&at->terms, error * mass * at->acceleration);
    if (at->terms.viscous > 0)
        pressed = fmin(
            pressed, pow(error * mass * sqrt(at->acceleration) / at->terms.viscous, 1 / (m + 0.5)));
    return w * w < 2 * at->acceleration * pressed ? fmax(p, pressed) : p;
}

// Updates the scales of a damper's contact to the present state.
static void power_contact_update(PowerContact *contact, size_t d) {
    const ModalState *state = contact->state;
    const DamperState *damper = &state->damper[d];
    PowerContactDamper *at = &contact->damper[d];
    const double mass = damper->effective_mass, w = modal_state_sign(damper->side) * damper->w;
    const ContactParameters *now = &damper->contact;
    if (memcmp(now, &at->parameters, sizeof *now) != 0) {
        at->parameters = *now;
        at->terms = state->plan->law->terms(now);
        series_law_make(&at->law, &at->terms);
        at->speed = 0;
    }
    at->acceleration = modal_state_sign(damper->side) *
                       (damper->base_coupling * state->base_acceleration +
                        modal_state_dot(damper->shape, contact->elastic, state->mode_count));
    const double p = power_contact_penetration(damper);
    const double speed = fmax(fabs(w), damper->row.impact.approach_speed);
    if (!(speed <= at->speed) || !(speed >= at->speed / 4) || !(at->speed > 0)) {
        at->speed = speed;
        at->depth = pow(mass * speed * speed / at->terms.stiffness, 1 / (at->terms.exponent + 1));
    }
    // The acceleration may lead deeper than the speed of the touch.
    const double force = mass * fabs(at->acceleration);
    if (force * at->depth > mass * at->speed * at->speed || !(at->speed > 0)) {
        at->depth = power_contact_depth(&at->terms, force);
        at->speed = fmax(speed, sqrt(2 * fabs(at->acceleration) * at->depth));
    }
    at->depth = fmax(at->depth, p);
    at->onset = power_contact_onset(at, contact->error, w, mass);
    at->strain = power_contact_strain(at, p);
}

// On which side of the law's kink the motion is. At a kink just passed w shows only rounding.
static bool power_contact_is_damped(const PowerContactDamper *at, const DamperState *damper) {
    const double w = modal_state_sign(damper->side) * damper->w, above = w - at->terms.turn;
    if (fabs(above) > 4 * DBL_EPSILON * fabs(w))
        return above > 0;
    if (at->kink_passed != 0)
        return at->kink_passed > 0;
    const double p = power_contact_penetration(damper);
    const double elastic =
        at->terms.is_elastic_below ? at->terms.stiffness * power_law_pow(p, at->terms.exponent) : 0;
    return at->acceleration - elastic / damper->effective_mass > 0;
}

// Lists the contacts, the leading one first: of those with a force the one with the smallest p in
// its scale. Returns its Y.
static double power_contact_list(PowerContact *contact) {
    const ModalState *state = contact->state;
    PowerSeries *series = &contact->series;
    SeriesContact *const all = series->contact;
    size_t leader = 0;
    double smallest = INFINITY;
    series->contact_count = 0;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const PowerContactDamper *at = &contact->damper[d];
        if (damper->phase != PHASE_CONTACT)
            continue;
        const double p = power_contact_penetration(damper);
        SeriesContact *next = &all[series->contact_count];
        next->damper = d;
        next->sign = modal_state_sign(damper->side);
        next->terms = at->terms;
        next->law = &at->law;
        next->has_force = p >= ONSET_MARGIN * at->onset;
        next->is_damped = power_contact_is_damped(at, damper);
        const double relative = next->has_force ? p / at->depth : 0x1p1000;
        if (relative < smallest) {
            smallest = relative;
            leader = series->contact_count;
        }
        series->contact_count++;
    }
    if (leader > 0) {
        const SeriesContact moved = all[0];
        all[0] = all[leader];
        all[leader] = moved;
    }
    // Another contact at p = 0 has no series in the leader's time before its onset.
    for (size_t c = 1; c < series->contact_count; c++) {
        PowerContactDamper *at = &contact->damper[all[c].damper];
        if (power_contact_penetration(&state->damper[all[c].damper]) > 0)
            continue;
        all[c].has_force = false;
        at->onset = fmax(at->onset, power_contact_impact_onset(at, contact->error));
    }
    series->root = all[0].has_force ? all[0].law->root : 1;
    return power_contact_root(power_contact_penetration(&state->damper[all[0].damper]),
                              series->root);
}

// Fills in the scales of the series. Returns the length in tau to try.
static double power_contact_scale(PowerContact *contact, double Y, double length,
                                  SeriesScale *scale) {
    const ModalState *state = contact->state;
    PowerSeries *series = &contact->series;
    const size_t n = state->mode_count;
    const int root = series->root;
    double time = INFINITY;
    for (size_t i = 0; i < n; i++)
        contact->inverse_modal[i] = fabs(state->p[i]) + DBL_MIN;
    for (size_t c = 0; c < series->contact_count; c++) {
        const size_t d = series->contact[c].damper;
        const DamperState *damper = &state->damper[d];
        const PowerContactDamper *at = &contact->damper[d];
        const double speed = at->speed + DBL_MIN, own = at->depth / speed;
        contact->inverse_speed[d] = 1 / speed;
        for (size_t i = 0; i < n; i++)
            contact->inverse_modal[i] += fabs(damper->shape[i]) * damper->effective_mass * speed;
        series->contact[c].inverse_force = own / (damper->effective_mass * speed);
        time = own < time ? own : time;
    }
    for (size_t i = 0; i < n; i++)
        contact->inverse_modal[i] = 1 / contact->inverse_modal[i];
    const size_t d = series->contact[0].damper;
    const double w = series->contact[0].sign * state->damper[d].w;
    const double Y_scale = power_contact_root(contact->damper[d].depth, root) + DBL_MIN;
    *scale = (SeriesScale){.error = contact->error,
                           .inverse_root = 1 / Y_scale,
                           .inverse_time = 1 / (time + DBL_MIN),
                           .inverse_speed = contact->inverse_speed,
                           .inverse_modal = contact->inverse_modal,
                           .order_max = contact->order_max};
    // `length` at constant speed is (E - Y) / w in tau, E^root = Y^root + w length. Division by the
    // sum of Y^i E^(root - 1 - i) avoids the cancellation.
    double p = Y;
    for (int i = 1; i < root; i++)
        p *= Y;
    const double E = power_contact_root(impact_log_larger(p + w * length, 0), root);
    double sum = 0, power = 1;
    for (int i = 0; i < root; i++, power *= Y)
        sum = sum * E + power;
    const double usual = SPAN * Y_scale * contact->inverse_speed[d];
    const double reach =
        root == contact->last_root && contact->last_length > usual ? contact->last_length : usual;
    return fmin(reach, 1.02 * length / sum);
}

// Cuts the step where the leading contact is released: t would decrease beyond. Returns whether it
// is.
static bool power_contact_cut_release(PowerSeries *series) {
    double s;
    const bool is_released = polynomial_root_first(power_series_leader(series), series->degree, &s);
    if (is_released)
        power_series_cut(series, s);
    return is_released;
}

// Cuts the step where t is `length`. Returns whether it reaches `length`; *is_cut: it was longer.
static bool power_contact_cut_time(PowerSeries *series, double length, bool *is_cut) {
    double left[SERIES_ROW], s, t = 0;
    power_series_column(series, series->at_t, left);
    for (size_t k = series->degree; k > 0; k--) {
        t += left[k];
        left[k] = -left[k];
    }
    *is_cut = false;
    if (t <= length)
        return t >= length * (1 - 4 * DBL_EPSILON);
    left[0] = length;
    *is_cut = polynomial_root_first(left, series->degree, &s);
    if (*is_cut)
        power_series_cut(series, s);
    return true;
}

// Locates the first crossing of a polynomial if it comes before *end. Returns whether it does.
static bool power_contact_locate(double *c, size_t degree, ContactEvent candidate, StepEnd *end) {
    if (!contact_event_locate(c, degree, candidate, &end->is_found, &end->event))
        return false;
    end->is_onset = false;
    end->kink = 0;
    return true;
}

// The release of a contact that does not lead, and the onset of a force that is left out.
static void power_contact_find_release(const PowerContact *contact, size_t c, StepEnd *end) {
    const PowerSeries *series = &contact->series;
    const SeriesContact *at = &series->contact[c];
    const ContactEvent event = {.damper = at->damper,
                                .side = contact->state->damper[at->damper].side};
    double gap[SERIES_ROW];
    if (c == 0)
        memcpy(gap, power_series_leader(series), (series->degree + 1) * sizeof *gap);
    else
        power_series_column(series, series->at_r + at->damper, gap);
    for (size_t k = 0; k <= series->degree && c > 0; k++)
        gap[k] *= at->sign;
    if (c > 0)
        (void)power_contact_locate(gap, series->degree, event, end);
    if (at->has_force)
        return;
    for (size_t k = 0; k <= series->degree; k++)
        gap[k] = -gap[k];
    gap[0] += contact->damper[at->damper].onset;
    if (power_contact_locate(gap, series->degree, event, end))
        end->is_onset = true;
}

static void power_contact_find_kink(const PowerContact *contact, size_t c, StepEnd *end) {
    const PowerSeries *series = &contact->series;
    const SeriesContact *at = &series->contact[c];
    double above[SERIES_ROW];
    if (!(at->terms.viscous > 0) || !at->has_force || contact->kinks > KINKS_MAX)
        return;
    const double sign = at->is_damped ? 1 : -1;
    power_series_column(series, at->damper, above);
    for (size_t k = 0; k <= series->degree; k++)
        above[k] *= sign * at->sign;
    const double size = fabs(above[0]);
    above[0] -= sign * at->terms.turn;
    if (fabs(above[0]) <= 4 * DBL_EPSILON * size)
        above[0] = 0;
    if (power_contact_locate(above, series->degree, (ContactEvent){.damper = at->damper}, end))
        end->kink = at->is_damped ? -1 : 1;
}

// A contact that is over already: the gap opens from the first instant on.
static bool power_contact_find_open(const PowerContact *contact, PowerContactStep *step) {
    const ModalState *state = contact->state;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side), w = sign * damper->w;
        if (damper->phase != PHASE_CONTACT || sign * damper->r > 0 ||
            !(w < 0 || (w == 0 && !(contact->damper[d].acceleration > 0))))
            continue;
        step->is_event = true;
        step->event = (ContactEvent){.damper = d, .s = 1, .side = damper->side};
        return true;
    }
    return false;
}

// The first event on the step. is_released: the leading contact is at its end.
static void power_contact_find(const PowerContact *contact, bool is_released, StepEnd *end) {
    const ModalState *state = contact->state;
    const PowerSeries *series = &contact->series;
    *end = (StepEnd){0};
    if (is_released) {
        const size_t d = series->contact[0].damper;
        end->is_found = true;
        end->event = (ContactEvent){.damper = d, .s = 1, .side = state->damper[d].side};
    }
    for (size_t c = 0; c < series->contact_count; c++) {
        power_contact_find_release(contact, c, end);
        power_contact_find_kink(contact, c, end);
    }
    for (size_t d = 0; d < state->dampers; d++) {
        double r[SERIES_ROW];
        if (state->damper[d].phase != PHASE_FLIGHT)
            continue;
        power_series_column(series, series->at_r + d, r);
        if (contact_event_find_touch(state, d, r, series->degree, &end->is_found, &end->event)) {
            end->is_onset = false;
            end->kink = 0;
        }
    }
}

// Sets the state to that at s. is_released: the leading contact's p is exactly 0 there.
static void power_contact_state(PowerContact *contact, const Slice *slice, double s,
                                bool is_released) {
    ModalState *state = contact->state;
    const PowerSeries *series = &contact->series;
    const SeriesContact *leader = &series->contact[0];
    const double *row = contact->row;
    power_series_at(series, s, contact->row);
    memcpy(state->q, row + series->at_q, state->mode_count * sizeof *state->q);
    memcpy(state->p, row + series->at_p, state->mode_count * sizeof *state->p);
    for (size_t d = 0; d < state->dampers; d++) {
        state->damper[d].w = row[d];
        if (state->dampers > 1)
            state->damper[d].r = row[series->at_r + d];
    }
    const double Y = fmax(polynomial_value(power_series_leader(series), series->degree, s), 0);
    double r = Y;
    for (int i = 1; i < series->root; i++)
        r *= Y;
    state->damper[leader->damper].r = is_released ? 0 : leader->sign * r;
    state->base_acceleration = slice_at(slice, row[series->at_t]);
}

// Evaluates the modal speeds at the nodes of a rule, and p' D p there into `loss`.
static void power_contact_losses(PowerContact *contact, size_t rule, double *loss) {
    const ModalState *state = contact->state;
    const PowerSeries *series = &contact->series;
    const size_t n = state->mode_count, count = arc_rules[rule].count;
    memset(loss, 0, SERIES_NODES * sizeof *loss);
    for (size_t i = 0; i < n; i++) {
        double *p = contact->nodes + i * SERIES_NODES;
        power_series_nodes(series, rule, series->z + series->at_p + i, series->stride,
                           series->degree, p);
        for (size_t k = 0; k < count && state->diagonal != NULL; k++)
            loss[k] += state->diagonal[i] * p[k] * p[k];
    }
    for (size_t i = 0; i < n && state->diagonal == NULL; i++)
        for (size_t j = 0; j < n; j++) {
            const double *a = contact->nodes + i * SERIES_NODES,
                         *b = contact->nodes + j * SERIES_NODES;
            for (size_t k = 0; k < count; k++)
                loss[k] += state->damping[i * n + j] * a[k] * b[k];
        }
}

// Integrates over the step by Gauss-Legendre quadrature: the work of the base, the losses, and
// impulse and work of each N.
static void power_contact_integrate(PowerContact *contact, const Slice *slice, StepWork *work) {
    const ModalState *state = contact->state;
    const PowerSeries *series = &contact->series;
    const size_t rule = contact->error > 1e-8 ? 0 : ARC_RULES - 1, count = arc_rules[rule].count;
    const size_t n = state->mode_count, m = state->dampers, degree = series->degree;
    double weight[SERIES_NODES], Y[SERIES_NODES], ground[SERIES_NODES], loss[SERIES_NODES],
        momentum[SERIES_NODES] = {0};
    power_series_nodes(series, rule, power_series_leader(series), 1, degree, Y);
    power_series_nodes(series, rule, series->z + (series->is_sine ? series->at_a : series->at_t),
                       series->stride, degree, ground);
    power_contact_losses(contact, rule, loss);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count; k++)
            momentum[k] += state->momentum_weights[i] * contact->nodes[i * SERIES_NODES + k];
    for (size_t d = 0; d < m; d++) {
        double *w = contact->nodes + d * SERIES_NODES; // the modal speeds are used up
        power_series_nodes(series, rule, series->z + d, series->stride, degree, w);
        for (size_t k = 0; k < count; k++)
            momentum[k] += state->damper[d].plan->mass * w[k];
    }
    for (size_t k = 0; k < count; k++) {
        weight[k] = arc_rules[rule].weight[k] * series->length * series->root;
        for (int i = 1; i < series->root; i++)
            weight[k] *= Y[k];
        ground[k] = series->is_sine ? ground[k] : slice_at(slice, ground[k]);
        work->input -= weight[k] * ground[k] * momentum[k];
        work->damping += weight[k] * loss[k];
        work->ground += weight[k] * ground[k];
    }
    for (size_t c = 0; c < series->contact_count; c++) {
        const SeriesContact *of = &series->contact[c];
        PowerContactDamper *at = &contact->damper[of->damper];
        const double *w = contact->nodes + of->damper * SERIES_NODES;
        double force[SERIES_NODES];
        at->impulse = at->work = 0;
        if (!of->has_force)
            continue;
        power_series_nodes(series, rule, of->force, 1, degree - 1, force);
        for (size_t k = 0; k < count; k++) {
            const double impulse = weight[k] * of->sign * force[k];
            at->impulse += impulse;
            at->work += impulse * w[k];
        }
    }
}

// Peak forces on the step, and peak accelerations at their instants. Changes the state.
static void power_contact_peaks(PowerContact *contact, const Slice *slice) {
    ModalState *state = contact->state;
    const PowerSeries *series = &contact->series;
    for (size_t c = 0; c < series->contact_count; c++) {
        const SeriesContact *of = &series->contact[c];
        DamperState *damper = &state->damper[of->damper];
        double s = -1;
        if (!of->has_force)
            continue;
        const double peak = arc_largest(of->force, series->degree - 1,
                                        impact_log_least_force(&state->impacts, &damper->row), &s);
        impact_log_force(&state->impacts, &damper->row, peak);
        if (!(s > 0 && s < 1))
            continue;
        power_contact_state(contact, slice, s, false);
        modal_state_forces(state);
        recorder_acceleration(state);
    }
}

// Adds the step to the impact rows; the state is that of its end.
static void power_contact_log(PowerContact *contact, double length) {
    ModalState *state = contact->state;
    for (size_t c = 0; c < contact->series.contact_count; c++) {
        const size_t d = contact->series.contact[c].damper;
        DamperState *damper = &state->damper[d];
        const PowerContactDamper *at = &contact->damper[d];
        const double strain = power_contact_strain(at, power_contact_penetration(damper));
        impact_log_stretch(&state->impacts, &damper->row, length, at->impulse,
                           at->work - (strain - at->strain));
    }
}

void power_contact_step(PowerContact *contact, const Slice *slice, double length,
                        PowerContactStep *step) {
    ModalState *state = contact->state;
    PowerSeries *series = &contact->series;
    *step = (PowerContactStep){0};
    modal_state_elastic(state, state->q, state->p, contact->elastic);
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase == PHASE_CONTACT)
            power_contact_update(contact, d);
    if (power_contact_find_open(contact, step))
        return;
    SeriesScale scale;
    StepEnd end;
    const double Y = power_contact_list(contact);
    const double span = power_contact_scale(contact, Y, length, &scale);
    power_series_cut(series, power_series_expand(series, state, slice, Y, span, &scale));
    contact->last_length = series->length;
    contact->last_root = series->root;
    const bool is_released = power_contact_cut_release(series);
    bool is_cut;
    const bool is_whole = power_contact_cut_time(series, length, &is_cut);
    power_contact_find(contact, is_released && !is_cut, &end);
    if (end.is_found && end.event.s < 1)
        power_series_cut(series, end.event.s);
    if (!state->is_shadow) {
        power_contact_integrate(contact, slice, &step->work);
        power_contact_peaks(contact, slice);
    }
    step->is_event = end.is_found && !end.is_onset && end.kink == 0;
    step->event = end.event;
    step->event.s = 1;
    power_contact_state(contact, slice, 1,
                        step->is_event && end.event.damper == series->contact[0].damper);
    step->length = is_whole && !end.is_found ? length : contact->row[series->at_t];
    if (!state->is_shadow)
        power_contact_log(contact, step->length);
    contact->kinks = step->length > 0 ? 0 : contact->kinks + 1;
    for (size_t c = 0; c < series->contact_count; c++)
        if (step->length > 0)
            contact->damper[series->contact[c].damper].kink_passed = 0;
    if (end.kink != 0) {
        DamperState *damper = &state->damper[end.event.damper];
        PowerContactDamper *at = &contact->damper[end.event.damper];
        damper->w = modal_state_sign(damper->side) * at->terms.turn;
        at->kink_passed = end.kink;
    }
    const double k = (double)series->degree, n = (double)state->mode_count;
    step->cost = STEP_COST +
                 k * k / 2 * ((double)series->stride + 4 * (double)series->contact_count) +
                 (state->diagonal == NULL ? k * n * n : 0) + 12 * k * (double)series->stride;
}
