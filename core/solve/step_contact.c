// Contact state changes at step ends. No event is located in time: a contact begins with the
// penetration at the end of a step and ends with the overshoot past zero. Across contacts any
// method is therefore of first order.
//
//              p > 0                          p <= 0 (or, under zero force, N <= 0 and p <= 0)
//     FLIGHT ----------> CONTACT(side) ---------------------------------> FLIGHT
//        |                 |  ^ N > 0                                       ^
//        |        N <= 0,  |  |               p <= 0                        |
//        |         p > 0   +-> INSIDE(side) --------------------------------+
//        |   p >= 0, u' inwards: to the stop, u' -> -e u'
//        +--(impulse)--> FLIGHT, or RESTING(side) where the next flight lasts less than a step
//
// p is the penetration and N the contact force. A resting mass moves freely during a step; then an
// impulse returns it to its stop, simultaneously with all other dampers in collision. It leaves
// when a step moves it away from the stop.
#include "core/solve/step_contact.h"

#include <math.h>

#include "core/plan/plan.h"
#include "core/solve/engine.h"

ContactForce step_contact_force(const ModalState *state, size_t d, double r, double w) {
    const DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(damper->side);
    if (state->plan->form == CONTACT_POWER) {
        ContactForce force = state->plan->law->force(&damper->contact, sign * r, sign * w);
        force.value *= sign;
        return force;
    }
    const double k = damper->contact.stiffness, c = damper->contact.damping;
    return (ContactForce){
        .value = k * r + c * w, .by_penetration = k, .by_speed = c, .strain = 0.5 * k * r * r};
}

static double step_contact_strain(const ModalState *state, size_t d) {
    const DamperState *damper = &state->damper[d];
    return damper->phase == PHASE_CONTACT ? step_contact_force(state, d, damper->r, 0).strain : 0;
}

static double step_contact_magnitude(const ModalState *state, size_t d) {
    return fabs(step_contact_force(state, d, state->damper[d].r, state->damper[d].w).value);
}

void step_contact_begin(const ModalState *state, StepContact *contact) {
    for (size_t d = 0; d < state->dampers && state->has_stops; d++)
        contact->strain_before[d] = step_contact_strain(state, d);
}

// Penetration of a stop [m]. At most one of the two is positive, for the clearance is not negative.
static double step_contact_depth(const DamperState *damper, Side side) {
    return modal_state_sign(side) * damper->r - modal_state_room(damper, side);
}

static ContactPhase step_contact_next_phase(const ModalState *state, size_t d, Side *side) {
    const DamperState *damper = &state->damper[d];
    const double p = step_contact_depth(damper, *side);
    if (damper->phase == PHASE_FLIGHT) {
        *side = step_contact_depth(damper, SIDE_RIGHT) > step_contact_depth(damper, SIDE_LEFT)
                    ? SIDE_RIGHT
                    : SIDE_LEFT;
        return step_contact_depth(damper, *side) > 0 ? PHASE_CONTACT : PHASE_FLIGHT;
    }
    if (!(p > 0))
        return PHASE_FLIGHT;
    if (state->plan->separation != SEPARATION_ZERO_FORCE || state->plan->form != CONTACT_LINEAR)
        return PHASE_CONTACT;
    const double push =
        modal_state_sign(*side) * step_contact_force(state, d, damper->r, damper->w).value;
    return push > 0 ? PHASE_CONTACT : PHASE_INSIDE;
}

// Moves the origin of r to a stop.
static void step_contact_set_origin(DamperState *damper, Side side) {
    const double p = step_contact_depth(damper, side);
    damper->side = side;
    damper->origin = (ContactOrigin)side;
    damper->r = modal_state_sign(side) * p;
}

static void step_contact_open_row(ModalState *state, size_t d, double ago) {
    DamperState *damper = &state->damper[d];
    impact_log_open(&damper->row, IMPACT_IMPACT, modal_state_time(state) - ago, d, damper->side,
                    fmax(modal_state_sign(damper->side) * damper->w, 0));
}

static void step_contact_close_row(ModalState *state, size_t d) {
    DamperState *damper = &state->damper[d];
    impact_log_close(&state->impacts, &damper->row, modal_state_time(state),
                     fmax(-modal_state_sign(damper->side) * damper->w, 0));
}

static void step_contact_enter(ModalState *state, size_t d, Side side, bool is_by_place) {
    DamperState *damper = &state->damper[d];
    const bool is_new = damper->phase == PHASE_FLIGHT;
    step_contact_set_origin(damper, side);
    damper->phase = PHASE_CONTACT;
    if (is_new && !is_by_place)
        damper->contact = stops_freeze(&damper->plan->stops[side], fabs(damper->w));
    step_contact_open_row(state, d, 0);
    damper->row.impact.is_resumed = !is_new;
}

void step_contact_log(ModalState *state, const StepContact *contact, size_t d, double length) {
    DamperState *damper = &state->damper[d];
    impact_log_stretch(&state->impacts, &damper->row, length, contact->impulse[d],
                       contact->work[d] -
                           (step_contact_strain(state, d) - contact->strain_before[d]));
    if (damper->phase == PHASE_CONTACT)
        impact_log_force(&state->impacts, &damper->row, step_contact_magnitude(state, d));
}

