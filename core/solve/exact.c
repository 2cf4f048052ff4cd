// The exact solver. Between events the scene is a linear system:
//
//              gap closes                    p back at 0 (linear contact)
//     FLIGHT ------------> CONTACT(side) ------------------------------> FLIGHT
//        |   gap closes                    bounce shorter than the clock
//        +--(impulse)--> u' -> -e u' ----------------------------------> RESTING(side)
//                                                 push becomes tensile -> FLIGHT
//
// Flight over a whole sample interval is one matrix step where a bound on the gap's curvature proves that no stop
// can be reached; everything else goes by arcs (arc.h), whose polynomials locate events to rounding. Time is a
// sample's number and an offset from it, so that short contacts keep their digits late in a run.
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/arc.h"
#include "core/solve/cursor.h"
#include "core/solve/flight.h"
#include "core/solve/hold.h"
#include "core/solve/ledger.h"
#include "core/solve/record.h"
#include "core/solve/solver.h"

enum { WATCH_ARCS = 8192, STILL_EVENTS = 1000, HOLD_AFTER = 48 };

typedef enum Phase { FLIGHT, CONTACT, RESTING } Phase;
typedef enum Origin { ORIGIN_LEFT = SIDE_LEFT, ORIGIN_RIGHT = SIDE_RIGHT, ORIGIN_MIDDLE } Origin;

typedef struct Exact {
    Run *run;
    const Plan *plan;
    Problem *problem;
    Motion flying, touching[2], resting;
    Flight flight;
    Phase phase;
    Side side;      // of CONTACT and RESTING
    Origin origin;  // what state.r is counted from
    bool is_leaving;  // released from rest a moment ago: gap, its speed and its acceleration are exactly 0
    State state;
    size_t sample;  // the last one passed
    double offset;  // time since then [s]
    double interval;
    BaseCursor base;
    Ledger ledger;
    Recorder recorder;
    Hold *holds[2];       // by Side; made when a contact first lasts long
    size_t contact_arcs;  // since it began
    size_t arcs;          // since the watch was asked
    size_t still_events;  // in a row, without time passing
} Exact;

static double sign_of(Side side) {
    return side == SIDE_RIGHT ? 1 : -1;
}

// Room between the free mass and a stop at r = 0 of the present origin [m].
static double room(const Exact *exact, Side side) {
    if (exact->origin == ORIGIN_MIDDLE)
        return exact->plan->clearance / 2;
    return exact->origin == (Origin)side ? 0 : exact->plan->clearance;
}

// u = x-relative displacement of the free mass [m].
static double relative(const Exact *exact) {
    const double stop = exact->plan->clearance / 2;
    const double origin = exact->origin == ORIGIN_MIDDLE ? 0 : sign_of((Side)exact->origin) * stop;
    return exact->plan->offset + origin + exact->state.r;
}

static double now(const Exact *exact) {
    return (double)exact->sample / exact->plan->sample_rate + exact->offset;
}

// s = (C v + K x) / M: what pushes the free mass to the right, seen from the structure [m/s^2].
static double push(const Exact *exact) {
    return exact->flying.damping * exact->state.v + exact->flying.omega2 * exact->state.x;
}

// Contact force on the structure, positive to the right [N].
static double force(const Exact *exact) {
    const Plan *plan = exact->plan;
    if (exact->phase == CONTACT)
        return plan->stops[exact->side].stiffness * exact->state.r + plan->stops[exact->side].damping * exact->state.w;
    if (exact->phase == RESTING)
        return plan->damper_mass * (1 - exact->resting.share) * push(exact);
    return 0;
}

static Moment moment(const Exact *exact) {
    const double n = force(exact);
    Moment moment = {.x = exact->state.x,
                     .v = exact->state.v,
                     .acceleration = n / exact->plan->mass - push(exact),
                     .force = n};
    if (exact->plan->has_damper) {
        moment.damper_x = exact->state.x + relative(exact);
        moment.damper_v = exact->state.v + exact->state.w;
        moment.penetration = exact->phase == CONTACT ? fmax(sign_of(exact->side) * exact->state.r, 0) : 0;
    }
    return moment;
}

