// The state (q, p; r, w) is followed by what is summed up: impulse and work of each damper's force,
// the base's work, the structure's loss and the base's speed. Each damper has three watched
// functions:
//
//   in flight    the gaps to its two stops
//   in contact   the penetration (zero force: N); dN/dt, whose fall through zero is a peak of N
//   inside       -N; the penetration
//   at rest      N
#include "core/solve/adaptive_motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TOTALS = 3 };
static const double GROWN = 100;

// Where the parts of y begin.
static size_t at_r(const ModalState *state) {
    return 2 * state->mode_count;
}
static size_t at_impulse(const ModalState *state) {
    return at_r(state) + 2 * state->dampers;
}
static size_t at_totals(const ModalState *state) {
    return at_impulse(state) + 2 * state->dampers;
}

// N of all dampers at y.
static void feel(const Adaptive *own, const double *y, double ground) {
    Steps *steps = own->steps;
    const ModalState *state = &steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *r = y + at_r(state), *w = r + m;
    if (state->resting > 0)
        steps_elastic(state, y, y + n, steps->elastic);
    for (size_t d = 0; d < m; d++) {
        own->force[d] = 0;
        if (state->damper[d].phase == PHASE_CONTACT)
            own->force[d] = steps_contact(state, d, r[d], w[d]).value;
        if (state->damper[d].phase != PHASE_RESTING)
            continue;
        for (size_t e = 0; e < m; e++)
            if (state->damper[e].phase == PHASE_RESTING)
                own->force[d] += state->constraint_mass[d * m + e] *
                                 (modal_state_dot(state->damper[e].shape, steps->elastic, n) +
                                  state->damper[e].base_coupling * ground);
    }
}

static void rate(const void *context, double t, const double *y, double *out) {
    const Adaptive *own = context;
    const ModalState *state = &own->steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *p = y + n, *w = y + at_r(state) + m;
    double *impulse = out + at_impulse(state), *total = out + at_totals(state);
    const double ground = slice_at(&own->slice, t - own->at);
    feel(own, y, ground);
    ++*own->rated;
    steps_rate(own->steps, y, ground, own->force, out);
    double momentum = modal_state_dot(state->momentum_weights, p, n), loss = 0;
    for (size_t i = 0; i < n; i++)
        loss += (own->steps->elastic[i] - state->omega2[i] * y[i]) * p[i];
    for (size_t d = 0; d < m; d++) {
        momentum += state->damper[d].plan->mass * w[d];
        impulse[d] = own->force[d];
        impulse[m + d] = own->force[d] * w[d];
        if (state->damper[d].phase == PHASE_RESTING) // but for rounding
            out[at_r(state) + d] = out[at_r(state) + m + d] = 0;
    }
    total[0] = -ground * momentum;
    total[1] = loss;
    total[2] = ground;
}

static void progress(const void *context, double t, const double *y, double *value, double *slope) {
    const Adaptive *own = context;
    const ModalState *state = &own->steps->state;
    const size_t m = state->dampers;
    const double *r = y + at_r(state), *w = r + m;
    rate(context, t, y, own->rates);
    for (size_t d = 0; d < m && state->has_stops; d++) {
        const DamperState *damper = &state->damper[d];
        const double sign = modal_state_sign(damper->side);
        double *is = value + ADAPTIVE_WATCHED * d, *goes = slope + ADAPTIVE_WATCHED * d;
        for (int k = 0; k < ADAPTIVE_WATCHED; k++)
            is[k] = goes[k] = 1;
        if (damper->phase == PHASE_FLIGHT) {
            for (int side = 0; side < 2; side++) {
                is[side] =
                    modal_state_room(damper, (Side)side) - modal_state_sign((Side)side) * r[d];
                goes[side] = -modal_state_sign((Side)side) * w[d];
            }
        } else if (damper->phase == PHASE_RESTING) {
            is[ADAPTIVE_FIRST] = sign * own->force[d];
            goes[ADAPTIVE_FIRST] = (double)NAN;
        } else {
            const ContactForce force = steps_contact(state, d, r[d], w[d]);
            const bool is_inside = damper->phase == PHASE_INSIDE;
            const bool is_by_force = is_inside || state->plan->separation == SEPARATION_ZERO_FORCE;
            const double grows = sign * (force.by_penetration * w[d] +
                                         force.by_speed * own->rates[at_r(state) + m + d]);
            is[ADAPTIVE_FIRST] =
                is_by_force ? (is_inside ? -sign : sign) * force.value : sign * r[d];
            goes[ADAPTIVE_FIRST] = is_by_force ? (is_inside ? -grows : grows) : sign * w[d];
            is[is_inside ? ADAPTIVE_SECOND : ADAPTIVE_PEAK] = is_inside ? sign * r[d] : grows;
            goes[is_inside ? ADAPTIVE_SECOND : ADAPTIVE_PEAK] =
                is_inside ? sign * w[d] : (double)NAN;
        }
    }
}

static double push_of(const Adaptive *own) {
    const double interval = own->steps->state.interval;
    return fabs(own->slice.value) + fabs(own->slice.slope) * interval;
}

bool adaptive_motion_has_outgrown(const Adaptive *own) {
    const ModalState *state = &own->steps->state;
    return push_of(own) > GROWN * own->push || modal_state_size(state) > GROWN * own->speed;
}

