// The state is (q, p; r, w of the dampers), followed by what is summed up on the way: impulse and
// work of each damper's force, the base's work, the structure's loss and the base's speed. Each
// damper has three watched functions:
//
//   in contact:  the penetration; the law's kink; dN/dt, whose fall through zero is a peak of N
//   in flight:   the gaps to its two stops
#include "core/solve/frame_ode.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WATCHED = 3, END = 0, KINK = 1, PEAK = 2, TOTALS = 3 };

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
static size_t size_of(const Frame *frame) {
    return at_totals(frame) + TOTALS;
}

static ContactForce force_at(const Frame *frame, size_t d, const double *y) {
    const FrameDamper *damper = &frame->damper[d];
    const double sign = frame_sign(damper->side);
    if (damper->phase != FRAME_CONTACT)
        return (ContactForce){0};
    const double *r = y + at_r(frame);
    return frame->plan->law->force(&damper->contact, sign * r[d], sign * r[frame->dampers + d]);
}

static void rate(const void *context, double t, const double *y, double *out) {
    const FrameOde *ode = context;
    const Frame *frame = ode->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *q = y, *p = y + n, *w = y + at_r(frame) + m;
    double *acceleration = out + n, *relative = out + at_r(frame) + m;
    double *impulse = out + at_impulse(frame), *total = out + at_totals(frame);
    const double ground = slice_at(&ode->slice, t - ode->at);
    double *modes = ode->elastic + frame->padded; // whole vectors
    memcpy(modes, q, n * sizeof *q);
    memcpy(modes + frame->padded, p, n * sizeof *p);
    frame_elastic(frame, modes, modes + frame->padded, ode->elastic);
    memcpy(out, p, n * sizeof *p);
    memcpy(out + at_r(frame), w, m * sizeof *w);
    for (size_t i = 0; i < n; i++)
        acceleration[i] = -ode->elastic[i] - frame->modes->participation[i] * ground;
    double momentum = frame_dot(frame->carry, p, n), loss = frame_dot(ode->elastic, p, n);
    for (size_t i = 0; i < n; i++)
        loss -= frame->omega2[i] * q[i] * p[i];
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        relative[d] = damper->lean * ground + frame_dot(damper->shape, ode->elastic, n);
        momentum += damper->plan->mass * w[d];
    }
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double force = frame_sign(damper->side) * force_at(frame, d, y).value;
        impulse[d] = force;
        impulse[m + d] = force * w[d];
        if (damper->phase != FRAME_CONTACT)
            continue;
        for (size_t i = 0; i < n; i++)
            acceleration[i] += damper->shape[i] * force;
        for (size_t e = 0; e < m; e++)
            relative[e] -= frame->yield[e * m + d] * force;
    }
    total[0] = -ground * momentum;
    total[1] = loss;
    total[2] = ground;
}

static void watch(const void *context, double t, const double *y, double *value, double *slope) {
    const FrameOde *ode = context;
    const Frame *frame = ode->frame;
    const size_t m = frame->dampers;
    const double *r = y + at_r(frame), *w = r + m;
    rate(context, t, y, ode->rates);
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        double *is = value + WATCHED * d, *goes = slope + WATCHED * d;
        if (damper->phase == FRAME_CONTACT) {
            const double sign = frame_sign(damper->side);
            const ContactForce force = force_at(frame, d, y);
            is[END] = sign * r[d];
            goes[END] = sign * w[d];
            is[KINK] = ode->turn[d] * force.kink;
            is[PEAK] = sign * (force.by_penetration * w[d] +
                               force.by_speed * ode->rates[at_r(frame) + m + d]);
            goes[KINK] = goes[PEAK] = (double)NAN;
            continue;
        }
        for (int side = 0; side < 2; side++) {
            const double sign = frame_sign((Side)side);
            is[side] = frame_room(damper, (Side)side) - sign * r[d];
            goes[side] = -sign * w[d];
        }
        is[PEAK] = goes[PEAK] = 1;
    }
}

Status frame_ode_make(FrameOde *ode, Frame *frame, Problem *problem) {
    memset(ode, 0, sizeof *ode);
    ode->frame = frame;
    if (frame->plan->form != CONTACT_POWER || frame->dampers == 0)
        return STATUS_OK;
    const size_t size = size_of(frame), m = frame->dampers;
    ode->block = calloc(4 * size + 2 * m + 3 * frame->padded, sizeof *ode->block);
    const OdeSystem system = {
        .context = ode, .size = size, .roots = WATCHED * m, .rate = rate, .watch = watch};
    if (ode->block != NULL)
        ode->ode = ode_new(&system);
    if (ode->ode == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for contacts of %zu dampers", m);
    ode->y = ode->block;
    ode->scale = ode->y + size;
    ode->before = ode->scale + size;
    ode->rates = ode->before + size;
    ode->strain = ode->rates + size;
    ode->turn = ode->strain + m;
    ode->elastic = ode->turn + m;
    ode->events = SIZE_MAX;
    return STATUS_OK;
}

void frame_ode_clear(FrameOde *ode) {
    ode_free(ode->ode);
    free(ode->block);
}

bool frame_ode_serves(const FrameOde *ode) {
    for (size_t d = 0; ode->ode != NULL && d < ode->frame->dampers; d++)
        if (ode->frame->damper[d].phase == FRAME_CONTACT)
            return true;
    return false;
}

// What is large for each component; returns the time in which a contact goes on.
static double make_scale(FrameOde *ode) {
    const Frame *frame = ode->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    double *scale = ode->scale, *relative = scale + at_r(frame), *sums = scale + at_impulse(frame);
    double square = frame_dot(frame->p, frame->p, n), time = frame->interval, fastest = 0;
    double momentum = 0, energy = 0;
    for (size_t i = 0; i < n; i++)
        square += frame->omega2[i] * frame->q[i] * frame->q[i];
    memset(scale, 0, size_of(frame) * sizeof *scale);
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        if (damper->phase != FRAME_CONTACT)
            continue;
        // A contact that begins at no speed is pressed to one by all the rest.
        const double wide = frame_dot(damper->shape, damper->shape, n) * square;
        const double speed = fmax(damper->contact.speed, fmax(fabs(damper->w), 1e-3 * sqrt(wide)));
        const double mass = damper->effective_mass;
        const double depth = pow(mass * speed * speed / damper->contact.stiffness,
                                 1 / (damper->contact.exponent + 1));
        time = fmin(time, 3 * depth / speed);
        fastest = fmax(fastest, speed);
        momentum = fmax(momentum, mass * speed);
        energy = fmax(energy, mass * speed * speed);
        for (size_t i = 0; i < n; i++)
            scale[n + i] += fabs(damper->shape[i]) * mass * speed;
    }
    for (size_t i = 0; i < n; i++)
        scale[i] = scale[n + i] * time;
    for (size_t d = 0; d < m; d++) {
        relative[d] = fastest * time;
        relative[m + d] = fastest;
        sums[d] = momentum;
        sums[m + d] = energy;
    }
    sums[2 * m] = sums[2 * m + 1] = energy;
    sums[2 * m + 2] = fastest;
    return time;
}

