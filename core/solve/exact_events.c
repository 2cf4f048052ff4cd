#include "core/solve/exact_events.h"

#include <float.h>
#include <math.h>

void exact_note(Exact *exact) {
    const Instant at = exact_moment(exact);
    impact_log_peaks(&exact->ledger, &at);
    if (exact->pending > 0) // not all work is in the ledger yet
        return;
    const EnergyState energy = exact_energy(exact);
    impact_log_balance(&exact->ledger, &energy);
}

void exact_pass_sample(Exact *exact) {
    exact->sample++;
    exact->offset = 0;
    const Instant at = exact_moment(exact);
    if (exact->sample == exact->recorder.statistics_start)
        impact_log_forget_peaks(&exact->ledger, &at);
    const bool is_base_wanted = exact->recorder.columns[CHANNEL_BASE_ACCELERATION] != NULL;
    exact_record_take(&exact->recorder, exact->sample, &at,
                      is_base_wanted ? base_cursor_at(&exact->base, exact->sample) : 0);
    impact_log_peaks(&exact->ledger, &at);
}

void exact_end_phase(Exact *exact) {
    const double time = exact_time(exact), largest = exact->ledger.response->peaks.displacement;
    if (exact->phase == FLIGHT)
        trust_fly(&exact->trust, time, &exact->state, largest);
    else if (exact->phase == CONTACT)
        trust_press(&exact->trust, exact->side, time, &exact->state, largest);
    else
        trust_rest(&exact->trust, time, &exact->state, largest);
}

// Only the force has changed.
static void note_force(Exact *exact) {
    impact_log_acceleration(&exact->ledger,
                            exact_force(exact) / exact->plan->mass[0] - exact_push(exact));
}

static void begin_contact(Exact *exact, Side side) {
    exact->phase = CONTACT;
    exact->contact_arcs = 0;
    exact->side = side;
    exact->origin = (Origin)side;
    exact->state.r = 0;
    const double speed = fabs(exact->state.w);
    impact_log_open(&exact->row, IMPACT_IMPACT, exact_time(exact), 0, side, speed);
    impact_log_force(&exact->ledger, &exact->row, exact->damper->stops[side].damping * speed);
}

static void begin_rest(Exact *exact, Side side) {
    // What relative momentum is left goes over to both, conserved.
    const double mass = exact_effective_mass(exact), speed = fabs(exact->state.w);
    trust_stick(&exact->trust);
    exact->state.v += exact->resting.share * exact->state.w;
    exact->state.w = 0;
    exact->state.r = 0;
    exact->origin = (Origin)side;
    exact->phase = RESTING;
    exact->side = side;
    impact_log_open(&exact->row, IMPACT_RESTING, exact_time(exact), 0, side, NAN);
    impact_log_stretch(&exact->ledger, &exact->row, 0, exact_sign(side) * mass * speed,
                       0.5 * mass * speed * speed);
    impact_log_force(&exact->ledger, &exact->row, fabs(exact_force(exact)));
}

static void bounce(Exact *exact, Side side) {
    const double sign = exact_sign(side), e = exact->damper->stops[side].restitution;
    const double approach = fabs(exact->state.w);
    const double mass = exact_effective_mass(exact); // m_e = m M / (M + m)
    trust_bounce(&exact->trust, e, exact->state.w, exact_push(exact));
    exact->origin = (Origin)side;
    exact->state.r = 0;
    exact->state.v += sign * exact->resting.share * (1 + e) * approach;
    exact->state.w = -sign * e * approach;
    impact_log_bounce(&exact->ledger, exact_time(exact), 0, side, approach, e * approach, mass);
    // Bounces towards a pushing stop follow each other in a geometric series. When all that are
    // left take less time than the clock resolves, they are one: the mass rests.
    const double pull = sign * exact_push(exact);
    const double left = 2 * e * approach / (pull * (1 - e));
    const double clock = 4 * DBL_EPSILON * fmax(exact_time(exact), exact->interval);
    // Without a pull, be it 0 or -0, only a mass without speed rests; left is not a number where e
    // = 1 and it has none.
    if (pull > 0 ? !(left > clock) : pull == 0 && e * approach == 0)
        begin_rest(exact, side);
}

void exact_touch(Exact *exact, Side side) {
    exact->is_leaving = false;
    exact_note(exact);
    exact_end_phase(exact);
    if (exact->plan->form == CONTACT_LINEAR) {
        begin_contact(exact, side);
        note_force(exact);
        return;
    }
    if (exact->damper->clearance == 0)
        begin_rest(exact, side);
    else
        bounce(exact, side);
    exact_note(exact);
}

void exact_release(Exact *exact) {
    exact_note(exact);
    exact_end_phase(exact);
    // A slope of the wrong sign is rounding: the gap does open.
    const double sign = exact_sign(exact->side);
    exact->is_leaving = exact->phase == RESTING;
    exact->state.r = 0;
    exact->state.w = exact->is_leaving ? 0 : (sign * exact->state.w < 0 ? exact->state.w : 0);
    impact_log_close(&exact->ledger, &exact->row, exact_time(exact),
                     exact->phase == RESTING ? NAN : fabs(exact->state.w));
    const bool is_held = exact->phase == RESTING && exact->damper->clearance == 0;
    exact->phase = FLIGHT;
    if (is_held) // between stops without clearance the other one takes over
        begin_rest(exact, exact->side == SIDE_RIGHT ? SIDE_LEFT : SIDE_RIGHT);
    note_force(exact);
}

// Finds the first event on the arc. In flight `side` is the stop that is reached.
bool exact_find_event(Exact *exact, const Arc *arc, double *s, Side *side) {
    double gap[ROOT_DEGREE + 1] = {0};
    *side = exact->side;
    if (exact->phase == RESTING) {
        // arc.push times the side's sign must stay positive.
        const double sign = exact_sign(exact->side);
        for (size_t k = 0; k < arc->degree; k++)
            gap[k] = sign * arc->push[k];
        gap[0] = fmax(gap[0], 0);
        return root_first_crossing(gap, arc->degree - 1, s);
    }
    if (exact->phase == CONTACT) {
        const double sign = exact_sign(exact->side);
        for (size_t k = 0; k <= arc->degree; k++)
            gap[k] = sign * arc->r[k];
        gap[0] = fmax(gap[0], 0);
        return root_first_crossing(gap, arc->degree, s);
    }
    bool is_found = false;
    if (!exact->has_stops)
        return false;
    exact->run->work.stop_searches++;
    for (int i = 0; i < 2; i++) {
        const double sign = exact_sign((Side)i);
        for (size_t k = 0; k <= arc->degree; k++)
            gap[k] = -sign * arc->r[k];
        gap[0] = fmax(gap[0] + exact_room(exact, (Side)i), 0);
        if (exact->is_leaving && exact->origin == (Origin)i)
            gap[0] = gap[1] = gap[2] = 0;
        double at;
        if (root_first_crossing(gap, arc->degree, &at) && (!is_found || at < *s)) {
            is_found = true;
            *s = at;
            *side = (Side)i;
        }
    }
    return is_found;
}
