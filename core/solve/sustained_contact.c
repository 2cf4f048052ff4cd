// With s = shape . (D p + W^2 q) + lean a_g the contact is r'' = s - N / m_e, N = k r + c w, and
// its size E^2 = w^2 + (k / m_e) r^2 grows by no more than |s| in unit time. The structure's V^2 =
// p'p + q'W^2 q grows by no more than growth V + |participation| |a_g| + |shape| |N|, while |s| <=
// reach V + |lean| |a_g| and |N| <= hard E. That bounds V, E, s and N over a step.
//
// A stiff contact is taken apart: y = q + m_e shape r feels N only through its damping, and
//   r'' + slack w + spring r = S,   S = lean a_g + shape . (D y' + W^2 y),
//   slack = c / m_e + m_e shape . D shape,   spring = k / m_e + m_e shape . W^2 shape.
// Were S a straight line, a mass that is merely pressed would ride at (S - slack S' / spring) /
// spring. How far r strays from there grows with what S bends, and that is slow: of such a bend d
// the mass follows all but (d'' + slack d') / spring.
//
// A softer contact, one that does not get far in a step, lasts where r at both ends is further from
// 0 than r'' can bend it; and where N surely only rises or falls its peak is at an end.
#include "core/solve/sustained_contact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Of FEW_STOREYS a step takes less than a single arc.
enum { FEW_STOREYS = 24, SOFT_LEVEL = 1 };
static const double SHORT_ARC = 0.25; // steps beyond SOFT_LEVEL are no shorter, over the rate

// Of N: what a mass that rides on a stiff stop may add to a peak without being looked at.
static const double RIPPLE_MAX = 1e-9;

