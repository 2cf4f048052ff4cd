// Steps as long as a tolerance allows, by math/ode.h, over all modes and masses together. They end
// at every sample, at every kink of the base and where a contact begins or ends, which the
// integrator finds as roots; what it does not see, a stop that is grazed within a step, is missed.
// An impact is the exact engine's (frame_events.h), and so is its rule for chatter: where all
// bounces to come take less time than the clock resolves, the mass rests.
//
// The state (q, p; r, w) is followed by what is summed up: impulse and work of each damper's force,
// the base's work, the structure's loss and the base's speed. Each damper has three watched
// functions:
//
//   in flight    the gaps to its two stops
//   in contact   the penetration (zero force: N); dN/dt, whose fall through zero is a peak of N
//   inside       -N; the penetration
//   at rest      N
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/ode.h"
#include "core/solve/frame_events.h"
#include "core/solve/steps_run.h"

enum { WATCHED = 3, FIRST = 0, SECOND = 1, PEAK = 2, TOTALS = 3, STILL_MOST = 1000 };

typedef struct Adaptive {
    Steps *steps;
    Ode *ode;
    size_t size; // of y
    double *y, *before, *scale, *rates, *force;
    double *strain; // of the dampers' buffers, at the last step [J]
    double *block;
    double speed;  // sqrt(p'p + q'W^2 q) at most, so far
    Slice slice;   // of the base
    double at;     // the time at which it begins, and that of the state, since the start [s]
    size_t events; // of the frame as of the last step
} Adaptive;