static EnergyState energy_state(const Exact *exact) {
    const Plan *plan = exact->plan;
    const State *state = &exact->state;
    const double z = state->v + state->w;
    const double k = exact->phase == CONTACT ? plan->stops[exact->side].stiffness : 0;
    return (EnergyState){0.5 * plan->mass * state->v * state->v + 0.5 * plan->damper_mass * z * z,
                         0.5 * plan->stiffness * state->x * state->x + 0.5 * k * state->r * state->r};
}

static const Motion *motion(const Exact *exact) {
    return exact->phase == FLIGHT    ? &exact->flying
           : exact->phase == CONTACT ? &exact->touching[exact->side]
                                     : &exact->resting;
}

static void note_event(Exact *exact) {
    const Moment at = moment(exact);
    const EnergyState energy = energy_state(exact);
    ledger_peaks(&exact->ledger, &at);
    ledger_balance(&exact->ledger, &energy);
}

static void begin_contact(Exact *exact, Side side) {
    exact->phase = CONTACT;
    exact->contact_arcs = 0;
    exact->side = side;
    exact->origin = (Origin)side;
    exact->state.r = 0;
    const double speed = fabs(exact->state.w);
    ledger_open(&exact->ledger, IMPACT_IMPACT, now(exact), side, speed);
    ledger_force(&exact->ledger, exact->plan->stops[side].damping * speed);
}

static void begin_rest(Exact *exact, Side side) {
    // What relative momentum is left goes over to both, conserved.
    const double mass = exact->plan->damper_mass * (1 - exact->resting.share);
    ledger_lose(&exact->ledger, 0.5 * mass * exact->state.w * exact->state.w);
    exact->state.v += exact->resting.share * exact->state.w;
    exact->state.w = 0;
    exact->state.r = 0;
    exact->origin = (Origin)side;
    exact->phase = RESTING;
    exact->side = side;
    ledger_open(&exact->ledger, IMPACT_RESTING, now(exact), side, NAN);
    ledger_force(&exact->ledger, fabs(force(exact)));
}

static void bounce(Exact *exact, Side side) {
    const Plan *plan = exact->plan;
    const double sign = sign_of(side), e = plan->stops[side].restitution;
    const double approach = fabs(exact->state.w);
    const double mass = plan->damper_mass * (1 - exact->resting.share);  // m_e = m M / (M + m)
    exact->origin = (Origin)side;
    exact->state.r = 0;
    exact->state.v += sign * exact->resting.share * (1 + e) * approach;
    exact->state.w = -sign * e * approach;
    ledger_bounce(&exact->ledger, now(exact), side, approach, e * approach, mass);
    // Bounces towards a pushing stop follow each other in a geometric series. When all that are left take less time
    // than the clock resolves, they are one: the mass rests.
    const double pull = sign * push(exact);
    const double left = 2 * e * approach / (pull * (1 - e));
    const double clock = 4 * DBL_EPSILON * fmax(now(exact), exact->interval);
    if (pull >= 0 && (e * approach == 0 || left <= clock))
        begin_rest(exact, side);
}

static void touch(Exact *exact, Side side) {
    exact->is_leaving = false;
    note_event(exact);
    if (exact->plan->form == CONTACT_LINEAR)
        begin_contact(exact, side);
    else if (exact->plan->clearance == 0)
        begin_rest(exact, side);
    else
        bounce(exact, side);
    note_event(exact);
}

static void release(Exact *exact) {
    note_event(exact);
    // A slope of the wrong sign is rounding: the gap does open.
    const double sign = sign_of(exact->side);
    exact->is_leaving = exact->phase == RESTING;
    exact->state.r = 0;
    exact->state.w = exact->is_leaving ? 0 : sign * fmin(sign * exact->state.w, 0);
    ledger_close(&exact->ledger, now(exact), exact->phase == RESTING ? NAN : fabs(exact->state.w));
    const bool is_held = exact->phase == RESTING && exact->plan->clearance == 0;
    exact->phase = FLIGHT;
    if (is_held)  // between stops without clearance the other one takes over
        begin_rest(exact, exact->side == SIDE_RIGHT ? SIDE_LEFT : SIDE_RIGHT);
    note_event(exact);
}

