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

#include "core/plan/plan.h"
#include "core/solve/collision.h"
#include "core/solve/time_stepping.h"

static double strain(const ModalState *state, size_t d) {
    const DamperState *damper = &state->damper[d];
    return damper->phase == PHASE_CONTACT ? steps_contact(state, d, damper->r, 0).strain : 0;
}

// Into the stop: at most one of the two, for between them there is room or none at all.
static double depth(const DamperState *damper, Side side) {
    return modal_state_sign(side) * damper->r - modal_state_room(damper, side);
}

static ContactPhase next_phase(const ModalState *state, size_t d, Side *side) {
    const DamperState *damper = &state->damper[d];
    const double p = depth(damper, *side);
    if (damper->phase == PHASE_FLIGHT) {
        *side = depth(damper, SIDE_RIGHT) > depth(damper, SIDE_LEFT) ? SIDE_RIGHT : SIDE_LEFT;
        return depth(damper, *side) > 0 ? PHASE_CONTACT : PHASE_FLIGHT;
    }
    if (!(p > 0))
        return PHASE_FLIGHT;
    if (state->plan->separation != SEPARATION_ZERO_FORCE || state->plan->form != CONTACT_LINEAR)
        return PHASE_CONTACT;
    const double push =
        modal_state_sign(*side) * steps_contact(state, d, damper->r, damper->w).value;
    return push > 0 ? PHASE_CONTACT : PHASE_INSIDE;
}

// r is counted from that stop from now on.
static void place(DamperState *damper, Side side) {
    const double p = depth(damper, side);
    damper->side = side;
    damper->origin = (ContactOrigin)side;
    damper->r = modal_state_sign(side) * p;
}

static void open_row(ModalState *state, size_t d, double ago) {
    DamperState *damper = &state->damper[d];
    impact_log_open(&damper->row, IMPACT_IMPACT, modal_state_time(state) - ago, d, damper->side,
                    fmax(modal_state_sign(damper->side) * damper->w, 0));
}

static void close_row(ModalState *state, size_t d) {
    DamperState *damper = &state->damper[d];
    impact_log_close(&state->impacts, &damper->row, modal_state_time(state),
                     fmax(-modal_state_sign(damper->side) * damper->w, 0));
}

static void enter(Steps *steps, size_t d, Side side) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    const bool is_new = damper->phase == PHASE_FLIGHT;
    place(damper, side);
    damper->phase = PHASE_CONTACT;
    if (is_new && !steps->stepper->is_by_place)
        damper->contact = stops_freeze(&damper->plan->stops[side], fabs(damper->w));
    open_row(state, d, 0);
    damper->row.impact.is_resumed = !is_new;
}

// A stretch of contact lies behind.
static void book(Steps *steps, size_t d, double length) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    impact_log_stretch(&state->impacts, &damper->row, length, steps->sums.impulse[d],
                       steps->sums.work[d] - (strain(state, d) - steps->before[d]));
    if (damper->phase == PHASE_CONTACT)
        impact_log_force(&state->impacts, &damper->row,
                         fabs(steps_contact(state, d, damper->r, damper->w).value));
}

// The force followed the phase all through the step.
static void turn_by_phase(Steps *steps, size_t d, ContactPhase next, Side side, double length) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    if (damper->phase == PHASE_CONTACT)
        book(steps, d, length);
    if (damper->phase == next)
        return;
    if (next == PHASE_CONTACT) {
        const bool is_resumed = damper->phase == PHASE_INSIDE;
        enter(steps, d, side);
        if (is_resumed)
            impact_log_stretch(&state->impacts, &damper->row, 0, 0, -strain(state, d));
        impact_log_force(&state->impacts, &damper->row,
                         fabs(steps_contact(state, d, damper->r, damper->w).value));
        return;
    }
    if (damper->phase == PHASE_CONTACT) {
        if (next == PHASE_INSIDE) // what is left in the spring
            impact_log_stretch(&state->impacts, &damper->row, 0, 0, strain(state, d));
        close_row(state, d);
    }
    damper->phase = next;
}

// The force followed the place: a step in which a contact begins or ends has a part of it.
static void turn_by_place(Steps *steps, size_t d, ContactPhase next, Side side, double length) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    const ContactPhase last = damper->phase;
    if (last == PHASE_CONTACT) {
        damper->phase = next;
        book(steps, d, length);
        if (next != PHASE_CONTACT)
            close_row(state, d);
    } else if (next == PHASE_CONTACT) {
        enter(steps, d, side);
        book(steps, d, 0);
    } else if (steps->sums.impulse[d] != 0) { // begun and over
        damper->side = steps->sums.impulse[d] > 0 ? SIDE_RIGHT : SIDE_LEFT;
        open_row(state, d, length);
        damper->row.impact.approach_speed = fabs(damper->w);
        damper->phase = PHASE_FLIGHT;
        book(steps, d, length);
        impact_log_force(&state->impacts, &damper->row, fabs(steps->sums.impulse[d]) / length);
        close_row(state, d);
        damper->phase = next;
    } else {
        damper->phase = next;
    }
}