// Where the parts of y begin.
static size_t at_r(const Frame *frame) {
    return 2 * frame->storeys;
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
    const size_t n = frame->storeys, m = frame->dampers;
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
    const size_t n = frame->storeys, m = frame->dampers;
    const double *p = y + n, *w = y + at_r(frame) + m;
    double *impulse = out + at_impulse(frame), *total = out + at_totals(frame);
    const double ground = slice_at(&own->slice, t - own->at);
    feel(own, y, ground);
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

static void watch(const void *context, double t, const double *y, double *value, double *slope) {
    const Adaptive *own = context;
    const Frame *frame = &own->steps->frame;
    const size_t m = frame->dampers;
    const double *r = y + at_r(frame), *w = r + m;
    rate(context, t, y, own->rates);
    for (size_t d = 0; d < m; d++) {
        const FrameDamper *damper = &frame->damper[d];
        const double sign = frame_sign(damper->side);
        double *is = value + WATCHED * d, *goes = slope + WATCHED * d;
        for (int k = 0; k < WATCHED; k++)
            is[k] = goes[k] = 1;
        if (damper->phase == FRAME_FLIGHT) {
            for (int side = 0; side < 2; side++) {
                is[side] = frame_room(damper, (Side)side) - frame_sign((Side)side) * r[d];
                goes[side] = -frame_sign((Side)side) * w[d];
            }
        } else if (damper->phase == FRAME_RESTING) {
            is[FIRST] = sign * own->force[d];
            goes[FIRST] = (double)NAN;
        } else {
            const ContactForce force = steps_contact(frame, d, r[d], w[d]);
            const bool is_inside = damper->phase == FRAME_INSIDE;
            const bool is_by_force = is_inside || frame->plan->separation == SEPARATION_ZERO_FORCE;
            const double grows = sign * (force.by_penetration * w[d] +
                                         force.by_speed * own->rates[at_r(frame) + m + d]);
            is[FIRST] = is_by_force ? (is_inside ? -sign : sign) * force.value : sign * r[d];
            goes[FIRST] = is_by_force ? (is_inside ? -grows : grows) : sign * w[d];
            is[is_inside ? SECOND : PEAK] = is_inside ? sign * r[d] : grows;
            goes[is_inside ? SECOND : PEAK] = is_inside ? sign * w[d] : (double)NAN;
        }
    }
}

// What is large for each component; returns a first step.
static double make_scale(Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    const size_t n = frame->storeys, m = frame->dampers;
    double *scale = own->scale, *r = scale + at_r(frame), *w = r + m;
    double *impulse = scale + at_impulse(frame), *totals = scale + at_totals(frame);
    const double push = fabs(own->slice.value) + fabs(own->slice.slope) * frame->interval;
    double time = frame->interval, energy = 0;
    own->speed = fmax(own->speed, fmax(frame_size(frame), frame->drive * push * frame->interval));
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
    totals[2] = push * frame->interval;
    return time / (8 * (double)own->steps->share);
}

static Status start(Adaptive *own) {
    const Frame *frame = &own->steps->frame;
    const size_t n = frame->storeys, m = frame->dampers;
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

// The frame's state becomes y; what was summed up goes where it belongs.
static void take(Adaptive *own, double length) {
    Frame *frame = &own->steps->frame;
    const size_t n = frame->storeys, m = frame->dampers;
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

static FrameEvent event_of(const Frame *frame, size_t d, int which) {
    const FrameDamper *damper = &frame->damper[d];
    return (FrameEvent){.damper = d,
                        .s = 1,
                        .side = damper->phase == FRAME_FLIGHT ? (Side)which : damper->side,
                        .is_inwards = damper->phase == FRAME_INSIDE && which == FIRST};
}

// What is beyond its end already, though no step has shown it come there: a buffer let go without
// having been pressed, a stop that rounding or a miss has put behind the mass, a rest without a
// push.
static bool find_beyond(Frame *frame, FrameEvent *event) {
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        const double sign = frame_sign(damper->side);
        if (damper->phase == FRAME_CONTACT && sign * damper->r < 0 && sign * damper->w < 0) {
            *event = event_of(frame, d, FIRST);
            return true;
        }
        // An acceleration that may be rounding alone.
        const double noise =
            64 * DBL_EPSILON *
            (damper->reach * frame_size(frame) + fabs(damper->lean * frame->ground));
        if (damper->phase == FRAME_RESTING &&
            sign * damper->force < -noise * damper->effective_mass) {
            *event = event_of(frame, d, FIRST);
            event->is_jump = true;
            return true;
        }
        for (int side = 0; side < 2 && damper->phase == FRAME_FLIGHT; side++) {
            const double toward = frame_sign((Side)side), speed = toward * damper->w;
            if (frame_room(damper, (Side)side) - toward * damper->r > 0)
                continue;
            // A flight that is over before the clock tells: the mass is back as fast as it went.
            const double pull = toward * frame_acceleration(frame, d);
            const bool is_back = speed <= 0 && -2 * speed < pull * frame_clock(frame) &&
                                 (damper->leaving == 0 || pull > noise);
            if (!(speed > 0 || is_back || damper->plan->clearance == 0))
                continue;
            damper->w = is_back ? -damper->w : damper->w;
            *event = event_of(frame, d, side);
            return true;
        }
    }
    return false;
}

static Status happen(Frame *frame, const FrameEvent *event) {
    const size_t most = STILL_MOST * frame->dampers;
    frame->events++;
    if (++frame->still_events > most)
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", most,
                           frame_time(frame));
    frame_happen(frame, event);
    return ledger_status(&frame->ledger, frame->problem);
}

static double adaptive_cost(size_t storeys, size_t dampers, bool is_coupled, double *making) {
    const double n = (double)storeys, m = (double)dampers;
    *making = 0;
    return 100 + 3 * n * (1 + m) + (is_coupled ? 0.1 * n * n : 0);
}

// One step, at most `length` long, and the event at its end.
static Status advance(Adaptive *own, double length) {
    Steps *steps = own->steps;
    Frame *frame = &steps->frame;
    FrameEvent event;
    double making, to;
    int root;
    const double knot = base_cursor_slice(&frame->base, frame->sample, frame->offset, &own->slice);
    frame->ground = own->slice.value;
    if (own->events != frame->events) {
        frame_feel(frame);
        if (find_beyond(frame, &event))
            return happen(frame, &event);
        TRY(start(own));
    }
    const double from = own->at;
    memcpy(own->before, own->y, own->size * sizeof *own->y);
    length = fmin(fmin(length, knot), steps->length);
    TRY(ode_step(own->ode, from + length, &to, own->y, &root, frame->problem));
    const double taken = root == ODE_NO_ROOT && to >= from + length ? length : to - from;
    own->at = to;
    take(own, taken);
    frame->offset += taken;
    frame->ground = slice_at(&own->slice, taken);
    if (taken > frame_clock(frame))
        frame->still_events = 0;
    TRY(steps_note(
        steps, adaptive_cost(frame->storeys, frame->dampers, frame->diagonal == NULL, &making)));
    if (root != ODE_NO_ROOT) {
        const size_t d = (size_t)root / WATCHED;
        const bool is_peak = root % WATCHED == PEAK;
        event = event_of(frame, d, root % WATCHED);
        if (!is_peak)
            return happen(frame, &event);
    }
    return find_beyond(frame, &event) ? happen(frame, &event) : STATUS_OK;
}

static Status adaptive_cross(Steps *steps, double length) {
    Adaptive *own = steps->own;
    Frame *frame = &steps->frame;
    const double clock = 2 * DBL_EPSILON * length;
    while (length - frame->offset > clock) {
        const double before = frame->offset;
        const size_t events = frame->events;
        TRY(advance(own, length - frame->offset));
        if (frame->offset == before && frame->events == events && own->at == 0)
            return problem_set(frame->problem, STATUS_UNSTABLE,
                               "the motion is too fast to be followed at t = %.6g s: a step of "
                               "1/%.6g s is below the clock's resolution",
                               frame_time(frame), frame_rate(frame));
    }
    return STATUS_OK;
}

static Status adaptive_make(Steps *steps) {
    Frame *frame = &steps->frame;
    const size_t m = frame->dampers;
    Adaptive *own = calloc(1, sizeof *own);
    steps->own = own;
    if (own != NULL) {
        own->steps = steps;
        own->size = at_totals(frame) + TOTALS;
        own->events = SIZE_MAX;
        own->block = calloc(4 * own->size + 2 * m, sizeof *own->block);
        const OdeSystem system = {.context = own,
                                  .size = own->size,
                                  .roots = WATCHED * m,
                                  .tolerance = steps->tolerance,
                                  .rate = rate,
                                  .watch = watch};
        if (own->block != NULL)
            own->ode = ode_new(&system);
    }
    if (own == NULL || own->ode == NULL)
        return problem_set(frame->problem, STATUS_NO_MEMORY, "no memory for a run");
    own->y = own->block;
    own->before = own->y + own->size;
    own->scale = own->before + own->size;
    own->rates = own->scale + own->size;
    own->force = own->rates + own->size;
    own->strain = own->force + m;
    // A mass that starts on a stop may touch it at t = 0.
    FrameEvent event;
    for (frame_feel(frame); find_beyond(frame, &event); frame_feel(frame))
        TRY(happen(frame, &event));
    return STATUS_OK;
}

static void adaptive_clear(Steps *steps) {
    Adaptive *own = steps->own;
    if (own != NULL) {
        ode_free(own->ode);
        free(own->block);
    }
    free(own);
    steps->own = NULL;
}

static const Stepper stepper = {.name = "adaptive",
                                .make = adaptive_make,
                                .cross = adaptive_cross,
                                .clear = adaptive_clear,
                                .cost = adaptive_cost};

static const double usual = 1e-9;

static double tolerance_of(const Accuracy *accuracy) {
    return accuracy == NULL ? usual
                            : ((const AccuracyTolerance *)(const void *)accuracy)->tolerance;
}

static Status run_all(Run *run, Response *response, Problem *problem) {
    return steps_run_pair(run, &stepper, 1, 1, tolerance_of(run->accuracy), response, problem);
}

static Status decide(const Accuracy *accuracy, double base_interval, Plan *plan, Problem *problem) {
    (void)base_interval;
    (void)problem;
    return decisions_add(
        &plan->report.decisions, "tolerance", tolerance_of(accuracy) == usual ? "usual" : "asked",
        tolerance_of(accuracy), NULL,
        "of each step; a step ends at every sample, at kinks of the base and where "
        "a contact begins or ends, and a stop grazed within a step is missed");
}

// Steps of a sample, of the base's kinks, and of the fastest mode; a contact takes some steps for
// its digits. At a guess seven contacts a second.
static double cost(const Accuracy *accuracy, double base_interval, const Plan *plan) {
    const Modes *modes = &plan->modes;
    const double digits = -log10(tolerance_of(accuracy)), each = pow(10, digits / 8) / 2;
    double making, fastest = 0, steps = plan->sample_rate;
    for (size_t i = 0; i < modes->count; i++)
        fastest = fmax(fastest, fmax(modes->omega[i], modes->damping[i * modes->count + i]));
    if (base_interval > 0)
        steps = fmax(steps, 1 / base_interval);
    steps = fmax(steps, fastest * each / 8) + 7 * 10 * each * (double)plan->damper_count;
    const double one = adaptive_cost(plan->storeys, plan->damper_count,
                                     modes->count > 0 && !modes->is_classical, &making);
    return 3 * one * steps * plan->duration; // the neighbour takes twice as many
}

// clang-format off
static const Field adaptive_fields[] = {
    FIELD_BASE(AccuracyTolerance, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyTolerance, tolerance, NULL, WITHIN(1e-13, 1e-2), 1e-9, "relative error that a step may make"),
    FIELD_END
};
// clang-format on

const Solver solver_adaptive = {
    .kind = {"adaptive", "steps as long as a tolerance allows, events found as roots",
             adaptive_fields, sizeof(AccuracyTolerance)},
    .run = run_all,
    .decide = decide,
    .cost = cost,
};
