// With s = shape . (D p + W^2 q) + lean a_g the contact is r'' = s - N / m_e, N = k r + c w, and
// its size E^2 = w^2 + (k / m_e) r^2 grows by no more than |s| in unit time. The structure's V^2 =
// p'p + q'W^2 q grows by no more than growth V + |participation| |a_g| + |shape| |N|, while |s| <=
// reach V + |lean| |a_g| and |N| <= hard E. That bounds V, E, s and N over a step.
//
// Were s a straight line, a mass that is merely pressed would ride at
//   (s - (c / m_e) s' m_e / k) m_e / k   with   N = m_e s,
// and the size of what is left of r grows by no more than s strays from that line. Of its bend what
// N does through the structure's damping, coupling = shape . D shape, is kept apart, for N is fast.
#include "core/solve/frame_press.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

Status frame_press_make(FramePress *press, const Frame *frame, Problem *problem) {
    const size_t n = frame->storeys, size = 2 * (n + 1) + 2;
    memset(press, 0, sizeof *press);
    if (frame->plan->form != CONTACT_LINEAR || frame->dampers == 0)
        return STATUS_OK;
    press->stops = calloc(2 * frame->dampers, sizeof *press->stops);
    press->block = calloc(2 * size + n, sizeof *press->block);
    if (press->stops == NULL || press->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    press->count = 2 * frame->dampers;
    press->start = press->block;
    press->gained = press->start + size;
    press->elastic = press->gained + size;
    for (size_t i = 0; i < PRESS_LEVELS; i++) {
        press->length[i] = ldexp(frame->interval, -(int)i);
        frame_flight_ground(frame->turning, press->length[i], press->ground[i], press->fall[i]);
    }
    return STATUS_OK;
}

static void clear_stop(FramePressStop *stop) {
    for (size_t i = 0; i < PRESS_LEVELS; i++)
        frame_dense_clear(&stop->levels[i]);
    free(stop->damped);
}

void frame_press_clear(FramePress *press) {
    for (size_t i = 0; i < press->count; i++)
        clear_stop(&press->stops[i]);
    free(press->stops);
    free(press->block);
}

// The only damper in contact where all others fly; NULL otherwise.
static FrameDamper *find_alone(const Frame *frame) {
    FrameDamper *alone = NULL;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper->phase == FRAME_FLIGHT && damper->leaving == 0)
            continue;
        if (damper->phase != FRAME_CONTACT || alone != NULL)
            return NULL;
        alone = damper;
    }
    return alone;
}

// A step takes some products for each two modes, an arc more of them for each mode.
static bool is_worth(const Frame *frame, double arcs) {
    return arcs > 2 + (double)frame->storeys / 30;
}

// Makes the stop's transitions when arcs have cost about as much as it does. False: there is none.
static bool prepare(FramePressStop *stop, const Frame *frame, const FrameDamper *damper) {
    if (stop->levels[0].block != NULL)
        return true;
    const double n = (double)frame->storeys, arcs = frame->interval * frame_rate(frame);
    if (stop->is_given_up || !isfinite(damper->plan->stops[damper->side].stiffness) ||
        !is_worth(frame, arcs) || !(arcs < 0x1p20))
        return false;
    stop->spent += 256 * n;
    if (stop->spent < 256 * n * n * n)
        return false;
    stop->damped = calloc(2 * frame->storeys, sizeof *stop->damped);
    if (stop->damped == NULL ||
        frame_dense_make(stop->levels, PRESS_LEVELS, frame, damper, NULL) != STATUS_OK) {
        clear_stop(stop);
        *stop = (FramePressStop){.is_given_up = true};
        return false;
    }
    stop->bent = stop->damped + frame->storeys;
    for (size_t i = 0; i < frame->storeys; i++) {
        const double *row = frame->modes->damping + i * frame->storeys;
        stop->damped[i] = frame_dot(row, damper->shape, frame->storeys);
        stop->bent[i] = frame->omega2[i] * damper->shape[i];
    }
    return true;
}

// What holds over the whole step.
typedef struct Bounds {
    double size;                // V
    double shaken;              // |a_g|
    double force;               // |N|
    double ride[2], ride_force; // r of a mass that is merely pressed, at both ends; least N, signed
    double stir, stir_force;    // how far r and N are from these
} Bounds;

