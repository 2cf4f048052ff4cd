// One damper's phases:
//
//              gap closes                  p back at 0 (zero penetration)
//     FLIGHT ------------> CONTACT(side) -------------------------------> FLIGHT
//        |                  |   ^ N back above 0                             ^
//        |       N back at 0|   |               p back at 0                  |
//        |      (zero force)+-> INSIDE(side) --------------------------------+
//        |   gap closes                   bounce shorter than the clock
//        +--(impulse)--> u' -> -e u' -----------------------------------> RESTING(side)
//                                                push becomes tensile -> FLIGHT
//
// An impact is a collision (frame_collide.h) of all masses that reach their stops within the
// clock's resolution, and of all that rest: a resting one is pressed on, or parts and flies.
// Bounces towards a pushing stop follow each other in a geometric series; when all that are left
// take less time than the clock resolves, or many have taken none, they are one and the mass rests.
#include "core/solve/contact_events.h"

#include <float.h>
#include <math.h>

#include "core/plan/contact_setup.h"
#include "core/solve/collision.h"
#include "core/solve/recorder.h"

enum { STILL_BOUNCES = 64 };

static void begin_contact(Frame *frame, size_t d, Side side) {
    FrameDamper *damper = &frame->damper[d];
    const double speed = fabs(damper->w);
    damper->phase = FRAME_CONTACT;
    damper->side = side;
    damper->origin = (FrameOrigin)side;
    damper->r = 0;
    damper->is_fresh = true;
    damper->contact = stops_freeze(&damper->plan->stops[side], speed);
    ledger_open(&damper->row, IMPACT_IMPACT, frame_time(frame), d, side, speed);
    ledger_force(&frame->ledger, &damper->row, damper->contact.damping * speed);
}

// The spring that is taken into a contact or left behind in it [J].
static double spring(const FrameDamper *damper) {
    return 0.5 * damper->contact.stiffness * damper->r * damper->r;
}

// N rises again while the mass is still in the buffer: the impact's parameters go on.
static void resume_contact(Frame *frame, size_t d) {
    FrameDamper *damper = &frame->damper[d];
    damper->phase = FRAME_CONTACT;
    damper->is_fresh = true;
    ledger_open(&damper->row, IMPACT_IMPACT, frame_time(frame), d, damper->side,
                fmax(frame_sign(damper->side) * damper->w, 0));
    damper->row.impact.is_resumed = true;
    ledger_stretch(&frame->ledger, &damper->row, 0, 0, -spring(damper));
}

// Out of the buffer; an inward speed is rounding, for the gap does open.
static void fly_off(FrameDamper *damper) {
    const double sign = frame_sign(damper->side);
    damper->phase = FRAME_FLIGHT;
    damper->is_fresh = false;
    damper->r = 0;
    damper->w = sign * fmin(sign * damper->w, 0);
}

static void end_contact(Frame *frame, size_t d) {
    FrameDamper *damper = &frame->damper[d];
    const double sign = frame_sign(damper->side);
    const bool stays = frame->plan->separation == SEPARATION_ZERO_FORCE &&
                       damper->contact.damping > 0 && sign * damper->r > 0;
    if (stays) {
        ledger_stretch(&frame->ledger, &damper->row, 0, 0, spring(damper));
        damper->phase = FRAME_INSIDE;
        damper->is_fresh = true;
    } else {
        fly_off(damper);
    }
    ledger_close(&frame->ledger, &damper->row, frame_time(frame), fmax(-sign * damper->w, 0));
}

// After a collision: which resting mass was pressed, which one parts.
static void sort_resting(Frame *frame) {
    for (size_t e = 0; e < frame->dampers; e++) {
        FrameDamper *damper = &frame->damper[e];
        if (damper->leaving > 0) // its gap's speed, or at least its curvature, has changed
            damper->leaving = damper->w == 0 ? 2 : 0;
        if (damper->phase != FRAME_RESTING)
            continue;
        const double sign = frame_sign(damper->side);
        if (damper->pressed == 0 && sign * damper->w < 0) {
            damper->phase = FRAME_FLIGHT;
            ledger_close(&frame->ledger, &damper->row, frame_time(frame), NAN);
        } else {
            damper->w = 0;
            ledger_stretch(&frame->ledger, &damper->row, 0, sign * damper->pressed, 0);
        }
    }
    frame_hold_make(frame);
}

static void meet_resting(Frame *frame) {
    for (size_t e = 0; e < frame->dampers; e++) {
        FrameDamper *damper = &frame->damper[e];
        damper->is_met = damper->phase == FRAME_RESTING;
        damper->closing = damper->parting = 0;
    }
}

