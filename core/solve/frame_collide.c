// At the stops that are met at one instant, impulses only press, and each damper parts at least as
// fast as its stop's restitution says (a resting one: not inwards):
//
//   0 <= pressed_d   and   parting speed after >= e_d closing speed before,  one of them equal.
//
// Between stops without clearance the other stop would press where one would have to pull, so there
// the impulse may have any sign. The impulses act through M^-1, so one on any storey may press or
// free a mass on another. The conditions are those of the least squares problem with matrix
// `yield`, positive definite, so they have one solution: that of the equations between those that
// turn out to be pressed. Momentum is conserved whatever the impulses are; no energy is gained, for
// each pressed stop takes pressed (closing - parting) / 2.
#include "core/solve/frame_collide.h"

#include <float.h>
#include <math.h>

enum { PIVOTS_MOST = 100, PATIENCE = 3, SWEEPS = 100 };
static const double ROUNDING = 64 * DBL_EPSILON;

void frame_push(Frame *frame, const double *impulses) {
    for (size_t d = 0; d < frame->dampers; d++) {
        const double impulse = impulses[d];
        if (impulse == 0)
            continue;
        const double *shape = frame->damper[d].shape;
        for (size_t i = 0; i < frame->storeys; i++)
            frame->p[i] += shape[i] * impulse;
        for (size_t e = 0; e < frame->dampers; e++)
            frame->damper[e].w -= frame->yield[e * frame->dampers + d] * impulse;
    }
}

// What the speed after, away from the stop, falls short of; *size: of what it is the difference.
static double missing(const Frame *frame, size_t d, double *size) {
    const FrameDamper *damper = &frame->damper[d];
    const double *row = frame->yield + d * frame->dampers, sign = frame_sign(damper->side);
    double sum = damper->closing + damper->parting;
    *size = sum;
    for (size_t e = 0; e < frame->dampers; e++) {
        const FrameDamper *other = &frame->damper[e];
        if (!other->is_met)
            continue;
        const double part = sign * row[e] * frame_sign(other->side) * other->pressed;
        sum -= part;
        *size += fabs(part);
    }
    return sum;
}

// The impulses of those that are held, as if no other were pressed.
static void press(Frame *frame) {
    const size_t n = frame->dampers;
    frame_hold_invert(frame);
    for (size_t d = 0; d < n; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->pressed = 0;
        for (size_t e = 0; e < n && damper->is_held; e++) {
            const FrameDamper *other = &frame->damper[e];
            if (other->is_held)
                damper->pressed += frame->hold[d * n + e] * frame_sign(other->side) *
                                   (other->closing + other->parting);
        }
        damper->pressed *= frame_sign(damper->side);
    }
}

// Held, but it would have to pull; or not held, but it comes too close.
static bool is_wrong(const Frame *frame, size_t d) {
    const FrameDamper *damper = &frame->damper[d];
    if (!damper->is_met || damper->plan->clearance == 0)
        return false;
    if (damper->is_held)
        return damper->pressed < 0;
    double size;
    return missing(frame, d, &size) > ROUNDING * size;
}

// Who is pressed is guessed, all at first. All wrong guesses are changed at once for as long as
// they become fewer, else the last one alone, which by Murty (1974) comes to an end. False:
// rounding kept it from that.
static bool pivot(Frame *frame) {
    size_t least = SIZE_MAX, patience = PATIENCE;
    for (size_t d = 0; d < frame->dampers; d++)
        frame->damper[d].is_held = frame->damper[d].is_met;
    for (int i = 0; i < PIVOTS_MOST; i++) {
        press(frame);
        size_t wrong = 0, last = 0;
        for (size_t d = 0; d < frame->dampers; d++) {
            frame->damper[d].is_wrong = is_wrong(frame, d);
            wrong += frame->damper[d].is_wrong;
            last = frame->damper[d].is_wrong ? d : last;
        }
        if (wrong == 0)
            return true;
        if (wrong < least) {
            least = wrong;
            patience = PATIENCE;
        } else if (patience > 0) {
            patience--;
        }
        for (size_t d = patience > 0 ? 0 : last; d <= last; d++)
            frame->damper[d].is_held ^= frame->damper[d].is_wrong;
    }
    return false;
}

// One impulse after the other towards what it must be: slow, but sure to come nearer.
static void relax(Frame *frame) {
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        double size;
        if (damper->is_met)
            damper->pressed += missing(frame, d, &size) / frame->yield[d * (frame->dampers + 1)];
        if (damper->plan->clearance > 0)
            damper->pressed = fmax(damper->pressed, 0);
    }
}

void frame_collide(Frame *frame) {
    double *impulses = frame->scratch;
    const bool is_exact = pivot(frame);
    for (int i = 0; i < SWEEPS && !is_exact; i++)
        relax(frame);
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        impulses[d] = damper->is_met ? frame_sign(damper->side) * damper->pressed : 0;
    }
    frame_push(frame, impulses);
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper->is_met && damper->pressed != 0)
            damper->w = -frame_sign(damper->side) * damper->parting;
    }
}