// Finds the first event on the arc. In flight `side` is the stop that is reached.
static bool find_event(const Exact *exact, Arc *arc, double *s, Side *side) {
    double gap[ROOT_DEGREE + 1];
    *side = exact->side;
    if (exact->phase == RESTING) {
        // arc.push times the side's sign must stay positive.
        const double sign = sign_of(exact->side);
        for (size_t k = 0; k < arc->degree; k++)
            gap[k] = sign * arc->push[k];
        gap[0] = fmax(gap[0], 0);
        return root_first_crossing(gap, arc->degree - 1, s);
    }
    if (exact->phase == CONTACT) {
        const double sign = sign_of(exact->side);
        for (size_t k = 0; k <= arc->degree; k++)
            gap[k] = sign * arc->r[k];
        gap[0] = fmax(gap[0], 0);
        return root_first_crossing(gap, arc->degree, s);
    }
    bool is_found = false;
    if (!exact->plan->has_damper)
        return false;
    for (int i = 0; i < 2; i++) {
        const double sign = sign_of((Side)i);
        for (size_t k = 0; k <= arc->degree; k++)
            gap[k] = -sign * arc->r[k];
        gap[0] = fmax(gap[0] + room(exact, (Side)i), 0);
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

static void take_integrals(Exact *exact, const ArcIntegrals *integrals) {
    const Plan *plan = exact->plan;
    ledger_work(&exact->ledger,
                -plan->mass * integrals->av - plan->damper_mass * (integrals->av + integrals->aw),
                plan->damping * integrals->vv);
    recorder_base(&exact->recorder, integrals->a);
}

// What a stretch of contact or rest adds to its row of the ledger.
static void take_contact(Exact *exact, const Arc *arc, const ArcIntegrals *integrals) {
    const double mass = exact->plan->damper_mass * (1 - exact->resting.share);
    double s = -1;
    const double peak = arc_peak_force(arc, exact->ledger.open.peak_force / mass, &s);
    ledger_force(&exact->ledger, mass * peak);
    if (s >= 0) {
        const State middle = arc_at(arc, s);
        const double n = root_value(arc->force, arc->degree - 1, s) / (arc->length * arc->length);
        const double own = exact->flying.damping * middle.v + exact->flying.omega2 * middle.x;
        ledger_acceleration(&exact->ledger, exact->resting.share * n - own);
    }
    ledger_stretch(&exact->ledger, arc->length, mass * arc_impulse(arc),
                   exact->phase == CONTACT ? exact->plan->stops[exact->side].damping * integrals->ww : 0);
}

// After an arc of free flight: has the gap opened beyond rounding yet?
static void leave(Exact *exact) {
    const double sign = sign_of((Side)exact->origin);
    if (sign * exact->state.r < 0 && sign * exact->state.w < 0)
        exact->is_leaving = false;
    else
        exact->state.r = exact->state.w = 0;
}

static Status keep_going(Exact *exact) {
    const State *state = &exact->state;
    exact->arcs = 0;
    if (!isfinite(state->x) || !isfinite(state->v) || !isfinite(state->r) || !isfinite(state->w))
        return problem_set(exact->problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s", now(exact));
    if (!watch_advance(exact->run->watch, now(exact) / exact->plan->duration))
        return problem_set(exact->problem, STATUS_CANCELLED, "cancelled at t = %.6g s", now(exact));
    return STATUS_OK;
}

// A long step of a contact that has lasted for many arcs. False: it must go by arcs.
static bool hold(Exact *exact, const Slice *slice, double length) {
    Hold *held = exact->holds[exact->side];
    if (held == NULL && (held = exact->holds[exact->side] = calloc(1, sizeof *held)) == NULL)
        return false;
    if (!held->is_made)
        hold_make(held, &exact->touching[exact->side], slice->omega, exact->interval);
    const double mass = exact->plan->damper_mass * (1 - exact->resting.share);
    State end;
    const HoldLevel *level = hold_step(held, &exact->state, slice, length, sign_of(exact->side),
                                       exact->ledger.open.peak_force / mass, &end);
    if (level == NULL)
        return false;
    double impulse;
    const ArcIntegrals integrals = hold_integrals(level, &exact->state, slice, &impulse);
    take_integrals(exact, &integrals);
    exact->state = end;
    exact->offset += level->length;
    ledger_force(&exact->ledger, fabs(force(exact)));
    ledger_stretch(&exact->ledger, level->length, mass * impulse,
                   exact->plan->stops[exact->side].damping * integrals.ww);
    return true;
}

// One arc, at most `length` long, up to its end or the first event.
static Status advance(Exact *exact, double length) {
    const Motion *system = motion(exact);
    Slice slice;
    const double knot = base_cursor_slice(&exact->base, exact->sample, exact->offset, &slice);
    length = fmin(length, knot);
    exact->run->steps++;
    if (exact->phase == CONTACT && ++exact->contact_arcs > HOLD_AFTER && hold(exact, &slice, length))
        return ++exact->arcs >= WATCH_ARCS ? keep_going(exact) : STATUS_OK;
    length = fmin(length, 1 / system->rate);
    Arc arc;
    arc_make(&arc, system, &exact->state, &slice, length);
    double s;
    Side side;
    const bool is_event = find_event(exact, &arc, &s, &side);
    if (is_event)
        arc_cut(&arc, s);
    if (arc.length > 0) {
        const ArcIntegrals integrals = arc_integrals(&arc);
        take_integrals(exact, &integrals);
        if (exact->phase != FLIGHT)
            take_contact(exact, &arc, &integrals);
        exact->state = arc_end(&arc);
        exact->offset += arc.length;
        exact->still_events = 0;
        if (exact->is_leaving && exact->phase == FLIGHT)
            leave(exact);
    }
    if (is_event) {
        if (++exact->still_events > STILL_EVENTS)
            return problem_set(exact->problem, STATUS_UNSTABLE,
                               "more than %d contact events at one instant, t = %.17g s", STILL_EVENTS, now(exact));
        if (exact->phase == FLIGHT)
            touch(exact, side);
        else
            release(exact);
        TRY(ledger_status(&exact->ledger, exact->problem));
    }
    return ++exact->arcs >= WATCH_ARCS ? keep_going(exact) : STATUS_OK;
}

// The whole interval in one step, where no stop can be reached. False: it must go by arcs.
static bool fly(Exact *exact) {
    Slice slice;
    if (exact->phase != FLIGHT || exact->is_leaving || !base_cursor_interval(&exact->base, exact->sample, &slice))
        return false;
    ArcIntegrals integrals;
    integrals.ww = 0;
    const State end = flight_step(&exact->flight, &exact->state, &slice, &integrals);
    if (exact->plan->has_damper) {
        const double most = slice.omega > 0
                                ? fabs(slice.value) + fabs(slice.slope)
                                : fmax(fabs(slice.value), fabs(slice.value + slice.slope * exact->interval));
        const double sag = flight_curvature(&exact->flight, &exact->state, most) * exact->interval *
                           exact->interval / 8;
        const double right = room(exact, SIDE_RIGHT), left = room(exact, SIDE_LEFT);
        if (!(fmin(right - fmax(exact->state.r, end.r), left + fmin(exact->state.r, end.r)) > sag))
            return false;
    }
    take_integrals(exact, &integrals);
    exact->state = end;
    exact->run->steps++;
    return true;
}

// From the present sample over `length`.
static Status cross(Exact *exact, double length) {
    while (exact->offset < length) {
        const double before = exact->offset;
        TRY(advance(exact, length - exact->offset));
        if (exact->offset == before && exact->still_events == 0)
            break;  // what is left is below the clock's resolution
    }
    return STATUS_OK;
}

static void prepare(Exact *exact, Run *run, Response *response, Problem *problem) {
    const Plan *plan = run->plan;
    memset(exact, 0, sizeof *exact);
    exact->run = run;
    exact->plan = plan;
    exact->problem = problem;
    exact->interval = 1 / plan->sample_rate;
    const double total = plan->mass + plan->damper_mass;
    const double share = plan->damper_mass / total, mass = plan->mass * share;
    Motion flying = {.omega2 = plan->stiffness / plan->mass, .damping = plan->damping / plan->mass, .share = share};
    const double own = fmax(sqrt(flying.omega2), flying.damping);
    flying.rate = fmax(fmax(own, run->base->omega), 1e-300);
    exact->flying = exact->resting = flying;
    exact->resting.is_resting = true;
    for (int side = 0; side < 2 && plan->form == CONTACT_LINEAR && plan->has_damper; side++) {
        Motion *touching = &exact->touching[side];
        *touching = flying;
        touching->contact_omega2 = plan->stops[side].stiffness / mass;
        touching->contact_damping = plan->stops[side].damping / mass;
        touching->rate = fmax(own + fmax(sqrt(touching->contact_omega2), touching->contact_damping), flying.rate);
    }
    base_cursor_make(&exact->base, run->base, plan->sample_rate);
    flight_make(&exact->flight, &flying, run->base->form == BASE_SINE ? run->base->omega : 0, exact->interval);
    exact->phase = FLIGHT;
    exact->origin = ORIGIN_MIDDLE;
    exact->state = (State){plan->displacement, plan->velocity, plan->position, plan->relative_velocity};
    const EnergyState energy = energy_state(exact);
    ledger_start(&exact->ledger, response, run->impacts_most, &energy);
    recorder_start(&exact->recorder, run, response);
}

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
static Status settle(Exact *exact) {
    for (bool is_event = true; is_event;) {
        Slice slice;
        Arc arc;
        double s;
        Side side;
        (void)base_cursor_slice(&exact->base, 0, 0, &slice);
        arc_make(&arc, motion(exact), &exact->state, &slice, fmin(exact->interval, 1 / motion(exact)->rate));
        is_event = exact->phase == FLIGHT && find_event(exact, &arc, &s, &side) && s == 0;
        if (is_event)
            touch(exact, side);
    }
    return ledger_status(&exact->ledger, exact->problem);
}

static Status solve(Exact *exact) {
    const Plan *plan = exact->plan;
    TRY(settle(exact));
    Moment at = moment(exact);
    recorder_take(&exact->recorder, 0, &at, base_cursor_at(&exact->base, 0));
    ledger_peaks(&exact->ledger, &at);
    while (exact->sample + 1 < plan->count) {
        if (!fly(exact)) {
            TRY(cross(exact, exact->interval));
        } else if (++exact->arcs >= WATCH_ARCS) {
            TRY(keep_going(exact));
        }
        exact->sample++;
        exact->offset = 0;
        at = moment(exact);
        recorder_take(&exact->recorder, exact->sample, &at, base_cursor_at(&exact->base, exact->sample));
        ledger_peaks(&exact->ledger, &at);
        if (exact->sample % 64 == 0) {
            const EnergyState energy = energy_state(exact);
            ledger_balance(&exact->ledger, &energy);
        }
    }
    // The duration may end between samples.
    TRY(cross(exact, plan->duration - (double)exact->sample / plan->sample_rate));
    note_event(exact);
    TRY(keep_going(exact));
    const EnergyState energy = energy_state(exact);
    return ledger_finish(&exact->ledger, &energy, exact->problem);
}

static Status exact_run(Run *run, Response *response, Problem *problem) {
    Exact exact;
    prepare(&exact, run, response, problem);
    const Status status = solve(&exact);
    recorder_finish(&exact.recorder, response);
    free(exact.holds[SIDE_LEFT]);
    free(exact.holds[SIDE_RIGHT]);
    return status;
}

const Solver solver_exact = {
    {"exact", "each contact state propagated exactly, events located to rounding", accuracy_fields,
     sizeof(Accuracy)},
    exact_run,
};
