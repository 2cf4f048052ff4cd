// Before a step: what is known of each contact, who leads, and what is large for whom.
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/contact/power_law.h"
#include "core/solve/power_contact_step.h"

static const double SPAN = 0.3;         // a step is about so long, in (root of depth) / speed
static const double NEARLY_SMALL = 0.9; // of negligible: there it still is

static double root_of(double value, int root) {
    return root == 1   ? value
           : root == 2 ? sqrt(value)
           : root == 3 ? cbrt(value)
                       : sqrt(sqrt(value));
}

// p at which N is k p^n = `force`.
static double depth_at(const ContactTerms *terms, double force) {
    return pow(force / terms->stiffness, 1 / terms->exponent);
}

// Where N has slowed a mass by no more than `error` of its speed.
static double small_depth(const PowerContactContact *at, double error) {
    const double n = at->terms.exponent, m = at->terms.viscous_exponent;
    return at->depth * pow(error, 1 / ((at->terms.viscous > 0 ? fmin(n, m) : n) + 1));
}

// Below which p a contact that begins with this speed need not feel N.
static double find_negligible(const PowerContactContact *at, double error, double w, double mass) {
    const double m = at->terms.viscous_exponent;
    double p = at->law.is_whole ? 0 : small_depth(at, error);
    // Pressed rather than thrown: p = push t^2 / 2.
    if (!(at->push > 0) || !(w * w < 1e-3 * at->push * at->depth))
        return p;
    double slow = depth_at(&at->terms, error * mass * at->push);
    if (at->terms.viscous > 0)
        slow = fmin(slow, pow(error * mass * sqrt(at->push) / at->terms.viscous, 1 / (m + 0.5)));
    return w * w < 2 * at->push * slow ? fmax(p, slow) : p;
}

// Brings what is known of a contact up to the present state.
void power_contact_look(PowerContact *ode, size_t d) {
    const ModalState *state = ode->state;
    const DamperState *damper = &state->damper[d];
    PowerContactContact *at = &ode->contact[d];
    const double mass = damper->effective_mass, w = modal_state_sign(damper->side) * damper->w;
    const ContactParameters *now = &damper->contact;
    if (memcmp(now, &at->parameters, sizeof *now) != 0) {
        at->parameters = *now;
        at->terms = state->plan->law->terms(now);
        series_law_make(&at->law, &at->terms);
        at->speed = 0;
    }
    at->push = modal_state_sign(damper->side) *
               (damper->base_coupling * state->base_acceleration +
                modal_state_dot(damper->shape, ode->elastic, state->mode_count));
    const double n = at->terms.exponent, p = power_contact_penetration(damper);
    double speed = fmax(fabs(w), damper->row.impact.approach_speed);
    if (!(speed <= at->speed) || !(speed >= at->speed / 4) || !(at->speed > 0)) {
        at->speed = speed;
        at->depth = pow(mass * speed * speed / at->terms.stiffness, 1 / (n + 1));
    }
    // What presses may make it deeper and faster than the touch did.
    if (mass * fabs(at->push) * at->depth > mass * at->speed * at->speed || !(at->speed > 0)) {
        at->depth = depth_at(&at->terms, mass * fabs(at->push));
        at->speed = fmax(speed, sqrt(2 * fabs(at->push) * at->depth));
    }
    at->depth = fmax(at->depth, p);
    at->negligible = find_negligible(at, ode->error, w, mass);
    at->strain = at->terms.stiffness * power_of(p, n) * p / (n + 1);
}

// Which side of the law's kink the motion is on. At a kink just passed rounding alone says so.
static bool is_damped(const PowerContactContact *at, const DamperState *damper) {
    const double w = modal_state_sign(damper->side) * damper->w, off = w - at->terms.turn;
    if (fabs(off) > 4 * DBL_EPSILON * fabs(w))
        return off > 0;
    if (at->passed != 0)
        return at->passed > 0;
    const double spring =
        at->terms.is_elastic_below
            ? at->terms.stiffness * power_of(power_contact_penetration(damper), at->terms.exponent)
            : 0;
    return at->push - spring / damper->effective_mass > 0;
}