// Which dampers are met at their stops, and how fast each must part.
static bool meet(Steps *steps, double length) {
    ModalState *state = &steps->state;
    bool is_any = false;
    modal_state_forces(state);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        const bool is_resting = damper->phase == PHASE_RESTING,
                   is_pair = damper->plan->clearance == 0;
        damper->in_collision = damper->is_bounced = damper->just_begun = false;
        damper->approach_speed = damper->separation_speed = 0;
        if (!is_resting || is_pair)
            damper->side = damper->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
        const double sign = modal_state_sign(damper->side), closing = sign * damper->w;
        if (!is_pair && (depth(damper, damper->side) < 0 || (!is_resting && !(closing > 0))))
            continue;
        is_any = damper->in_collision = true;
        damper->approach_speed = fmax(closing, 0);
        if (is_resting || is_pair)
            continue;
        damper->contact = stops_freeze(&damper->plan->stops[damper->side], closing);
        // The speed at the stop, without what has been gained beyond it: or bounces would not die
        // away. `closing` is that of now, for momentum is kept.
        const double pull = sign * modal_state_acceleration(state, d);
        const double square = closing * closing - 2 * pull * depth(damper, damper->side);
        const double parting = damper->contact.restitution * sqrt(fmax(square, 0));
        // A flight that is over within a step: it rests from now on.
        damper->just_begun = 2 * parting < pull * length;
        damper->is_bounced = true;
        damper->separation_speed = damper->just_begun ? 0 : parting;
    }
    return is_any;
}

static void rest(Steps *steps, size_t d, double length) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    const double impulse = modal_state_sign(damper->side) * damper->impulse;
    const Side side = impulse < 0 ? SIDE_LEFT : SIDE_RIGHT;
    if (damper->row.is_open && damper->impulse != 0 && (Side)damper->row.impact.side != side)
        impact_log_close(&state->impacts, &damper->row, modal_state_time(state) - length,
                         (double)NAN);
    if (!damper->row.is_open) // between stops without clearance the step before belongs to it
        impact_log_open(&damper->row, IMPACT_RESTING, modal_state_time(state) - length, d, side,
                        (double)NAN);
    impact_log_stretch(&state->impacts, &damper->row, length, impulse,
                       0.5 * damper->impulse * damper->approach_speed);
    impact_log_force(&state->impacts, &damper->row, fabs(damper->impulse) / length);
}

static void bounce(Steps *steps, size_t d) {
    ModalState *state = &steps->state;
    DamperState *damper = &state->damper[d];
    const double both = damper->approach_speed + damper->separation_speed;
    impact_log_bounce(&state->impacts, modal_state_time(state), d, damper->side,
                      damper->approach_speed, damper->separation_speed, damper->impulse / both);
    if (!damper->just_begun)
        return;
    damper->phase = PHASE_RESTING;
    impact_log_open(&damper->row, IMPACT_RESTING, modal_state_time(state), d, damper->side,
                    (double)NAN);
}

static void collide(Steps *steps, double length) {
    ModalState *state = &steps->state;
    const bool is_any = meet(steps, length);
    bool is_changed = false;
    if (is_any)
        collision_resolve(state);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        const ContactPhase last = damper->phase;
        const bool is_pressed = damper->in_collision && damper->impulse != 0;
        if (is_pressed) {
            place(damper, damper->side);
            damper->r = 0;
        }
        if (damper->plan->clearance == 0) {
            damper->phase = PHASE_RESTING;
            rest(steps, d, length);
        } else if (is_pressed && damper->is_bounced) {
            bounce(steps, d);
        } else if (last == PHASE_RESTING && is_pressed) {
            rest(steps, d, length);
        } else if (last == PHASE_RESTING) {
            damper->phase = PHASE_FLIGHT;
            impact_log_close(&state->impacts, &damper->row, modal_state_time(state), (double)NAN);
        }
        is_changed = is_changed || damper->phase != last;
    }
    if (is_changed)
        modal_state_constrain(state);
}

void steps_turn(Steps *steps, double length) {
    ModalState *state = &steps->state;
    if (state->plan->form == CONTACT_IMPULSIVE) {
        if (state->dampers > 0)
            collide(steps, length);
        return;
    }
    for (size_t d = 0; d < state->dampers; d++) {
        Side side = state->damper[d].side;
        const ContactPhase next = next_phase(state, d, &side);
        if (steps->stepper->is_by_place)
            turn_by_place(steps, d, next, side, length);
        else
            turn_by_phase(steps, d, next, side, length);
    }
}