Status frame_press_make(FramePress *press, const Frame *frame, Problem *problem) {
    const size_t n = frame->mode_count, size = frame_lanes_padded(2 * (n + 1) + 2);
    memset(press, 0, sizeof *press);
    if (frame->plan->form != CONTACT_LINEAR || frame->dampers == 0)
        return STATUS_OK;
    press->stops = calloc(2 * frame->dampers, sizeof *press->stops);
    press->block = calloc(3 * size + frame->padded, sizeof *press->block);
    if (press->stops == NULL || press->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes", n);
    press->count = 2 * frame->dampers;
    press->start = press->block;
    press->gained = press->start + size;
    press->pulled = press->gained + size;
    press->elastic = press->pulled + size;
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
    return frame->mode_count <= FEW_STOREYS || arcs > 2 + (double)frame->mode_count / 30;
}

static double size_of(const double *values, size_t count) {
    return sqrt(frame_dot(values, values, count));
}

// Tables of many storeys are large.
static size_t levels_of(const Frame *frame) {
    return frame->mode_count <= FEW_STOREYS ? PRESS_LEVELS : 3;
}

// Makes the stop's transitions when arcs have cost about as much as it does. False: there is none.
static bool prepare(FramePressStop *stop, const Frame *frame, const FrameDamper *damper) {
    if (stop->levels[0].block != NULL)
        return true;
    const double n = (double)frame->mode_count, arcs = frame->interval * frame_rate(frame);
    if (stop->is_given_up || !isfinite(damper->plan->stops[damper->side].stiffness) ||
        !is_worth(frame, arcs) || !(arcs < 0x1p20))
        return false;
    if ((stop->spent += n) < 4 * n * n * n)
        return false;
    stop->damped = calloc(2 * frame->mode_count, sizeof *stop->damped);
    if (stop->damped == NULL ||
        frame_dense_make(stop->levels, levels_of(frame), frame, damper, NULL) != STATUS_OK) {
        clear_stop(stop);
        *stop = (FramePressStop){.is_given_up = true};
        return false;
    }
    stop->bent = stop->damped + frame->mode_count;
    for (size_t l = 0; l < frame->mode_count; l++) // D' shape: D need not be symmetric
        for (size_t i = 0; i < frame->mode_count; i++)
            stop->damped[i] += frame->modes->damping[l * frame->mode_count + i] * damper->shape[l];
    for (size_t i = 0; i < frame->mode_count; i++)
        stop->bent[i] = frame->omega2[i] * damper->shape[i];
    stop->wide = size_of(damper->shape, frame->mode_count);
    stop->most_damped = size_of(stop->damped, frame->mode_count);
    stop->most_bent = size_of(stop->bent, frame->mode_count);
    stop->coupling = frame_dot(damper->shape, stop->damped, frame->mode_count);
    stop->bending = frame_dot(damper->shape, stop->bent, frame->mode_count);
    return true;
}

// What holds over the whole step.
typedef struct Bounds {
    double size, pull; // V, and |p'| without N
    double shaken;     // |a_g|
    double shaking;    // |a_g'|
    double force;      // |N|
} Bounds;

// |p'| is not larger but for N.
static double pull_of(const Frame *frame, const Bounds *at) {
    return (frame->viscous + sqrt(frame->stiff)) * at->size + frame->drive * at->shaken;
}

// Of V and p' as they are without N.
static bool find_bounds(const Frame *frame, const Slice *slice, double h, Bounds *at) {
    const double left = 1 - h * frame->growth;
    at->shaken = frame_flight_shaken(slice, h);
    at->shaking = slice->omega > 0 ? slice->omega * at->shaken : fabs(slice->slope);
    at->size = (frame_size(frame) + h * frame->drive * at->shaken) / left;
    at->pull = pull_of(frame, at);
    at->force = 0;
    return left > 0.5;
}

// s' now; p' but for what N does to it is -elastic - participation a_g.
static double change_now(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                         const Slice *slice, const double *elastic, double coupled_force) {
    const double *share = frame->modes->participation;
    const double rate = slice->omega > 0 ? slice->omega * slice->slope : slice->slope;
    double sum = damper->lean * rate + coupled_force;
    for (size_t i = 0; i < frame->mode_count; i++)
        sum +=
            stop->bent[i] * frame->p[i] - stop->damped[i] * (elastic[i] + share[i] * slice->value);
    return sum;
}

// At the start of a step: a_g, D p + W^2 q, and s.
typedef struct Start {
    const Slice *slice;
    const double *elastic;
    double s;
} Start;

// |s''| is not larger but for what N' does to it, N being no larger than `force`.
static double bow_of(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                     const Slice *slice, const Bounds *at, double force) {
    const double pull = at->pull + stop->wide * force;
    return fabs(damper->lean) * slice->omega * at->shaking + stop->most_bent * pull +
           stop->most_damped *
               (frame->viscous * pull + frame->stiff * at->size + frame->drive * at->shaking);
}

static bool stiff_lasts(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                        const Start *from, double h, Bounds *at) {
    const double r = damper->r, w = damper->w, sign = frame_sign(damper->side);
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double mass = damper->effective_mass, extra = mass * fabs(damper->lean) * stop->wide;
    const double spring = k / mass + mass * stop->bending, omega = sqrt(spring);
    const double slack = c / mass + mass * stop->coupling, hard = k / omega + c;
    const double S = from->s + mass * (stop->coupling * w + stop->bending * r);
    const double slope = change_now(stop, frame, damper, from->slice, from->elastic,
                                    mass * stop->coupling * from->s) +
                         mass * stop->bending * w;
    // |S''| <= bow + more |N|; and what of it the mass does not follow.
    const double swing = frame->viscous + sqrt(frame->stiff), lift = 2 * h * stop->wide; // of V
    const double more = stop->most_damped * frame->viscous * stop->wide +
                        lift * (stop->most_bent * swing +
                                stop->most_damped * (frame->viscous * swing + frame->stiff));
    const double bow = bow_of(stop, frame, damper, from->slice, at, 0) +
                       extra * (stop->most_bent * at->shaken + stop->most_damped * at->shaking);
    const double left =
        fmin((2 * h + slack * h * h / 2) / spring + h * h / 2 / omega, h * h * h / 6);
    // r and N of a mass that is merely pressed, at both ends.
    const double start = (S - slack * slope / spring) / spring, end = start + h * slope / spring;
    const double rides[2] = {k * start + c * slope / spring, k * end + c * slope / spring};
    const double astray = hypot(w - slope / spring, omega * (r - start));
    const double largest = fmax(fabs(rides[0]), fabs(rides[1])), share = hard * left * more;
    if (!(share < 0.5))
        return false;
    at->force = (largest + hard * (astray + left * bow)) / (1 - share);
    const double bent = bow + more * at->force, stirred = astray + left * bent;
    at->size += lift * at->force;
    // A force that may be the largest so far is to be seen where it is so: at an end, once the mass
    // merely rides and S only rises or falls.
    if (!frame->is_shadow && at->force > ledger_least_force(&frame->ledger, &damper->row) &&
        !(hard * astray <= RIPPLE_MAX * largest && fabs(slope) > h * bent))
        return false;
    if (frame->plan->separation == SEPARATION_ZERO_FORCE)
        return fmin(sign * rides[0], sign * rides[1]) > hard * stirred;
    return fmin(sign * start, sign * end) > stirred / omega;
}

// r and w gain `moved` and `sped`.
static bool soft_lasts(const FramePressStop *stop, const Frame *frame, const FrameDamper *damper,
                       const Start *from, double moved, double sped, double h, Bounds *at) {
    const double sign = frame_sign(damper->side), mass = damper->effective_mass;
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    const double omega = sqrt(k / mass), hard = k / omega + c, lean = fabs(damper->lean);
    const double r = sign * damper->r, now = k * damper->r + c * damper->w;
    const double then = now + (k * moved + c * sped), sag = h * h / 8;
    const double size = hypot(damper->w, omega * damper->r), lift = 2 * h * stop->wide * hard;
    const double left = 1 - lift * h * damper->reach;
    if (!(left > 0.25))
        return false;
    at->size = (at->size + lift * (size + h * lean * at->shaken)) / left;
    at->pull = pull_of(frame, at);
    const double push = lean * at->shaken + damper->reach * at->size, most = size + h * push;
    at->force = hard * most;
    const double bend = push + at->force / mass; // |r''|
    const double change = stop->most_damped * (at->pull + stop->wide * at->force) +
                          stop->most_bent * at->size + lean * at->shaking; // |s'|
    const double rate = k * most + c * bend;                               // |N'|
    const double turn = change + rate / mass;                              // |r'''|
    const double climb = k * bend + c * turn;                              // |N''|
    if (frame->plan->separation == SEPARATION_ZERO_FORCE
            ? !(sign * now > sag * climb && sign * then > sag * climb)
            : !(r > sag * bend && r + sign * moved > sag * bend))
        return false;
    if (frame->is_shadow || fmax(fabs(now), fabs(then)) + sag * climb <=
                                ledger_least_force(&frame->ledger, &damper->row))
        return true;
    // N only rises or falls where N' keeps its sign.
    const double leap = from->s - now / mass, rise = k * damper->w + c * leap; // r'', N'
    if (fabs(rise) > h * climb)
        return true;
    const double slope =
        change_now(stop, frame, damper, from->slice, from->elastic, stop->coupling * now);
    const double curve = k * leap + c * (slope - rise / mass); // N''
    const double bow =
        bow_of(stop, frame, damper, from->slice, at, at->force) + stop->coupling * rate;
    const double stray = k * turn + c * (bow + climb / mass); // |N'''|
    const double up = rise > 0 ? 1 : -1;
    return fmin(up * rise, up * (rise + h * curve)) > h * h / 2 * stray;
}

// Whether all others stay in flight; they are ready to be moved then.
static bool others_are_clear(const FramePress *press, Frame *frame, const FrameDamper *alone,
                             const Bounds *at, double length, double fallen) {
    const size_t n = frame->mode_count, a = (size_t)(alone - frame->damper);
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
    const size_t n = frame->mode_count;
    const double *start = press->start, *gained = press->gained;
    work->damping = frame_dense_form(dense, frame->lanes, dense->loss, start, press->pulled);
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
                   frame_dense_form(dense, frame->lanes, dense->contact, start, press->pulled));
}