// What relative momentum is left goes over, conserved.
static void begin_rest(Frame *frame, size_t d, Side side) {
    FrameDamper *damper = &frame->damper[d];
    const double sign = frame_sign(side), speed = fabs(damper->w);
    damper->side = side;
    damper->origin = (FrameOrigin)side;
    damper->r = 0;
    damper->leaving = 0;
    meet_resting(frame);
    if (sign * damper->w > 0) {
        damper->is_met = true;
        damper->closing = speed;
        frame_collide(frame);
        sort_resting(frame);
    } else { // the last of a series of bounces: what is below the clock may act on all alike
        damper->pressed = speed * damper->effective_mass;
        double *impulses = frame->scratch;
        for (size_t e = 0; e < frame->dampers; e++)
            impulses[e] = e == d ? damper->w * damper->effective_mass : 0;
        frame_push(frame, impulses);
        for (size_t e = 0; e < frame->dampers; e++)
            if (frame->damper[e].phase == FRAME_RESTING)
                frame->damper[e].w = 0;
    }
    damper->phase = FRAME_RESTING;
    damper->w = 0;
    frame_hold_make(frame);
    frame_feel(frame);
    ledger_open(&damper->row, IMPACT_RESTING, frame_time(frame), d, side, NAN);
    ledger_stretch(&frame->ledger, &damper->row, 0, sign * damper->pressed,
                   0.5 * damper->pressed * speed);
    ledger_force(&frame->ledger, &damper->row, fabs(damper->force));
}

// Whether a damper in flight reaches that stop within the clock's resolution.
static bool reaches(const FrameDamper *damper, Side side, double clock) {
    const double sign = frame_sign(side), closing = sign * damper->w;
    return damper->phase == FRAME_FLIGHT && damper->plan->clearance > 0 && closing > 0 &&
           frame_room(damper, side) - sign * damper->r <= closing * clock;
}

static void bounce(Frame *frame, size_t d, Side side) {
    const double clock = frame_clock(frame);
    meet_resting(frame);
    for (size_t e = 0; e < frame->dampers; e++) {
        FrameDamper *damper = &frame->damper[e];
        Side at = side;
        damper->is_bounced = false;
        if (e != d) {
            at = damper->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
            if (!reaches(damper, at, clock))
                continue;
        }
        damper->is_met = damper->is_bounced = true;
        damper->side = at;
        damper->origin = (FrameOrigin)at;
        damper->r = 0;
        damper->closing = fmax(frame_sign(at) * damper->w, 0);
        damper->contact = stops_freeze(&damper->plan->stops[at], damper->closing);
        damper->parting =
            frame->still_events > STILL_BOUNCES ? 0 : damper->contact.restitution * damper->closing;
    }
    frame_collide(frame);
    sort_resting(frame);
    for (size_t e = 0; e < frame->dampers; e++) {
        FrameDamper *damper = &frame->damper[e];
        if (!damper->is_bounced)
            continue;
        const double both = damper->closing + damper->parting;
        if (damper->pressed > 0 || e == d)
            ledger_bounce(&frame->ledger, frame_time(frame), e, damper->side, damper->closing,
                          damper->parting,
                          both > 0 ? damper->pressed / both : damper->effective_mass);
    }
}

// Of the dampers that have just bounced, those that rest from now on.
static void rest_bounced(Frame *frame) {
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        if (!damper->is_bounced)
            continue;
        frame_feel(frame);
        const double pull = frame_sign(damper->side) * frame_acceleration(frame, d);
        const double left = 2 * damper->parting / (pull * (1 - damper->contact.restitution));
        // Without a pull only a mass without speed rests; left is not a number where e = 1 and it
        // has none.
        if (pull > 0 ? !(left > frame_clock(frame)) : pull == 0 && damper->parting == 0)
            begin_rest(frame, d, damper->side);
    }
}

static void touch(Frame *frame, size_t d, Side side) {
    frame->damper[d].leaving = 0;
    if (frame->plan->form != CONTACT_IMPULSIVE) {
        begin_contact(frame, d, side);
    } else if (frame->damper[d].plan->clearance == 0) {
        begin_rest(frame, d, side);
    } else {
        bounce(frame, d, side);
        rest_bounced(frame);
    }
}

static void release(Frame *frame, size_t d, bool is_jump) {
    FrameDamper *damper = &frame->damper[d];
    damper->phase = FRAME_FLIGHT;
    damper->leaving = is_jump ? 2 : 3;
    damper->r = damper->w = 0;
    ledger_close(&frame->ledger, &damper->row, frame_time(frame), NAN);
    frame_hold_make(frame);
    if (damper->plan->clearance == 0) // between stops without clearance the other one takes over
        begin_rest(frame, d, damper->side == SIDE_RIGHT ? SIDE_LEFT : SIDE_RIGHT);
}

