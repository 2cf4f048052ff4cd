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
static size_t at_r(const Frame *frame) {
    return 2 * frame->mode_count;
}
static size_t at_impulse(const Frame *frame) {
    return at_r(frame) + 2 * frame->dampers;
}
static size_t at_totals(const Frame *frame) {
    return at_impulse(frame) + 2 * frame->dampers;
}

// N of all dampers at y.
static void feel(const Adaptive *own, const double *y, double ground) {
    Steps *steps = own->steps;
    const Frame *frame = &steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *r = y + at_r(frame), *w = r + m;
    if (frame->resting > 0)
        steps_elastic(frame, y, y + n, steps->elastic);
    for (size_t d = 0; d < m; d++) {
        own->force[d] = 0;
        if (frame->damper[d].phase == FRAME_CONTACT)
            own->force[d] = steps_contact(frame, d, r[d], w[d]).value;
        if (frame->damper[d].phase != FRAME_RESTING)
            continue;
        for (size_t e = 0; e < m; e++)
            if (frame->damper[e].phase == FRAME_RESTING)
                own->force[d] +=
                    frame->hold[d * m + e] * (frame_dot(frame->damper[e].shape, steps->elastic, n) +
                                              frame->damper[e].lean * ground);
    }
}

static void rate(const void *context, double t, const double *y, double *out) {
    const Adaptive *own = context;
    const Frame *frame = &own->steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *p = y + n, *w = y + at_r(frame) + m;
    double *impulse = out + at_impulse(frame), *total = out + at_totals(frame);
    const double ground = slice_at(&own->slice, t - own->at);
    feel(own, y, ground);
    ++*own->rated;
    steps_rate(own->steps, y, ground, own->force, out);
    double momentum = frame_dot(frame->carry, p, n), loss = 0;
    for (size_t i = 0; i < n; i++)
        loss += (own->steps->elastic[i] - frame->omega2[i] * y[i]) * p[i];
    for (size_t d = 0; d < m; d++) {
        momentum += frame->damper[d].plan->mass * w[d];
        impulse[d] = own->force[d];
        impulse[m + d] = own->force[d] * w[d];
        if (frame->damper[d].phase == FRAME_RESTING) // but for rounding
            out[at_r(frame) + d] = out[at_r(frame) + m + d] = 0;
    }
    total[0] = -ground * momentum;
    total[1] = loss;
    total[2] = ground;
}

static void progress(const void *context, double t, const double *y, double *value, double *slope) {
    const Adaptive *own = context;
    const Frame *frame = &own->steps->frame;
    const size_t m = frame->dampers;
    const double *r = y + at_r(frame), *w = r + m;
    rate(context, t, y, own->rates);
    for (size_t d = 0; d < m && frame->has_stops; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double sign = frame_sign(damper->side);
        double *is = value + ADAPTIVE_WATCHED * d, *goes = slope + ADAPTIVE_WATCHED * d;
        for (int k = 0; k < ADAPTIVE_WATCHED; k++)
            is[k] = goes[k] = 1;
        if (damper->phase == FRAME_FLIGHT) {
            for (int side = 0; side < 2; side++) {
                is[side] = frame_room(damper, (Side)side) - frame_sign((Side)side) * r[d];
                goes[side] = -frame_sign((Side)side) * w[d];
            }
        } else if (damper->phase == FRAME_RESTING) {
            is[ADAPTIVE_FIRST] = sign * own->force[d];
            goes[ADAPTIVE_FIRST] = (double)NAN;
        } else {
            const ContactForce force = steps_contact(frame, d, r[d], w[d]);
            const bool is_inside = damper->phase == FRAME_INSIDE;
            const bool is_by_force = is_inside || frame->plan->separation == SEPARATION_ZERO_FORCE;
            const double grows = sign * (force.by_penetration * w[d] +
                                         force.by_speed * own->rates[at_r(frame) + m + d]);
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
    const double interval = own->steps->frame.interval;
    return fabs(own->slice.value) + fabs(own->slice.slope) * interval;
}

bool adaptive_motion_has_outgrown(const Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    return push_of(own) > GROWN * own->push || frame_size(frame) > GROWN * own->speed;
}

// What is large for each component; returns a first step.
static double make_scale(Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    double *scale = own->scale, *r = scale + at_r(frame), *w = r + m;
    double *impulse = scale + at_impulse(frame), *totals = scale + at_totals(frame);
    double time = frame->interval, energy = 0;
    own->push = fmax(own->push, push_of(own));
    own->speed =
        fmax(own->speed, fmax(frame_size(frame), frame->drive * own->push * frame->interval));
    // A structure at rest will have what its masses bring.
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double mobility = frame_dot(damper->shape, damper->shape, n);
        own->speed = fmax(own->speed, damper->effective_mass * fabs(damper->w) * sqrt(mobility));
    }
    for (size_t i = 0; i < n; i++) {
        scale[n + i] = own->speed;
        scale[i] = own->speed / fmax(sqrt(frame->omega2[i]), 1 / frame->plan->duration);
    }
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double mass = damper->effective_mass;
        const double wide = sqrt(frame_dot(damper->shape, damper->shape, n)) * own->speed;
        const double speed =
            fmax(fabs(damper->w), damper->phase == FRAME_CONTACT ? 1e-3 * wide : wide);
        // Not far from a stop the mass may be back at once, and the integrator finds a root to a
        // part of its step alone.
        const double pull = fabs(own->rates[at_r(frame) + m + d]);
        if (damper->phase == FRAME_FLIGHT && damper->origin != FRAME_FROM_MIDDLE && pull > 0)
            time = fmin(time, (fabs(damper->w) + sqrt(2 * pull * fabs(damper->r))) / pull);
        w[d] = speed;
        r[d] = fmax(damper->plan->clearance, speed * frame->interval);
        if (damper->phase == FRAME_CONTACT) {
            const double exponent =
                frame->plan->form == CONTACT_POWER ? damper->contact.exponent : 1;
            r[d] = pow(mass * speed * speed / damper->contact.stiffness, 1 / (exponent + 1));
            if (speed > 0)
                time = fmin(time, r[d] / speed);
        }
        impulse[d] = mass * speed;
        impulse[m + d] = mass * speed * speed;
        energy += mass * speed * speed;
    }
    totals[0] = totals[1] = energy + own->speed * own->speed;
    totals[2] = own->push * frame->interval;
    return time / (8 * (double)own->steps->share);
}