// s' now; p' but for what N does to it is -elastic - participation a_g.
static double change_now(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                         const Slice *slice, const double *elastic, double coupled_force) {
    const double *share = frame->modes->participation;
    const double rate = slice->omega > 0 ? slice->omega * slice->slope : slice->slope;
    double sum = damper->lean * rate + coupled_force;
    for (size_t i = 0; i < frame->storeys; i++)
        sum +=
            stop->bent[i] * frame->p[i] - stop->damped[i] * (elastic[i] + share[i] * slice->value);
    return sum;
}

// False: there are none. `elastic` and s are those at the start.
static bool find_bounds(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                        const Slice *slice, const double *elastic, double s, double h, Bounds *at) {
    const size_t n = frame->storeys;
    const double r = damper->r, w = damper->w, sign = frame_sign(damper->side);
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double mass = damper->effective_mass, omega2 = k / mass, omega = sqrt(omega2);
    const double hard = k / omega + c, lean = fabs(damper->lean);
    const double wide = sqrt(frame_dot(damper->shape, damper->shape, n));
    const double bent = sqrt(frame_dot(stop->bent, stop->bent, n));
    const double damped = sqrt(frame_dot(stop->damped, stop->damped, n));
    const double coupling = frame_dot(damper->shape, stop->damped, n);
    const double shaken = frame_flight_shaken(slice, h);
    const double shaking = slice->omega > 0 ? slice->omega * shaken : fabs(slice->slope);
    const double left = 1 - h * (frame->growth + h * wide * hard * damper->reach);
    if (!(left > 0.25))
        return false;
    const double size = hypot(w, omega * r);
    at->shaken = shaken;
    at->size = (frame_size(frame) +
                h * (frame->drive * shaken + wide * hard * (size + h * lean * shaken))) /
               left;
    const double push = lean * shaken + damper->reach * at->size; // |s|
    const double most = size + h * push, force = hard * most;
    const double now = k * r + c * w;
    const double slope = change_now(stop, frame, damper, slice, elastic, coupling * now);
    const double pull = (frame->viscous + sqrt(frame->stiff)) * at->size + frame->drive * shaken;
    const double bow = lean * slice->omega * shaking + bent * (pull + wide * force) +
                       damped * (frame->viscous * (pull + wide * force) + frame->stiff * at->size +
                                 frame->drive * shaking); // |s''| without N'
    const double stray = coupling * (force + fabs(now));
    const double start = (s - c / mass * slope / omega2) / omega2;
    const double stirred =
        hypot(w - slope / omega2, omega * (r - start)) + h * h / 2 * (stray + h / 3 * bow);
    at->ride[0] = start;
    at->ride[1] = start + h * slope / omega2;
    at->ride_force = mass * fmin(sign * s, sign * (s + h * slope));
    at->stir = stirred / omega;
    at->stir_force = hard * stirred;
    at->force = fmin(force, mass * fmax(fabs(s), fabs(s + h * slope)) + at->stir_force);
    return isfinite(stirred);
}

static bool surely_lasts(const Frame *frame, const FrameDamper *damper, const Bounds *at) {
    const double sign = frame_sign(damper->side);
    if (frame->plan->separation == SEPARATION_ZERO_FORCE)
        return at->ride_force > at->stir_force;
    return fmin(sign * at->ride[0], sign * at->ride[1]) > at->stir;
}

// Whether all others stay in flight; they are ready to be moved then.
static bool others_are_clear(const FramePress *press, Frame *frame, const FrameDamper *alone,
                             const Bounds *at, double length, double fallen) {
    const size_t n = frame->storeys, a = (size_t)(alone - frame->damper);
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (d == a)
            continue;
        const double bend = damper->reach * at->size + fabs(damper->lean) * at->shaken +
                            fabs(frame->yield[d * frame->dampers + a]) * at->force;
        damper->storey_speed = frame_dot(damper->shape, frame->p, n);
        damper->gained = length * (damper->storey_speed + damper->w) - fallen -
                         frame_dot(damper->shape, press->gained, n);
        if (!frame_flight_is_clear(damper, damper->r, damper->r + damper->gained, bend, length))
            return false;
    }
    return true;
}

