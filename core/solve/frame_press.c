// With s = shape . (D p + W^2 q) + lean a_g the contact is r'' = s - N / m_e, N = k r + c w, and
// its size E^2 = w^2 + (k / m_e) r^2 grows by no more than |s| in unit time. The structure's V^2 =
// p'p + q'W^2 q grows by no more than growth V + |participation| |a_g| + |shape| |N|, while |s| <=
// reach V + |lean| |a_g| and |N| <= hard E. That bounds V, E, s and N over an interval, then s',
// and with them how far r and N stray from their chords.
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
    press->block = calloc(3 * size + n, sizeof *press->block);
    if (press->stops == NULL || press->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    press->count = 2 * frame->dampers;
    press->start = press->block;
    press->gained = press->start + size;
    press->end = press->gained + size;
    press->elastic = press->end + size;
    return STATUS_OK;
}

void frame_press_clear(FramePress *press) {
    for (size_t i = 0; i < press->count; i++) {
        frame_dense_clear(&press->stops[i].dense);
        free(press->stops[i].damped);
    }
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

// Makes the stop's transition when arcs have cost about as much as it does. False: there is none.
static bool prepare(FramePressStop *stop, const Frame *frame, const FrameDamper *damper) {
    if (stop->dense.block != NULL)
        return true;
    const double n = (double)frame->storeys, arcs = frame->interval * frame_rate(frame);
    // A step costs this many products for each freedom and freedom; an arc, for each freedom.
    if (stop->is_given_up || !isfinite(damper->plan->stops[damper->side].stiffness) ||
        !(arcs > 2 + n / 30 && arcs < 0x1p20))
        return false;
    stop->intervals += 256 * n * arcs;
    if (stop->intervals < 256 * n * n * n)
        return false;
    stop->damped = calloc(2 * frame->storeys, sizeof *stop->damped);
    stop->bent = stop->damped + frame->storeys;
    if (stop->damped == NULL || frame_dense_make(&stop->dense, frame, damper, NULL) != STATUS_OK) {
        frame_dense_clear(&stop->dense);
        stop->dense.block = NULL;
        stop->is_given_up = true;
        return false;
    }
    for (size_t i = 0; i < frame->storeys; i++) {
        const double *row = frame->modes->damping + i * frame->storeys;
        stop->damped[i] = frame_dot(row, damper->shape, frame->storeys);
        stop->bent[i] = frame->omega2[i] * damper->shape[i];
    }
    return true;
}

// N and its derivative at one end of the interval.
typedef struct End {
    double r, force, slope;
} End;

static End look(const FrameDamper *damper, double r, double w, double s) {
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double force = k * r + c * w;
    return (End){r, force, k * w + c * (s - force / damper->effective_mass)};
}

// What holds over the whole interval.
typedef struct Bounds {
    double size;                // V
    double shaken;              // |a_g|
    double force;               // |N|
    double bend, turn;          // |r''|, |N''|
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
                        const Slice *slice, const double *elastic, double s, Bounds *at) {
    const size_t n = frame->storeys;
    const double h = frame->interval, r = damper->r, w = damper->w, sign = frame_sign(damper->side);
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
    at->bend = push + force / mass;
    at->turn =
        k * at->bend + c * (fabs(slope) + stray + h * bow + (k * most + c * at->bend) / mass);
    return isfinite(at->turn);
}

static bool surely_lasts(const Frame *frame, const FrameDamper *damper, const Bounds *at, End first,
                         End last) {
    const double sign = frame_sign(damper->side), sag = frame->interval * frame->interval / 8;
    if (frame->plan->separation == SEPARATION_ZERO_FORCE)
        return fmin(sign * first.force, sign * last.force) > sag * at->turn ||
               at->ride_force > at->stir_force;
    return fmin(sign * first.r, sign * last.r) > sag * at->bend ||
           fmin(sign * at->ride[0], sign * at->ride[1]) > at->stir;
}

// Whether |N| is nowhere between the ends larger than at them or than it has been before.
static bool surely_has_no_peak(const Frame *frame, const FrameDamper *damper, const Bounds *at,
                               End first, End last) {
    const double peak = damper->row.impact.peak_force, h = frame->interval;
    if (at->force <= peak || frame->is_shadow ||
        fmax(fabs(first.force), fabs(last.force)) + h * h / 8 * at->turn <= peak)
        return true;
    return first.slope * last.slope > 0 && fabs(first.slope) + fabs(last.slope) > h * at->turn;
}

// Whether all others stay in flight; they are ready to be moved then.
static bool others_are_clear(const FramePress *press, Frame *frame, const FrameDamper *alone,
                             const Bounds *at, double fallen) {
    const size_t n = frame->storeys, a = (size_t)(alone - frame->damper);
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (d == a)
            continue;
        const double bend = damper->reach * at->size + fabs(damper->lean) * at->shaken +
                            fabs(frame->yield[d * frame->dampers + a]) * at->force;
        damper->storey_speed = frame_dot(damper->shape, frame->p, n);
        damper->gained = frame->interval * (damper->storey_speed + damper->w) - fallen -
                         frame_dot(damper->shape, press->gained, n);
        if (!frame_flight_is_clear(damper, damper->gained, bend, frame->interval))
            return false;
    }
    return true;
}