// What (q, r, p, w) gain over one level's length.
static void find_gained(FramePress *press, const FrameDense *dense, const Frame *frame,
                        const FrameDamper *alone, const Slice *slice) {
    const size_t n = frame->mode_count, freedoms = n + 1;
    double *start = press->start;
    memcpy(start, frame->q, n * sizeof *start);
    memcpy(start + freedoms, frame->p, n * sizeof *start);
    start[n] = alone->r;
    start[freedoms + n] = alone->w;
    start[2 * freedoms] = slice->value;
    start[2 * freedoms + 1] = slice->slope;
    frame->lanes->multiply(dense->gain, dense->rows, start, dense->size, press->gained);
}

static void move(const FramePress *press, Frame *frame, FrameDamper *alone, double ground) {
    const size_t n = frame->mode_count;
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
    // Where its buffers are alike they share one.
    const PlanStop *stops = alone->plan->stops;
    const bool are_alike = stops[0].stiffness == stops[1].stiffness && //
                           stops[0].damping == stops[1].damping;
    FramePressStop *stop =
        &press->stops[2 * (size_t)(alone - frame->damper) + (are_alike ? 0 : alone->side)];
    if (!prepare(stop, frame, alone))
        return 0;
    frame_elastic(frame, frame->q, frame->p, press->elastic);
    const Start from = {slice, press->elastic,
                        alone->lean * slice->value +
                            frame_dot(alone->shape, press->elastic, frame->mode_count)};
    const double rate = frame_rate(frame);
    const double omega = sqrt(alone->contact.stiffness / alone->effective_mass);
    for (size_t i = 0; i < levels_of(frame) && is_worth(frame, press->length[i] * rate); i++) {
        const FrameDense *dense = &stop->levels[i];
        const double h = press->length[i];
        const bool is_soft = h * omega < 1;
        Bounds at;
        if (is_soft && i > SOFT_LEVEL && h * rate < SHORT_ARC)
            break;
        if (h > length * (1 + 1e-15) || dense->block == NULL)
            continue;
        if (!find_bounds(frame, slice, h, &at))
            continue;
        if (!is_soft && !stiff_lasts(stop, frame, alone, &from, h, &at))
            continue;
        find_gained(press, dense, frame, alone, slice);
        if (is_soft && !soft_lasts(stop, frame, alone, &from, press->gained[frame->mode_count],
                                   press->gained[2 * frame->mode_count + 1], h, &at))
            continue;
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
