// What a step's end does to contacts. Nothing is located: a contact begins with the penetration in
// which a step ends, and ends with that beyond its zero, which makes the method one of first order
// across contacts whatever it is between them.
//
//              p > 0                          p <= 0 (or, under zero force, N <= 0 and p <= 0)
//     FLIGHT ----------> CONTACT(side) ---------------------------------> FLIGHT
//        |                 |  ^ N > 0                                       ^
//        |        N <= 0,  |  |               p <= 0                        |
//        |         p > 0   +-> INSIDE(side) --------------------------------+
//        |   p >= 0, u' inwards: to the stop, u' -> -e u'
//        +--(impulse)--> FLIGHT, or RESTING(side) where the flight to come is over within a step
//
// A resting mass moves freely for a step and is then put back to its stop by an impulse, together
// with all others that press or are met; it leaves where a step takes it away from the stop.
#include <math.h>

#include "core/plan/contact_setup.h"
#include "core/solve/collision.h"
#include "core/solve/time_stepping.h"

static double strain(const Frame *frame, size_t d) {
    const FrameDamper *damper = &frame->damper[d];
    return damper->phase == FRAME_CONTACT ? steps_contact(frame, d, damper->r, 0).strain : 0;
}

// Into the stop: at most one of the two, for between them there is room or none at all.
static double depth(const FrameDamper *damper, Side side) {
    return frame_sign(side) * damper->r - frame_room(damper, side);
}

static FramePhase next_phase(const Frame *frame, size_t d, Side *side) {
    const FrameDamper *damper = &frame->damper[d];
    const double p = depth(damper, *side);
    if (damper->phase == FRAME_FLIGHT) {
        *side = depth(damper, SIDE_RIGHT) > depth(damper, SIDE_LEFT) ? SIDE_RIGHT : SIDE_LEFT;
        return depth(damper, *side) > 0 ? FRAME_CONTACT : FRAME_FLIGHT;
    }
    if (!(p > 0))
        return FRAME_FLIGHT;
    if (frame->plan->separation != SEPARATION_ZERO_FORCE || frame->plan->form != CONTACT_LINEAR)
        return FRAME_CONTACT;
    const double push = frame_sign(*side) * steps_contact(frame, d, damper->r, damper->w).value;
    return push > 0 ? FRAME_CONTACT : FRAME_INSIDE;
}

// r is counted from that stop from now on.
static void place(FrameDamper *damper, Side side) {
    const double p = depth(damper, side);
    damper->side = side;
    damper->origin = (FrameOrigin)side;
    damper->r = frame_sign(side) * p;
}

static void open_row(Frame *frame, size_t d, double ago) {
    FrameDamper *damper = &frame->damper[d];
    ledger_open(&damper->row, IMPACT_IMPACT, frame_time(frame) - ago, d, damper->side,
                fmax(frame_sign(damper->side) * damper->w, 0));
}

static void close_row(Frame *frame, size_t d) {
    FrameDamper *damper = &frame->damper[d];
    ledger_close(&frame->ledger, &damper->row, frame_time(frame),
                 fmax(-frame_sign(damper->side) * damper->w, 0));
}

static void enter(Steps *steps, size_t d, Side side) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    const bool is_new = damper->phase == FRAME_FLIGHT;
    place(damper, side);
    damper->phase = FRAME_CONTACT;
    if (is_new && !steps->stepper->is_by_place)
        damper->contact = stops_freeze(&damper->plan->stops[side], fabs(damper->w));
    open_row(frame, d, 0);
    damper->row.impact.is_resumed = !is_new;
}

// A stretch of contact lies behind.
static void book(Steps *steps, size_t d, double length) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    ledger_stretch(&frame->ledger, &damper->row, length, steps->sums.impulse[d],
                   steps->sums.work[d] - (strain(frame, d) - steps->before[d]));
    if (damper->phase == FRAME_CONTACT)
        ledger_force(&frame->ledger, &damper->row,
                     fabs(steps_contact(frame, d, damper->r, damper->w).value));
}

// The force followed the phase all through the step.
static void turn_by_phase(Steps *steps, size_t d, FramePhase next, Side side, double length) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    if (damper->phase == FRAME_CONTACT)
        book(steps, d, length);
    if (damper->phase == next)
        return;
    if (next == FRAME_CONTACT) {
        const bool is_resumed = damper->phase == FRAME_INSIDE;
        enter(steps, d, side);
        if (is_resumed)
            ledger_stretch(&frame->ledger, &damper->row, 0, 0, -strain(frame, d));
        ledger_force(&frame->ledger, &damper->row,
                     fabs(steps_contact(frame, d, damper->r, damper->w).value));
        return;
    }
    if (damper->phase == FRAME_CONTACT) {
        if (next == FRAME_INSIDE) // what is left in the spring
            ledger_stretch(&frame->ledger, &damper->row, 0, 0, strain(frame, d));
        close_row(frame, d);
    }
    damper->phase = next;
}