Status adaptive_motion_start(Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    double *r = own->y + at_r(frame);
    memset(own->y, 0, own->size * sizeof *own->y);
    memcpy(own->y, frame->q, n * sizeof *own->y);
    memcpy(own->y + n, frame->p, n * sizeof *own->y);
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        r[d] = damper->r;
        r[m + d] = damper->w;
        own->strain[d] = damper->phase == FRAME_CONTACT
                             ? steps_contact(frame, d, damper->r, damper->w).strain
                             : 0;
    }
    own->at = 0;
    own->events = frame->events;
    rate(own, 0, own->y, own->rates);
    return ode_start(own->ode, own->y, own->scale, make_scale(own), frame->problem);
}

// Has the gap of a mass released from rest opened beyond rounding yet?
static void leave(Frame *frame, FrameDamper *damper) {
    if (frame_sign((Side)damper->origin) * damper->r < 0) {
        damper->leaving = 0;
        return;
    }
    damper->r = damper->w = 0;
    frame->events++; // the motion begins anew
}

void adaptive_motion_take(Adaptive *own, double length) {
    Frame *frame = &own->steps->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *y = own->y, *before = own->before, *r = y + at_r(frame);
    const size_t sums = at_impulse(frame), totals = at_totals(frame);
    memcpy(frame->q, y, n * sizeof *y);
    memcpy(frame->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        FrameDamper *damper = &frame->damper[d];
        const double impulse = y[sums + d] - before[sums + d];
        double work = y[sums + m + d] - before[sums + m + d];
        damper->r = r[d];
        damper->w = r[m + d];
        if (damper->leaving > 0)
            leave(frame, damper);
        if (damper->phase == FRAME_CONTACT) {
            const ContactForce force = steps_contact(frame, d, damper->r, damper->w);
            ledger_force(&frame->ledger, &damper->row, fabs(force.value));
            work -= force.strain - own->strain[d];
            own->strain[d] = force.strain;
        }
        if (damper->row.is_open)
            ledger_stretch(&frame->ledger, &damper->row, length, impulse,
                           damper->phase == FRAME_CONTACT ? work : 0);
    }
    ledger_work(&frame->ledger, y[totals] - before[totals], y[totals + 1] - before[totals + 1]);
    own->steps->record.base_speed += y[totals + 2] - before[totals + 2];
}

Status adaptive_motion_make(Adaptive *own, Steps *steps) {
    const Frame *frame = &steps->frame;
    const size_t m = frame->dampers;
    own->steps = steps;
    own->size = at_totals(frame) + TOTALS;
    own->events = SIZE_MAX;
    own->block = calloc(4 * own->size + 2 * m + 1, sizeof *own->block);
    const OdeSystem system = {.context = own,
                              .size = own->size,
                              .roots = frame->has_stops ? ADAPTIVE_WATCHED * m : 0,
                              .tolerance = steps->tolerance,
                              .rate = rate,
                              .progress = progress};
    if (own->block != NULL)
        own->ode = ode_new(&system);
    if (own->ode == NULL)
        return problem_set(frame->problem, STATUS_NO_MEMORY, "no memory for a run");
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