static Status start(FrameOde *ode, Problem *problem) {
    const Frame *frame = ode->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    double *y = ode->y, *r = y + at_r(frame);
    memset(y, 0, size_of(frame) * sizeof *y);
    memcpy(y, frame->q, n * sizeof *y);
    memcpy(y + n, frame->p, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        r[d] = frame->damper[d].r;
        r[m + d] = frame->damper[d].w;
    }
    for (size_t d = 0; d < m; d++) {
        const ContactForce force = force_at(frame, d, y);
        ode->strain[d] = force.strain;
        // At a kink rounding alone says on which side.
        if (!ode->is_turned)
            ode->turn[d] = force.kink < 0 ? -1 : 1;
    }
    const double time = make_scale(ode);
    ode->is_turned = false;
    ode->at = 0;
    return ode_start(ode->ode, y, ode->scale, time / 64, problem);
}

// The frame's state becomes y; what was summed up goes where it belongs.
static void take(FrameOde *ode, FrameOdeStep *step) {
    Frame *frame = ode->frame;
    const size_t n = frame->mode_count, m = frame->dampers;
    const double *y = ode->y, *before = ode->before, *r = y + at_r(frame);
    const size_t sums = at_impulse(frame), totals = at_totals(frame);
    memcpy(frame->q, y, n * sizeof *y);
    memcpy(frame->p, y + n, n * sizeof *y);
    for (size_t d = 0; d < m; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->r = r[d];
        damper->w = r[m + d];
        if (damper->phase != FRAME_CONTACT)
            continue;
        const ContactForce force = force_at(frame, d, y);
        const double work = y[sums + m + d] - before[sums + m + d];
        ledger_force(&frame->ledger, &damper->row, force.value);
        ledger_stretch(&frame->ledger, &damper->row, step->length, y[sums + d] - before[sums + d],
                       work - (force.strain - ode->strain[d]));
        ode->strain[d] = force.strain;
    }
    step->input = y[totals] - before[totals];
    step->damping = y[totals + 1] - before[totals + 1];
    step->ground = y[totals + 2] - before[totals + 2];
}

// A buffer that has let go without having been pressed: its gap opened from the first instant on.
static void find_open(const Frame *frame, FrameOdeStep *step) {
    for (size_t d = 0; d < frame->dampers && !step->is_event; d++) {
        const FrameDamper *damper = &frame->damper[d];
        if (damper->phase != FRAME_CONTACT || !(frame_sign(damper->side) * damper->r < 0))
            continue;
        step->is_event = true;
        step->event = (FrameEvent){.damper = d, .s = 1, .side = damper->side};
    }
}

Status frame_ode_step(FrameOde *ode, const Slice *slice, double length, FrameOdeStep *step,
                      Problem *problem) {
    Frame *frame = ode->frame;
    int root;
    *step = (FrameOdeStep){0};
    ode->slice = *slice;
    if (ode->events != frame->events)
        TRY(start(ode, problem));
    ode->events = frame->events;
    const double from = ode->at;
    double to;
    memcpy(ode->before, ode->y, size_of(frame) * sizeof *ode->y);
    TRY(ode_step(ode->ode, from + length, &to, ode->y, &root, problem));
    // The integration's own clock may be coarser than the frame's.
    step->length = root == ODE_NO_ROOT && to >= from + length ? length : to - from;
    ode->at = to;
    take(ode, step);
    if (root != ODE_NO_ROOT) {
        const size_t d = (size_t)root / WATCHED;
        const int which = root % WATCHED;
        if (frame->damper[d].phase != FRAME_CONTACT || which == END) {
            const Side side =
                frame->damper[d].phase == FRAME_CONTACT ? frame->damper[d].side : (Side)which;
            step->is_event = true;
            step->event = (FrameEvent){.damper = d, .s = 1, .side = side};
        } else {
            frame->events++; // a step may end where it began
            if (which == PEAK) {
                ode->events = frame->events;
            } else { // no step may straddle it: the motion begins anew
                ode->turn[d] = -ode->turn[d];
                ode->is_turned = true;
            }
        }
    }
    find_open(frame, step);
    return STATUS_OK;
}