// What is large for each component; returns a first step.
static double make_scale(Adaptive *own) {
    const ModalState *state = &own->steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    double *scale = own->scale, *r = scale + at_r(state), *w = r + m;
    double *impulse = scale + at_impulse(state), *totals = scale + at_totals(state);
    double time = state->interval, energy = 0;
    own->push = fmax(own->push, push_of(own));
    own->speed = fmax(own->speed, fmax(modal_state_size(state),
                                       state->participation_norm * own->push * state->interval));
    // A structure at rest will have what its masses bring.
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double mobility = modal_state_dot(damper->shape, damper->shape, n);
        own->speed = fmax(own->speed, damper->effective_mass * fabs(damper->w) * sqrt(mobility));
    }
    for (size_t i = 0; i < n; i++) {
        scale[n + i] = own->speed;
        scale[i] = own->speed / fmax(sqrt(state->omega2[i]), 1 / state->plan->duration);
    }
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        const double mass = damper->effective_mass;
        const double wide = sqrt(modal_state_dot(damper->shape, damper->shape, n)) * own->speed;
        const double speed =
            fmax(fabs(damper->w), damper->phase == PHASE_CONTACT ? 1e-3 * wide : wide);
        // Not far from a stop the mass may be back at once, and the integrator finds a root to a
        // part of its step alone.
        const double pull = fabs(own->rates[at_r(state) + m + d]);
        if (damper->phase == PHASE_FLIGHT && damper->origin != FROM_MIDDLE && pull > 0)
            time = fmin(time, (fabs(damper->w) + sqrt(2 * pull * fabs(damper->r))) / pull);
        w[d] = speed;
        r[d] = fmax(damper->plan->clearance, speed * state->interval);
        if (damper->phase == PHASE_CONTACT) {
            const double exponent =
                state->plan->form == CONTACT_POWER ? damper->contact.exponent : 1;
            r[d] = pow(mass * speed * speed / damper->contact.stiffness, 1 / (exponent + 1));
            if (speed > 0)
                time = fmin(time, r[d] / speed);
        }
        impulse[d] = mass * speed;
        impulse[m + d] = mass * speed * speed;
        energy += mass * speed * speed;
    }
    totals[0] = totals[1] = energy + own->speed * own->speed;
    totals[2] = own->push * state->interval;
    return time / (8 * (double)own->steps->share);
}

Status adaptive_motion_start(Adaptive *own) {
    const ModalState *state = &own->steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    double *r = own->y + at_r(state);
    memset(own->y, 0, own->size * sizeof *own->y);
    memcpy(own->y, state->q, n * sizeof *own->y);
    memcpy(own->y + n, state->p, n * sizeof *own->y);
    for (size_t d = 0; d < m; d++) {
        const DamperState *damper = &state->damper[d];
        r[d] = damper->r;
        r[m + d] = damper->w;
        own->strain[d] = damper->phase == PHASE_CONTACT
                             ? steps_contact(state, d, damper->r, damper->w).strain
                             : 0;
    }
    own->at = 0;
    own->events = state->events;
    rate(own, 0, own->y, own->rates);
    return ode_start(own->ode, own->y, own->scale, make_scale(own), state->problem);
}

// Has the gap of a mass released from rest opened beyond rounding yet?
static void leave(ModalState *state, DamperState *damper) {
    if (modal_state_sign((Side)damper->origin) * damper->r < 0) {
        damper->zero_gap_terms = 0;
        return;
    }
    damper->r = damper->w = 0;
    state->events++; // the motion begins anew
}

void adaptive_motion_take(Adaptive *own, double length) {
    ModalState *state = &own->steps->state;
    const size_t n = state->mode_count, m = state->dampers;
    const double *y = own->y, *before = own->before, *r = y + at_r(state);
    const size_t sums = at_impulse(state), totals = at_totals(state);
    memcpy(state->q, y, n * sizeof *y);
    memcpy(state->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        DamperState *damper = &state->damper[d];
        const double impulse = y[sums + d] - before[sums + d];
        double work = y[sums + m + d] - before[sums + m + d];
        damper->r = r[d];
        damper->w = r[m + d];
        if (damper->zero_gap_terms > 0)
            leave(state, damper);
        if (damper->phase == PHASE_CONTACT) {
            const ContactForce force = steps_contact(state, d, damper->r, damper->w);
            impact_log_force(&state->impacts, &damper->row, fabs(force.value));
            work -= force.strain - own->strain[d];
            own->strain[d] = force.strain;
        }
        if (damper->row.is_open)
            impact_log_stretch(&state->impacts, &damper->row, length, impulse,
                               damper->phase == PHASE_CONTACT ? work : 0);
    }
    impact_log_work(&state->impacts, y[totals] - before[totals],
                    y[totals + 1] - before[totals + 1]);
    own->steps->record.base_speed += y[totals + 2] - before[totals + 2];
}

Status adaptive_motion_make(Adaptive *own, Steps *steps) {
    const ModalState *state = &steps->state;
    const size_t m = state->dampers;
    own->steps = steps;
    own->size = at_totals(state) + TOTALS;
    own->events = SIZE_MAX;
    own->block = calloc(4 * own->size + 2 * m + 1, sizeof *own->block);
    const OdeSystem system = {.context = own,
                              .size = own->size,
                              .roots = state->has_stops ? ADAPTIVE_WATCHED * m : 0,
                              .tolerance = steps->tolerance,
                              .rate = rate,
                              .progress = progress};
    if (own->block != NULL)
        own->ode = ode_new(&system);
    if (own->ode == NULL)
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    own->y = own->block;
    own->before = own->y + own->size;
    own->scale = own->before + own->size;
    own->rates = own->scale + own->size;
    own->force = own->rates + own->size;
    own->strain = own->force + m;
    own->rated = own->strain + m;
    return STATUS_OK;
}

void adaptive_motion_free(Adaptive *own) {
    ode_free(own->ode);
    free(own->block);
}
