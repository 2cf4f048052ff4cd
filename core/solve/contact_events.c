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
// Under the impulse law an impact is a collision (collision.c) of all masses that reach their stops
// within the clock's resolution, and of all that rest: a resting one stays or parts. Bounces
// against a stop that pushes form a geometric series. The mass rests when the rest of the series
// takes less time than the clock resolves, or after many bounces at one instant.
#include "core/solve/engine.h"

#include <float.h>
#include <math.h>

#include "core/plan/plan.h"

enum { EVENTS_AT_INSTANT_MAX = 1000 }; // of each damper
enum { CHATTER_EVENTS_MAX = 10000 };   // of each damper under the impulse law
enum { STILL_BOUNCES = 64 };

static void contact_event_begin_contact(ModalState *state, size_t d, Side side) {
    DamperState *damper = &state->damper[d];
    const double speed = fabs(damper->w);
    damper->phase = PHASE_CONTACT;
    damper->side = side;
    damper->origin = (ContactOrigin)side;
    damper->r = 0;
    damper->just_begun = true;
    damper->contact = stops_freeze(&damper->plan->stops[side], speed);
    impact_log_open(&damper->row, IMPACT_IMPACT, modal_state_time(state), d, side, speed);
    impact_log_force(&state->impacts, &damper->row, damper->contact.damping * speed);
}

// Elastic energy in the buffer at the start or end of a contact [J].
static double contact_event_strain(const DamperState *damper) {
    return 0.5 * damper->contact.stiffness * damper->r * damper->r;
}

// N rises again while the mass is still in the buffer: the parameters of the impact remain.
static void contact_event_resume_contact(ModalState *state, size_t d) {
    DamperState *damper = &state->damper[d];
    damper->phase = PHASE_CONTACT;
    damper->just_begun = true;
    impact_log_open(&damper->row, IMPACT_IMPACT, modal_state_time(state), d, damper->side,
                    fmax(modal_state_sign(damper->side) * damper->w, 0));
    damper->row.impact.is_resumed = true;
    impact_log_stretch(&state->impacts, &damper->row, 0, 0, -contact_event_strain(damper));
}

// Leaves the buffer. The gap opens, so an inward speed is rounding.
static void contact_event_fly_off(DamperState *damper) {
    const double sign = modal_state_sign(damper->side);
    damper->phase = PHASE_FLIGHT;
    damper->just_begun = false;
    damper->r = 0;
    damper->w = sign * fmin(sign * damper->w, 0);
}

static void contact_event_end_contact(ModalState *state, size_t d) {
    DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(damper->side);
    const bool stays = state->plan->separation == SEPARATION_ZERO_FORCE &&
                       damper->contact.damping > 0 && sign * damper->r > 0;
    if (stays) {
        impact_log_stretch(&state->impacts, &damper->row, 0, 0, contact_event_strain(damper));
        damper->phase = PHASE_INSIDE;
        damper->just_begun = true;
    } else {
        contact_event_fly_off(damper);
    }
    impact_log_close(&state->impacts, &damper->row, modal_state_time(state),
                     fmax(-sign * damper->w, 0));
}

// After a collision a resting mass was pressed or parts.
static void contact_event_sort_resting(ModalState *state) {
    for (size_t e = 0; e < state->dampers; e++) {
        DamperState *damper = &state->damper[e];
        if (damper->zero_gap_terms > 0) // the gap's speed, or at least its curvature, has changed
            damper->zero_gap_terms = damper->w == 0 ? 2 : 0;
        if (damper->phase != PHASE_RESTING)
            continue;
        const double sign = modal_state_sign(damper->side);
        // A bounce of another mass may be as small as rounding: one that would be back within the
        // clock's resolution stays.
        const double pull = fabs(damper->force) / damper->effective_mass;
        if (damper->impulse == 0 && -2 * sign * damper->w > pull * modal_state_clock(state)) {
            damper->phase = PHASE_FLIGHT;
            impact_log_close(&state->impacts, &damper->row, modal_state_time(state), NAN);
        } else {
            damper->w = 0;
            impact_log_stretch(&state->impacts, &damper->row, 0, sign * damper->impulse, 0);
        }
    }
    modal_state_constrain(state);
}

static void contact_event_meet_resting(ModalState *state) {
    for (size_t e = 0; e < state->dampers; e++) {
        DamperState *damper = &state->damper[e];
        damper->in_collision = damper->phase == PHASE_RESTING;
        damper->approach_speed = damper->separation_speed = 0;
    }
}