// Lists those in contact; the leader comes first. Returns its Y.
double power_contact_contacts(PowerContact *ode) {
    const ModalState *state = ode->state;
    PowerSeries *series = &ode->series;
    size_t first = 0;
    double nearest = INFINITY;
    series->contacts = 0;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        const PowerContactContact *at = &ode->contact[d];
        if (damper->phase != PHASE_CONTACT)
            continue;
        const double p = power_contact_penetration(damper);
        SeriesContact *contact = &series->contact[series->contacts];
        contact->damper = d;
        contact->sign = modal_state_sign(damper->side);
        contact->terms = at->terms;
        contact->law = &at->law;
        contact->is_felt = p >= NEARLY_SMALL * at->negligible;
        contact->is_damped = is_damped(at, damper);
        // Among those whose N is felt the one with the least p leads.
        const double rank = contact->is_felt ? p / at->depth : 0x1p1000;
        if (rank < nearest) {
            nearest = rank;
            first = series->contacts;
        }
        series->contacts++;
    }
    SeriesContact *const all = series->contact;
    if (first > 0) {
        const SeriesContact moved = all[0];
        all[0] = all[first];
        all[first] = moved;
    }
    // Another that is at 0 too has no series of its own until it is pressed.
    for (size_t c = 1; c < series->contacts; c++) {
        PowerContactContact *at = &ode->contact[all[c].damper];
        if (power_contact_penetration(&state->damper[all[c].damper]) > 0)
            continue;
        all[c].is_felt = false;
        at->negligible = fmax(at->negligible, small_depth(at, ode->error));
    }
    series->root = all[0].is_felt ? all[0].law->root : 1;
    return root_of(power_contact_penetration(&state->damper[all[0].damper]), series->root);
}

// What a step of tau is about as long as, and what is large for each component.
double power_contact_scale(PowerContact *ode, double Y, double length, SeriesScale *scale) {
    const ModalState *state = ode->state;
    PowerSeries *series = &ode->series;
    const size_t n = state->mode_count;
    const int root = series->root;
    double span = INFINITY;
    for (size_t i = 0; i < n; i++)
        ode->modal[i] = fabs(state->p[i]) + DBL_MIN;
    for (size_t c = 0; c < series->contacts; c++) {
        const size_t d = series->contact[c].damper;
        const DamperState *damper = &state->damper[d];
        const PowerContactContact *at = &ode->contact[d];
        const double speed = at->speed + DBL_MIN;
        ode->speed[d] = 1 / speed;
        for (size_t i = 0; i < n; i++)
            ode->modal[i] += fabs(damper->shape[i]) * damper->effective_mass * speed;
        const double own = at->depth / speed;
        series->contact[c].per_force = own / (damper->effective_mass * speed);
        span = own < span ? own : span;
    }
    for (size_t i = 0; i < n; i++)
        ode->modal[i] = 1 / ode->modal[i];
    const size_t d = series->contact[0].damper;
    const double w = series->contact[0].sign * state->damper[d].w;
    const double large = root_of(ode->contact[d].depth, root) + DBL_MIN;
    *scale = (SeriesScale){.error = ode->error,
                           .per_root = 1 / large,
                           .per_time = 1 / (span + DBL_MIN),
                           .per_speed = ode->speed,
                           .per_modal = ode->modal,
                           .order = ode->order};
    // tau over `length`, were the speed to stay.
    double p = Y;
    for (int i = 1; i < root; i++)
        p *= Y;
    const double end = root_of(impact_log_larger(p + w * length, 0), root);
    double mean = 0, power = 1; // the sum of Y^i end^(root - 1 - i)
    for (int i = 0; i < root; i++, power *= Y)
        mean = mean * end + power;
    // As far as the step before went, or about so far by the contact's own numbers.
    const double usual = SPAN * large * ode->speed[d];
    const double reach = root == ode->last_root && ode->last > usual ? ode->last : usual;
    return fmin(reach, 1.02 * length / mean);
}