void frame_happen(Frame *frame, const FrameEvent *event) {
    FrameDamper *damper = &frame->damper[event->damper];
    frame_record_note(frame);
    switch (damper->phase) {
    case FRAME_FLIGHT:
        touch(frame, event->damper, event->side);
        break;
    case FRAME_CONTACT:
        end_contact(frame, event->damper);
        break;
    case FRAME_INSIDE:
        if (event->is_inwards)
            resume_contact(frame, event->damper);
        else
            fly_off(damper);
        break;
    case FRAME_RESTING:
        release(frame, event->damper, event->is_jump);
        break;
    }
    frame_record_note(frame);
}

// The first crossing of a gap that is known not to be negative at the start.
static void look_for(double *gap, size_t degree, FrameEvent candidate, bool *is_found,
                     FrameEvent *first) {
    gap[0] = fmax(gap[0], 0);
    if (root_first_crossing(gap, degree, &candidate.s) && (!*is_found || candidate.s < first->s)) {
        *is_found = true;
        *first = candidate;
    }
}

static void find_touch(const Frame *frame, const FrameArc *arc, size_t d, bool *is_found,
                       FrameEvent *first) {
    const FrameDamper *damper = &frame->damper[d];
    const double *r = frame_arc_r(arc, d);
    double reach = 0;
    for (size_t k = 0; k <= arc->degree; k++)
        reach += fabs(r[k]);
    for (int side = 0; side < 2; side++) {
        const double sign = frame_sign((Side)side), room = frame_room(damper, (Side)side);
        if (reach < room)
            continue;
        double gap[ROOT_DEGREE + 1];
        for (size_t k = 0; k <= arc->degree; k++)
            gap[k] = -sign * r[k];
        gap[0] += room;
        for (int k = 0; k < damper->leaving && damper->origin == (FrameOrigin)side; k++)
            gap[k] = 0;
        look_for(gap, arc->degree, (FrameEvent){.damper = d, .side = (Side)side}, is_found, first);
    }
}

// k p + c p' as coefficients, times `sign`.
static void spring_series(const FrameDamper *damper, const FrameArc *arc, const double *r,
                          double sign, double *out) {
    for (size_t k = 0; k < arc->degree; k++)
        out[k] = sign * (damper->contact.stiffness * r[k] +
                         damper->contact.damping * (double)(k + 1) * r[k + 1] / arc->length);
}

static void find_inside(const Frame *frame, const FrameArc *arc, size_t d, bool *is_found,
                        FrameEvent *first) {
    const FrameDamper *damper = &frame->damper[d];
    const double *r = frame_arc_r(arc, d), sign = frame_sign(damper->side);
    double gap[ROOT_DEGREE + 1];
    spring_series(damper, arc, r, -sign, gap);
    if (damper->is_fresh)
        gap[0] = 0;
    look_for(gap, arc->degree - 1,
             (FrameEvent){.damper = d, .side = damper->side, .is_inwards = true}, is_found, first);
    for (size_t k = 0; k <= arc->degree; k++)
        gap[k] = sign * r[k];
    look_for(gap, arc->degree, (FrameEvent){.damper = d, .side = damper->side}, is_found, first);
}

static void find_end(const Frame *frame, const FrameArc *arc, size_t d, bool *is_found,
                     FrameEvent *first) {
    const FrameDamper *damper = &frame->damper[d];
    const double sign = frame_sign(damper->side);
    const bool by_force =
        damper->phase == FRAME_RESTING || frame->plan->separation == SEPARATION_ZERO_FORCE;
    const double *of = by_force ? frame_arc_force(arc, d) : frame_arc_r(arc, d);
    const size_t degree = by_force ? arc->degree - 1 : arc->degree;
    double gap[ROOT_DEGREE + 1], size = 0;
    for (size_t k = 0; k <= degree; k++) {
        gap[k] = sign * of[k];
        size += fabs(of[k]);
    }
    FrameEvent event = {.damper = d, .side = damper->side};
    if (damper->phase == FRAME_RESTING && gap[0] < -64 * DBL_EPSILON * size) {
        event.is_jump = true;
        *is_found = true;
        *first = event;
        return;
    }
    // A contact that N's own zero has just begun again.
    if (damper->phase == FRAME_CONTACT && by_force && damper->is_fresh && damper->r != 0)
        gap[0] = 0;
    look_for(gap, degree, event, is_found, first);
}

bool frame_find_event(const Frame *frame, const FrameArc *arc, FrameEvent *event) {
    bool is_found = false;
    if (!frame->has_stops)
        return false;
    frame->run->work.stop_searches++;
    for (size_t d = 0; d < frame->dampers && !(is_found && event->s == 0); d++) {
        if (frame->damper[d].phase == FRAME_FLIGHT)
            find_touch(frame, arc, d, &is_found, event);
        else if (frame->damper[d].phase == FRAME_INSIDE)
            find_inside(frame, arc, d, &is_found, event);
        else
            find_end(frame, arc, d, &is_found, event);
    }
    return is_found;
}