static void add_work(const FramePress *press, const FrameDense *dense, Frame *frame,
                     FrameDamper *alone, const Slice *slice, double length, FrameWork *work) {
    const size_t n = frame->storeys;
    const double *start = press->start, *gained = press->gained;
    work->damping = frame_dense_form(dense->loss, start, dense->size);
    work->input = -(slice->value * frame_dot(dense->input[0], start, dense->size) +
                    slice->slope * frame_dot(dense->input[1], start, dense->size));
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        if (damper != alone)
            work->input -= damper->plan->mass * work->ground *
                           (damper->storey_speed + damper->w - work->ground / 2);
    }
    // What the free mass's own momentum has lost to it.
    const double impulse = -alone->plan->mass * (frame_dot(alone->shape, gained + n + 1, n) +
                                                 gained[2 * n + 1] + work->ground);
    const double force = alone->contact.stiffness * (alone->r + gained[n]) +
                         alone->contact.damping * (alone->w + gained[2 * n + 1]);
    ledger_force(&frame->ledger, &alone->row, fabs(force));
    ledger_stretch(&frame->ledger, &alone->row, length, impulse,
                   frame_dense_form(dense->contact, start, dense->size));
}

// What (q, r, p, w) gain over one level's length.
static void find_gained(FramePress *press, const FrameDense *dense, const Frame *frame,
                        const FrameDamper *alone, const Slice *slice) {
    const size_t n = frame->storeys, freedoms = n + 1;
    double *start = press->start;
    memcpy(start, frame->q, n * sizeof *start);
    memcpy(start + freedoms, frame->p, n * sizeof *start);
    start[n] = alone->r;
    start[freedoms + n] = alone->w;
    start[2 * freedoms] = slice->value;
    start[2 * freedoms + 1] = slice->slope;
    memset(press->gained, 0, 2 * freedoms * sizeof *press->gained);
    frame_dense_add(dense->gain, 2 * freedoms, start, dense->size, press->gained);
}

static void move(const FramePress *press, Frame *frame, FrameDamper *alone, double ground) {
    const size_t n = frame->storeys;
    const double *gained = press->gained, *speed = gained + n + 1;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper == alone)
            continue;
        damper->r += damper->gained;
        damper->w -= ground + frame_dot(damper->shape, speed, n);
    }
    for (size_t i = 0; i < n; i++) {
        frame->q[i] += gained[i];
        frame->p[i] += speed[i];
    }
    alone->r += gained[n];
    alone->w += speed[n];
    alone->is_fresh = false;
    frame->still_events = 0;
}

double frame_press_step(FramePress *press, Frame *frame, const Slice *slice, double length,
                        FrameWork *work) {
    FrameDamper *alone = press->count > 0 ? find_alone(frame) : NULL;
    if (alone == NULL)
        return 0;
    FramePressStop *stop = &press->stops[2 * (size_t)(alone - frame->damper) + alone->side];
    if (!prepare(stop, frame, alone))
        return 0;
    frame_elastic(frame, frame->q, frame->p, press->elastic);
    const double s =
        alone->lean * slice->value + frame_dot(alone->shape, press->elastic, frame->storeys);
    const double rate = frame_rate(frame);
    for (size_t i = 0; i < PRESS_LEVELS && is_worth(frame, press->length[i] * rate); i++) {
        const FrameDense *dense = &stop->levels[i];
        const double h = press->length[i];
        Bounds at;
        // A force that may be the largest so far is to be seen where it is so.
        if (h > length * (1 + 1e-15) || dense->block == NULL ||
            !find_bounds(stop, frame, alone, slice, press->elastic, s, h, &at) ||
            !surely_lasts(frame, alone, &at) ||
            (!frame->is_shadow && at.force > alone->row.impact.peak_force))
            continue;
        find_gained(press, dense, frame, alone, slice);
        const double *ground = press->ground[i], *fall = press->fall[i];
        const double fallen = fall[0] * slice->value + fall[1] * slice->slope;
        if (!others_are_clear(press, frame, alone, &at, h, fallen))
            continue;
        const double sum = ground[0] * slice->value + ground[1] * slice->slope;
        if (work != NULL) {
            work->ground = sum;
            add_work(press, dense, frame, alone, slice, h, work);
        }
        move(press, frame, alone, sum);
        return h;
    }
    return 0;
}