// The remaining relative momentum is transferred.
static void contact_event_begin_rest(ModalState *state, size_t d, Side side) {
    DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(side), speed = fabs(damper->w);
    damper->side = side;
    damper->origin = (ContactOrigin)side;
    damper->r = 0;
    damper->zero_gap_terms = 0;
    contact_event_meet_resting(state);
    if (sign * damper->w > 0) {
        damper->in_collision = true;
        damper->approach_speed = speed;
        collision_resolve(state);
        contact_event_sort_resting(state);
    } else { // it approaches by rounding alone, after bounces that the clock does not tell apart
        damper->impulse = speed * damper->effective_mass;
        double *impulses = state->scratch;
        for (size_t e = 0; e < state->dampers; e++)
            impulses[e] = e == d ? damper->w * damper->effective_mass : 0;
        collision_push(state, impulses);
        for (size_t e = 0; e < state->dampers; e++)
            if (state->damper[e].phase == PHASE_RESTING)
                state->damper[e].w = 0;
    }
    damper->phase = PHASE_RESTING;
    damper->w = 0;
    modal_state_constrain(state);
    modal_state_forces(state);
    impact_log_open(&damper->row, IMPACT_RESTING, modal_state_time(state), d, side, NAN);
    impact_log_stretch(&state->impacts, &damper->row, 0, sign * damper->impulse,
                       0.5 * damper->impulse * speed);
    impact_log_force(&state->impacts, &damper->row, fabs(damper->force));
}

// Whether a damper in flight reaches that stop within the clock's resolution.
static bool contact_event_reaches(const DamperState *damper, Side side, double clock) {
    const double sign = modal_state_sign(side), closing = sign * damper->w;
    return damper->phase == PHASE_FLIGHT && damper->plan->clearance > 0 && closing > 0 &&
           modal_state_room(damper, side) - sign * damper->r <= closing * clock;
}

static void contact_event_bounce(ModalState *state, size_t d, Side side) {
    const double clock = modal_state_clock(state);
    contact_event_meet_resting(state);
    for (size_t e = 0; e < state->dampers; e++) {
        DamperState *damper = &state->damper[e];
        Side at = side;
        damper->is_bounced = false;
        if (e != d) {
            at = damper->w > 0 ? SIDE_RIGHT : SIDE_LEFT;
            if (!contact_event_reaches(damper, at, clock))
                continue;
        }
        damper->in_collision = damper->is_bounced = true;
        damper->side = at;
        damper->origin = (ContactOrigin)at;
        damper->r = 0;
        damper->approach_speed = fmax(modal_state_sign(at) * damper->w, 0);
        damper->contact = stops_freeze(&damper->plan->stops[at], damper->approach_speed);
        damper->separation_speed = state->events_at_instant > STILL_BOUNCES
                                       ? 0
                                       : damper->contact.restitution * damper->approach_speed;
    }
    collision_resolve(state);
    contact_event_sort_resting(state);
    for (size_t e = 0; e < state->dampers; e++) {
        DamperState *damper = &state->damper[e];
        if (!damper->is_bounced)
            continue;
        const double both = damper->approach_speed + damper->separation_speed;
        if (damper->impulse > 0 || e == d)
            impact_log_bounce(&state->impacts, modal_state_time(state), e, damper->side,
                              damper->approach_speed, damper->separation_speed,
                              both > 0 ? damper->impulse / both : damper->effective_mass);
    }
}

// Which of the dampers that have just bounced rest from now on.
static void contact_event_rest_bounced(ModalState *state) {
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        if (!damper->is_bounced)
            continue;
        modal_state_forces(state);
        const double pull = modal_state_sign(damper->side) * modal_state_acceleration(state, d);
        const double left =
            2 * damper->separation_speed / (pull * (1 - damper->contact.restitution));
        // Without a pull only a mass without speed rests. `left` is NaN where e = 1 and it has
        // none.
        if (pull > 0 ? !(left > modal_state_clock(state))
                     : pull == 0 && damper->separation_speed == 0)
            contact_event_begin_rest(state, d, damper->side);
    }
}

static void contact_event_touch(ModalState *state, size_t d, Side side) {
    state->damper[d].zero_gap_terms = 0;
    if (state->plan->form != CONTACT_IMPULSIVE) {
        contact_event_begin_contact(state, d, side);
    } else if (state->damper[d].plan->clearance == 0) {
        contact_event_begin_rest(state, d, side);
    } else {
        contact_event_bounce(state, d, side);
        contact_event_rest_bounced(state);
    }
}

static void contact_event_release(ModalState *state, size_t d, bool is_jump) {
    DamperState *damper = &state->damper[d];
    damper->phase = PHASE_FLIGHT;
    damper->zero_gap_terms = is_jump ? 2 : 3;
    damper->r = damper->w = 0;
    impact_log_close(&state->impacts, &damper->row, modal_state_time(state), NAN);
    modal_state_constrain(state);
    if (damper->plan->clearance == 0) // between stops without clearance the other one takes over
        contact_event_begin_rest(state, d, damper->side == SIDE_RIGHT ? SIDE_LEFT : SIDE_RIGHT);
}

void contact_event_leave(DamperState *damper, bool is_hit) {
    const double sign = modal_state_sign((Side)damper->origin);
    if (sign * damper->r < 0)
        damper->zero_gap_terms = 0;
    else if (!is_hit || sign * damper->w < 0)
        damper->r = damper->w = 0;
}