// Of a method whose stages follow the penetration, the integrals of a step in which a contact
// begins or ends cover the contact's part of it. Other contacts last for whole steps.
static void step_contact_switch(ModalState *state, const StepContact *contact, size_t d,
                                ContactPhase next, Side side, double length) {
    DamperState *damper = &state->damper[d];
    if (damper->phase == PHASE_CONTACT) {
        if (contact->is_by_place || next == PHASE_INSIDE) // the strain left in the buffer is lost
            damper->phase = next;
        step_contact_log(state, contact, d, length);
        if (next != PHASE_CONTACT)
            step_contact_close_row(state, d);
    } else if (next == PHASE_CONTACT) {
        const bool is_resumed = damper->phase == PHASE_INSIDE;
        step_contact_enter(state, d, side, contact->is_by_place);
        if (contact->is_by_place || is_resumed)
            step_contact_log(state, contact, d, 0);
        impact_log_force(&state->impacts, &damper->row, step_contact_magnitude(state, d));
    } else if (contact->impulse[d] != 0) { // it began and ended within the step
        damper->side = contact->impulse[d] > 0 ? SIDE_RIGHT : SIDE_LEFT;
        step_contact_open_row(state, d, length);
        damper->row.impact.approach_speed = fabs(damper->w);
        step_contact_log(state, contact, d, length);
        impact_log_force(&state->impacts, &damper->row, fabs(contact->impulse[d]) / length);
        step_contact_close_row(state, d);
    }
    damper->phase = next;
}

// Selects the dampers that collide under the impulse law, and sets the separation speed of each.
static bool step_contact_select(ModalState *state, double length) {
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
        if (!is_pair &&
            (step_contact_depth(damper, damper->side) < 0 || (!is_resting && !(closing > 0))))
            continue;
        is_any = damper->in_collision = true;
        damper->approach_speed = fmax(closing, 0);
        if (is_resting || is_pair)
            continue;
        damper->contact = stops_freeze(&damper->plan->stops[damper->side], closing);
        // Restitution applies to the speed at the stop. The speed gained past the stop is removed,
        // or bounces would not decay; `closing` keeps it, because momentum is conserved.
        const double pull = sign * modal_state_acceleration(state, d);
        const double square =
            closing * closing - 2 * pull * step_contact_depth(damper, damper->side);
        const double parting = damper->contact.restitution * sqrt(fmax(square, 0));
        // The next flight would last less than a step: the mass rests.
        damper->just_begun = 2 * parting < pull * length;
        damper->is_bounced = true;
        damper->separation_speed = damper->just_begun ? 0 : parting;
    }
    return is_any;
}

static void step_contact_rest(ModalState *state, size_t d, double length) {
    DamperState *damper = &state->damper[d];
    const double impulse = modal_state_sign(damper->side) * damper->impulse;
    const Side side = impulse < 0 ? SIDE_LEFT : SIDE_RIGHT;
    if (damper->row.is_open && damper->impulse != 0 && (Side)damper->row.impact.side != side)
        impact_log_close(&state->impacts, &damper->row, modal_state_time(state) - length,
                         (double)NAN);
    if (!damper->row.is_open) // between stops without clearance it includes the step before
        impact_log_open(&damper->row, IMPACT_RESTING, modal_state_time(state) - length, d, side,
                        (double)NAN);
    impact_log_stretch(&state->impacts, &damper->row, length, impulse,
                       0.5 * damper->impulse * damper->approach_speed);
    impact_log_force(&state->impacts, &damper->row, fabs(damper->impulse) / length);
}

static void step_contact_bounce(ModalState *state, size_t d) {
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

static void step_contact_collide(ModalState *state, double length) {
    bool is_changed = false;
    if (step_contact_select(state, length))
        collision_resolve(state);
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        const ContactPhase last = damper->phase;
        const bool is_pressed = damper->in_collision && damper->impulse != 0;
        if (is_pressed) {
            step_contact_set_origin(damper, damper->side);
            damper->r = 0;
        }
        if (damper->plan->clearance == 0) {
            damper->phase = PHASE_RESTING;
            step_contact_rest(state, d, length);
        } else if (is_pressed && damper->is_bounced) {
            step_contact_bounce(state, d);
        } else if (last == PHASE_RESTING && is_pressed) {
            step_contact_rest(state, d, length);
        } else if (last == PHASE_RESTING) {
            damper->phase = PHASE_FLIGHT;
            impact_log_close(&state->impacts, &damper->row, modal_state_time(state), (double)NAN);
        }
        is_changed = is_changed || damper->phase != last;
    }
    if (is_changed)
        modal_state_constrain(state);
}

void step_contact_end(ModalState *state, const StepContact *contact, double length) {
    if (state->plan->form == CONTACT_IMPULSIVE) {
        if (state->dampers > 0)
            step_contact_collide(state, length);
        return;
    }
    for (size_t d = 0; d < state->dampers; d++) {
        Side side = state->damper[d].side;
        const ContactPhase next = step_contact_next_phase(state, d, &side);
        step_contact_switch(state, contact, d, next, side, length);
    }
}