// The force followed the place: a step in which a contact begins or ends has a part of it.
static void turn_by_place(Steps *steps, size_t d, FramePhase next, Side side, double length) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    const FramePhase last = damper->phase;
    if (last == FRAME_CONTACT) {
        damper->phase = next;
        book(steps, d, length);
        if (next != FRAME_CONTACT)
            close_row(frame, d);
    } else if (next == FRAME_CONTACT) {
        enter(steps, d, side);
        book(steps, d, 0);
    } else if (steps->sums.impulse[d] != 0) { // begun and over
        damper->side = steps->sums.impulse[d] > 0 ? SIDE_RIGHT : SIDE_LEFT;
        open_row(frame, d, length);
        damper->row.impact.approach_speed = fabs(damper->w);
        damper->phase = FRAME_FLIGHT;
        book(steps, d, length);
        ledger_force(&frame->ledger, &damper->row, fabs(steps->sums.impulse[d]) / length);
        close_row(frame, d);
        damper->phase = next;
    } else {
        damper->phase = next;
    }
}

// Which dampers are met at their stops, and how fast each must part.
static bool meet(Steps *steps, double length) {
    Frame *frame = &steps->frame;
    bool is_any = false;
    frame_feel(frame);
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        const bool is_resting = damper->phase == FRAME_RESTING,
                   is_pair = damper->plan->clearance == 0;
        damper->is_met = damper->is_bounced = damper->is_fresh = false;
        damper->closing = damper->parting = 0;
        if (!is_resting || is_pair)
            damper->side = damper->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
        const double sign = frame_sign(damper->side), closing = sign * damper->w;
        if (!is_pair && (depth(damper, damper->side) < 0 || (!is_resting && !(closing > 0))))
            continue;
        is_any = damper->is_met = true;
        damper->closing = fmax(closing, 0);
        if (is_resting || is_pair)
            continue;
        damper->contact = stops_freeze(&damper->plan->stops[damper->side], closing);
        // The speed at the stop, without what has been gained beyond it: or bounces would not die
        // away. `closing` is that of now, for momentum is kept.
        const double pull = sign * frame_acceleration(frame, d);
        const double square = closing * closing - 2 * pull * depth(damper, damper->side);
        const double parting = damper->contact.restitution * sqrt(fmax(square, 0));
        // A flight that is over within a step: it rests from now on.
        damper->is_fresh = 2 * parting < pull * length;
        damper->is_bounced = true;
        damper->parting = damper->is_fresh ? 0 : parting;
    }
    return is_any;
}

static void rest(Steps *steps, size_t d, double length) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    const double impulse = frame_sign(damper->side) * damper->pressed;
    const Side side = impulse < 0 ? SIDE_LEFT : SIDE_RIGHT;
    if (damper->row.is_open && damper->pressed != 0 && (Side)damper->row.impact.side != side)
        ledger_close(&frame->ledger, &damper->row, frame_time(frame) - length, (double)NAN);
    if (!damper->row.is_open) // between stops without clearance the step before belongs to it
        ledger_open(&damper->row, IMPACT_RESTING, frame_time(frame) - length, d, side, (double)NAN);
    ledger_stretch(&frame->ledger, &damper->row, length, impulse,
                   0.5 * damper->pressed * damper->closing);
    ledger_force(&frame->ledger, &damper->row, fabs(damper->pressed) / length);
}

static void bounce(Steps *steps, size_t d) {
    Frame *frame = &steps->frame;
    FrameDamper *damper = &frame->damper[d];
    const double both = damper->closing + damper->parting;
    ledger_bounce(&frame->ledger, frame_time(frame), d, damper->side, damper->closing,
                  damper->parting, damper->pressed / both);
    if (!damper->is_fresh)
        return;
    damper->phase = FRAME_RESTING;
    ledger_open(&damper->row, IMPACT_RESTING, frame_time(frame), d, damper->side, (double)NAN);
}

static void collide(Steps *steps, double length) {
    Frame *frame = &steps->frame;
    const bool is_any = meet(steps, length);
    bool is_changed = false;
    if (is_any)
        frame_collide(frame);
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        const FramePhase last = damper->phase;
        const bool is_pressed = damper->is_met && damper->pressed != 0;
        if (is_pressed) {
            place(damper, damper->side);
            damper->r = 0;
        }
        if (damper->plan->clearance == 0) {
            damper->phase = FRAME_RESTING;
            rest(steps, d, length);
        } else if (is_pressed && damper->is_bounced) {
            bounce(steps, d);
        } else if (last == FRAME_RESTING && is_pressed) {
            rest(steps, d, length);
        } else if (last == FRAME_RESTING) {
            damper->phase = FRAME_FLIGHT;
            ledger_close(&frame->ledger, &damper->row, frame_time(frame), (double)NAN);
        }
        is_changed = is_changed || damper->phase != last;
    }
    if (is_changed)
        frame_hold_make(frame);
}

void steps_turn(Steps *steps, double length) {
    Frame *frame = &steps->frame;
    if (frame->plan->form == CONTACT_IMPULSIVE) {
        if (frame->dampers > 0)
            collide(steps, length);
        return;
    }
    for (size_t d = 0; d < frame->dampers; d++) {
        Side side = frame->damper[d].side;
        const FramePhase next = next_phase(frame, d, &side);
        if (steps->stepper->is_by_place)
            turn_by_place(steps, d, next, side, length);
        else
            turn_by_phase(steps, d, next, side, length);
    }
}
