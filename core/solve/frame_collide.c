// At the stops that are met at one instant, impulses only press, and each damper parts at least as
// fast as its stop's restitution says (a resting one: not inwards):
//
//   0 <= pressed_d   and   parting speed after >= e_d closing speed before,  one of them equal.
//
// Between stops without clearance the other stop would press where one would have to pull, so there
// the impulse may have any sign. The impulses act through M^-1, so one on any storey may press or
// free a mass on another. The conditions are those of the least squares problem with matrix
// `yield`, positive definite, so they have one solution, and relaxing one impulse after the other
// always comes to it. Momentum is conserved whatever the impulses are; no energy is gained, for
// each pressed stop takes pressed (closing - parting) / 2.
#include "core/solve/frame_collide.h"

#include <float.h>
#include <math.h>

enum { SWEEPS_MOST = 100000 };

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

// One pass over all; the largest change relative to the largest impulse.
static double sweep(Frame *frame) {
    double most = 0, change = 0;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (!damper->is_met)
            continue;
        const double *row = frame->yield + d * frame->dampers, sign = frame_sign(damper->side);
        double missing = damper->closing + damper->parting;
        for (size_t e = 0; e < frame->dampers; e++)
            if (frame->damper[e].is_met)
                missing -=
                    sign * row[e] * frame_sign(frame->damper[e].side) * frame->damper[e].pressed;
        double next = damper->pressed + missing / row[d];
        if (damper->plan->clearance > 0)
            next = fmax(next, 0);
        change = fmax(change, fabs(next - damper->pressed));
        most = fmax(most, fabs(next));
        damper->pressed = next;
    }
    return most > 0 ? change / most : 0;
}

void frame_collide(Frame *frame) {
    double *impulses = frame->scratch;
    for (size_t d = 0; d < frame->dampers; d++)
        frame->damper[d].pressed = 0;
    for (size_t i = 0; i < SWEEPS_MOST && sweep(frame) > DBL_EPSILON; i++)
        ;
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