static void add_work(const FramePress *press, const FramePressStop *stop, Frame *frame,
                     FrameDamper *alone, const Slice *slice, double force, FrameWork *work) {
    const FrameDense *dense = &stop->dense;
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
    ledger_force(&frame->ledger, &alone->row, fabs(force));
    ledger_stretch(&frame->ledger, &alone->row, frame->interval, impulse,
                   frame_dense_form(dense->contact, start, dense->size));
}

bool frame_press_step(FramePress *press, Frame *frame, const FrameFlight *flight,
                      const Slice *slice, FrameWork *work) {
    FrameDamper *alone = press->count > 0 ? find_alone(frame) : NULL;
    if (alone == NULL)
        return false;
    FramePressStop *stop = &press->stops[2 * (size_t)(alone - frame->damper) + alone->side];
    if (!prepare(stop, frame, alone))
        return false;
    const size_t n = frame->storeys, freedoms = n + 1;
    double *start = press->start, *gained = press->gained, *end = press->end;
    Bounds at;
    frame_elastic(frame, frame->q, frame->p, press->elastic);
    const double s = alone->lean * slice->value + frame_dot(alone->shape, press->elastic, n);
    if (!find_bounds(stop, frame, alone, slice, press->elastic, s, &at))
        return false;
    memcpy(start, frame->q, n * sizeof *start);
    memcpy(start + freedoms, frame->p, n * sizeof *start);
    start[n] = alone->r;
    start[freedoms + n] = alone->w;
    start[2 * freedoms] = slice->value;
    start[2 * freedoms + 1] = slice->slope;
    memset(gained, 0, 2 * freedoms * sizeof *gained);
    frame_dense_add(stop->dense.gain, 2 * freedoms, start, stop->dense.size, gained);
    for (size_t i = 0; i < 2 * freedoms; i++)
        end[i] = start[i] + gained[i];
    frame_elastic(frame, end, end + freedoms, press->elastic);
    const double base = slice_at(slice, frame->interval);
    const End first = look(alone, alone->r, alone->w, s);
    const End last = look(alone, end[n], end[freedoms + n],
                          alone->lean * base + frame_dot(alone->shape, press->elastic, n));
    const double ground = flight->ground[0] * slice->value + flight->ground[1] * slice->slope;
    const double fallen = flight->fall[0] * slice->value + flight->fall[1] * slice->slope;
    if (!surely_lasts(frame, alone, &at, first, last) ||
        !surely_has_no_peak(frame, alone, &at, first, last) ||
        !others_are_clear(press, frame, alone, &at, fallen))
        return false;
    if (work != NULL) {
        work->ground = ground;
        add_work(press, stop, frame, alone, slice, last.force, work);
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper == alone)
            continue;
        damper->r += damper->gained;
        damper->w -= ground + frame_dot(damper->shape, gained + freedoms, n);
    }
    memcpy(frame->q, end, n * sizeof *end);
    memcpy(frame->p, end + freedoms, n * sizeof *end);
    alone->r = end[n];
    alone->w = end[freedoms + n];
    alone->is_fresh = false;
    frame->still_events = 0;
    return true;
}
