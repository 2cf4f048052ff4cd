// At the stops that are met at one instant, impulses only press, and each damper parts at least as
// fast as its stop's restitution says (a resting one: not inwards):
//
//   0 <= pressed_d   and   parting speed after >= e_d closing speed before,  one of them equal.
//
// Between stops without clearance the other stop would press where one would have to pull, so there
// the impulse may have any sign. The impulses act through M^-1, so one on any storey may press or
// free a mass on another. The conditions are those of the least squares problem with matrix
// `yield`, positive definite, so they have one solution. It is found as of any such problem with
// signs (Lawson and Hanson 1974): the stop that lacks most joins those that press, these are solved
// for all at once, and whoever would have to pull drops out on the way there. Each round comes
// nearer, so none comes twice. Momentum is conserved whatever the impulses are; no energy is
// gained, for each pressed stop takes pressed (closing - parting) / 2.
#include "core/solve/collision.h"

#include <float.h>
#include <math.h>

// Only rounding could make so many rounds of a few dampers.
enum { ROUNDS_MAX = 100000 };

void frame_push(Frame *frame, const double *impulses) {
    for (size_t d = 0; d < frame->dampers; d++) {
        const double impulse = impulses[d];
        if (impulse == 0)
            continue;
        const double *shape = frame->damper[d].shape;
        for (size_t i = 0; i < frame->mode_count; i++)
            frame->p[i] += shape[i] * impulse;
        for (size_t e = 0; e < frame->dampers; e++)
            frame->damper[e].w -= frame->yield[e * frame->dampers + d] * impulse;
    }
}

static double coupling(const Frame *frame, size_t d, size_t e) {
    return frame_sign(frame->damper[d].side) * frame_sign(frame->damper[e].side) *
           frame->yield[d * frame->dampers + e];
}

// Relative speed that stop d lacks with the present impulses; 0 where that is rounding.
static double lack(const Frame *frame, size_t d) {
    const double asked = frame->damper[d].closing + frame->damper[d].parting;
    double sum = asked, size = asked;
    for (size_t e = 0; e < frame->dampers; e++) {
        const double given = coupling(frame, d, e) * frame->damper[e].pressed;
        sum -= given;
        size += fabs(given);
    }
    return fabs(sum) <= 4 * DBL_EPSILON * size ? 0 : sum;
}

// `wanted` of all stops that press, were it to them alone: coupling = L D L', row after row.
static void solve(Frame *frame) {
    const size_t n = frame->dampers;
    double *L = frame->scratch;
    for (size_t i = 0; i < n; i++) {
        FrameDamper *damper = &frame->damper[i];
        if (!damper->is_pressing)
            continue;
        damper->wanted = damper->closing + damper->parting;
        for (size_t j = 0; j <= i; j++) {
            if (!frame->damper[j].is_pressing)
                continue;
            double sum = coupling(frame, i, j);
            for (size_t k = 0; k < j; k++)
                if (frame->damper[k].is_pressing)
                    sum -= L[i * n + k] * L[k * n + k] * L[j * n + k];
            L[i * n + j] = i == j ? sum : sum / L[j * n + j];
            if (j < i)
                damper->wanted -= L[i * n + j] * frame->damper[j].wanted;
        }
    }
    for (size_t i = n; i-- > 0;) {
        FrameDamper *damper = &frame->damper[i];
        if (!damper->is_pressing)
            continue;
        damper->wanted /= L[i * n + i];
        for (size_t j = i + 1; j < n; j++)
            if (frame->damper[j].is_pressing)
                damper->wanted -= L[j * n + i] * frame->damper[j].wanted;
    }
}

// From the present impulses as far towards the wanted ones as all only press; false: one that no
// longer does has dropped out.
static bool approach(Frame *frame) {
    double share = 1;
    FrameDamper *least = NULL;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (!damper->is_pressing || damper->plan->clearance == 0 || damper->wanted > 0)
            continue;
        const double part = damper->pressed / (damper->pressed - damper->wanted);
        if (least == NULL || !(part >= share)) { // not a number where both are 0
            share = part > 0 ? part : 0;
            least = damper;
        }
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (damper->is_pressing)
            damper->pressed = least == NULL
                                  ? damper->wanted
                                  : damper->pressed + share * (damper->wanted - damper->pressed);
    }
    if (least == NULL)
        return true;
    least->pressed = 0;
    least->is_pressing = false;
    return false;
}

// The stop that lacks most; NULL where none does.
static FrameDamper *find_lacking(Frame *frame) {
    FrameDamper *most = NULL;
    double largest = 0;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (!damper->is_met || damper->is_pressing || damper->is_spent)
            continue;
        const double weight = lack(frame, d) / sqrt(frame->yield[d * frame->dampers + d]);
        if (weight > largest) {
            largest = weight;
            most = damper;
        }
    }
    return most;
}

// One stop more presses. Where it would pull, what it lacked was rounding: it stays out until
// another joins.
static void join(Frame *frame, FrameDamper *damper) {
    damper->is_pressing = true;
    solve(frame);
    if (!(damper->wanted > 0)) {
        damper->is_pressing = false;
        damper->is_spent = true;
        return;
    }
    for (size_t d = 0; d < frame->dampers; d++)
        frame->damper[d].is_spent = false;
    while (!approach(frame))
        solve(frame);
}

void frame_collide(Frame *frame) {
    double *impulses = frame->scratch;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->pressed = 0;
        damper->is_pressing = damper->is_met && damper->plan->clearance == 0;
        damper->is_spent = false;
    }
    solve(frame);
    (void)approach(frame); // these may pull
    FrameDamper *next = NULL;
    for (size_t i = 0; i < ROUNDS_MAX && (next = find_lacking(frame)) != NULL; i++)
        join(frame, next);
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