Status contact_event_apply(ModalState *state, const ContactEvent *event) {
    DamperState *damper = &state->damper[event->damper];
    const size_t max = EVENTS_AT_INSTANT_MAX * state->dampers;
    state->events++;
    state->chatter_events++;
    if (++state->events_at_instant > max)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", max,
                           modal_state_time(state));
    // Steps far below the clock's resolution, as of a mass that a base of 1e300 m/s^2 presses to
    // either stop in turn: the clock would stand still until a limit ends the run.
    if (state->plan->form == CONTACT_IMPULSIVE &&
        state->chatter_events > CHATTER_EVENTS_MAX * state->dampers)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "more than %zu contact events within %.3g s, t = %.17g s",
                           CHATTER_EVENTS_MAX * state->dampers, modal_state_clock(state),
                           modal_state_time(state));
    recorder_update(state);
    switch (damper->phase) {
    case PHASE_FLIGHT:
        contact_event_touch(state, event->damper, event->side);
        break;
    case PHASE_CONTACT:
        contact_event_end_contact(state, event->damper);
        break;
    case PHASE_INSIDE:
        if (event->is_inwards)
            contact_event_resume_contact(state, event->damper);
        else
            contact_event_fly_off(damper);
        break;
    case PHASE_RESTING:
        contact_event_release(state, event->damper, event->is_jump);
        break;
    }
    recorder_update(state);
    return impact_log_status(&state->impacts, state->problem);
}

void contact_event_locate(const double *series, size_t degree, double sign, double room, int zeros,
                          ContactEvent candidate, ContactEvent *first) {
    double gap[POLYNOMIAL_DEGREE_MAX + 1];
    for (size_t k = 0; k <= degree; k++)
        gap[k] = (int)k < zeros ? 0 : sign * series[k];
    gap[0] = zeros > 0 ? 0 : fmax(gap[0] + room, 0);
    if (polynomial_root_first(gap, degree, &candidate.s) && candidate.s < first->s)
        *first = candidate;
}

void contact_event_find_touch(const ModalState *state, size_t d, const double *r, size_t degree,
                              ContactEvent *first) {
    const DamperState *damper = &state->damper[d];
    double reach = 0;
    for (size_t k = 0; k <= degree; k++)
        reach += fabs(r[k]);
    for (Side side = SIDE_LEFT; side <= SIDE_RIGHT; side++) {
        const double room = modal_state_room(damper, side);
        if (reach >= room)
            contact_event_locate(r, degree, -modal_state_sign(side), room,
                                 damper->origin == (ContactOrigin)side ? damper->zero_gap_terms : 0,
                                 (ContactEvent){.damper = d, .side = side}, first);
    }
}

static void contact_event_find_inside(const ModalState *state, const TaylorStep *arc, size_t d,
                                      ContactEvent *first) {
    const DamperState *damper = &state->damper[d];
    const double *r = taylor_step_r(arc, d), sign = modal_state_sign(damper->side);
    double force[POLYNOMIAL_DEGREE_MAX + 1] = {0}; // k p + c p'
    for (size_t k = 0; k < arc->degree; k++)
        force[k] = damper->contact.stiffness * r[k] +
                   damper->contact.damping * (double)(k + 1) * r[k + 1] / arc->length;
    contact_event_locate(force, arc->degree - 1, -sign, 0, damper->just_begun,
                         (ContactEvent){.damper = d, .side = damper->side, .is_inwards = true},
                         first);
    contact_event_locate(r, arc->degree, sign, 0, 0,
                         (ContactEvent){.damper = d, .side = damper->side}, first);
}

static void contact_event_find_end(const ModalState *state, const TaylorStep *arc, size_t d,
                                   ContactEvent *first) {
    const DamperState *damper = &state->damper[d];
    const double sign = modal_state_sign(damper->side);
    const bool is_resting = damper->phase == PHASE_RESTING;
    const bool by_force = is_resting || state->plan->separation == SEPARATION_ZERO_FORCE;
    const double *of = by_force ? taylor_step_force(arc, d) : taylor_step_r(arc, d);
    const size_t degree = by_force ? arc->degree - 1 : arc->degree;
    double size = 0;
    for (size_t k = 0; k <= degree; k++)
        size += fabs(of[k]);
    ContactEvent event = {.damper = d, .side = damper->side};
    event.is_jump = is_resting && sign * of[0] < -64 * DBL_EPSILON * size;
    // A contact that has just begun again at N = 0.
    const bool is_zero = !is_resting && by_force && damper->just_begun && damper->r != 0;
    if (event.is_jump)
        *first = event;
    else
        contact_event_locate(of, degree, sign, 0, is_zero, event, first);
}

bool contact_event_find(const ModalState *state, const TaylorStep *arc, ContactEvent *event) {
    *event = (ContactEvent){.s = INFINITY};
    if (!state->has_stops)
        return false;
    state->run->work.stop_searches++;
    for (size_t d = 0; d < state->dampers && event->s > 0; d++) {
        if (state->damper[d].phase == PHASE_FLIGHT)
            contact_event_find_touch(state, d, taylor_step_r(arc, d), arc->degree, event);
        else if (state->damper[d].phase == PHASE_INSIDE)
            contact_event_find_inside(state, arc, d, event);
        else
            contact_event_find_end(state, arc, d, event);
    }
    return event->s <= 1;
}
