// The exact solver. Between events the scene is a linear system:
//
//              gap closes                    p back at 0 (linear contact)
//     FLIGHT ------------> CONTACT(side) ------------------------------> FLIGHT
//        |   gap closes                    bounce shorter than the clock
//        +--(impulse)--> u' -> -e u' ----------------------------------> RESTING(side)
//                                                 push becomes tensile -> FLIGHT
//
// What is common goes by strides (exact_stride.h): many samples of flight at once, contacts in
// closed form, each with a proof that nothing is missed. Where there is none, flight over a whole
// interval is one matrix step if a bound on the gap's curvature allows it, and everything else goes
// by arcs (arc.h), whose polynomials locate events to rounding. Time is a sample's number and an
// offset from it, so that short contacts keep their digits late in a run.
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/event_engine.h"
#include "core/solve/exact_accuracy.h"
#include "core/solve/exact_events.h"
#include "core/solve/exact_press.h"
#include "core/solve/exact_state.h"
#include "core/solve/exact_stride.h"
#include "core/solve/refine.h"
#include "core/solve/solver.h"

enum { WATCH_ARCS = 8192, STILL_EVENTS = 1000, HOLD_AFTER = 48 };

// Solver steps of an arc and of each order of it, of an event, and of a long step of contact.
static const double ARC_STEPS = 4, ARC_ORDER_STEPS = 0.7, EVENT_STEPS = 8, HOLD_STEPS = 6;

static void take_integrals(Exact *exact, const ArcIntegrals *integrals) {
    const Plan *plan = exact->plan;
    impact_log_work(&exact->ledger,
                    -plan->mass[0] * integrals->av -
                        exact->damper->mass * (integrals->av + integrals->aw),
                    plan->damping[0] * integrals->vv);
    exact_record_base(&exact->recorder, integrals->a);
}

// What a stretch of contact or rest adds to its row of the ledger.
static void take_contact(Exact *exact, const Arc *arc, const ArcIntegrals *integrals) {
    const double mass = exact_effective_mass(exact);
    double s = -1;
    const double peak =
        arc_peak_force(arc, impact_log_least_force(&exact->ledger, &exact->row) / mass, &s);
    impact_log_force(&exact->ledger, &exact->row, mass * peak);
    if (s >= 0) {
        const State middle = arc_at(arc, s);
        const double n = root_value(arc->force, arc->degree - 1, s) / (arc->length * arc->length);
        const double own = exact->flying.damping * middle.v + exact->flying.omega2 * middle.x;
        impact_log_acceleration(&exact->ledger, exact->resting.share * n - own);
    }
    impact_log_stretch(
        &exact->ledger, &exact->row, arc->length, mass * arc_impulse(arc),
        exact->phase == CONTACT ? exact->damper->stops[exact->side].damping * integrals->ww : 0);
}

// After an arc of free flight: has the gap opened beyond rounding yet? Where the arc ends by
// closing it, the speed stays.
static void leave(Exact *exact, bool is_event) {
    const double sign = exact_sign((Side)exact->origin);
    if (sign * exact->state.r < 0)
        exact->is_leaving = false;
    else if (!is_event || sign * exact->state.w < 0)
        exact->state.r = exact->state.w = 0;
}

static Status keep_going(Exact *exact) {
    const State *state = &exact->state;
    exact->arcs = 0;
    if (!isfinite(state->x) || !isfinite(state->v) || !isfinite(state->r) || !isfinite(state->w))
        return problem_set(exact->problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s",
                           exact_time(exact));
    if (exact->run->steps_max > 0 && exact->run->steps > exact->run->steps_max)
        return problem_set(exact->problem, STATUS_LIMIT, SOLVER_STOPPED "t = %.6g s of %.6g s",
                           exact->run->steps_max, exact->run->steps_max * SOLVER_STEP,
                           exact_time(exact), exact->plan->duration);
    if (!progress_advance(exact->run->progress, exact_time(exact) / exact->plan->duration))
        return problem_set(exact->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           exact_time(exact));
    return STATUS_OK;
}

// A long step of a contact that has lasted for many arcs. False: it must go by arcs.
static bool hold(Exact *exact, const Slice *slice, double length) {
    Hold *held = exact->holds[exact->side];
    if (held == NULL) {
        if ((held = exact->holds[exact->side] = calloc(1, sizeof *held)) == NULL)
            return false;
        hold_make(held, &exact->touching[exact->side], exact->run->base->omega, exact->interval);
    }
    const double mass = exact_effective_mass(exact);
    State end;
    const HoldLevel *level =
        hold_step(held, &exact->state, slice, length, exact_sign(exact->side),
                  impact_log_least_force(&exact->ledger, &exact->row) / mass, &end);
    if (level == NULL)
        return false;
    double impulse;
    const ArcIntegrals integrals = hold_integrals(level, &exact->state, slice, &impulse);
    take_integrals(exact, &integrals);
    exact->state = end;
    exact->offset += level->length;
    impact_log_force(&exact->ledger, &exact->row, fabs(exact_force(exact)));
    impact_log_stretch(&exact->ledger, &exact->row, level->length, mass * impulse,
                       exact->damper->stops[exact->side].damping * integrals.ww);
    return true;
}

// One arc, at most `length` long, up to its end or the first event.
static Status advance(Exact *exact, double length) {
    const Motion *system = exact_motion(exact);
    Slice slice;
    const double knot = base_cursor_slice(&exact->base, exact->sample, exact->offset, &slice);
    length = fmin(length, knot);
    exact->run->work.arcs++;
    if (exact->phase == CONTACT && ++exact->contact_arcs > HOLD_AFTER) {
        exact->run->steps += HOLD_STEPS;
        if (hold(exact, &slice, length))
            return ++exact->arcs >= WATCH_ARCS ? keep_going(exact) : STATUS_OK;
    }
    length = fmin(length, 1 / fmax(system->rate, slice.omega));
    Arc arc;
    arc_make(&arc, system, &exact->state, &slice, length);
    exact->run->steps += ARC_STEPS + ARC_ORDER_STEPS * (double)arc.degree;
    double s;
    Side side;
    const bool is_event = exact_find_event(exact, &arc, &s, &side);
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
            leave(exact, is_event);
    }
    if (is_event) {
        exact->events++;
        exact->run->steps += EVENT_STEPS;
        if (++exact->still_events > STILL_EVENTS)
            return problem_set(exact->problem, STATUS_UNSTABLE,
                               "more than %d contact events at one instant, t = %.17g s",
                               STILL_EVENTS, exact_time(exact));
        if (exact->phase == FLIGHT)
            exact_touch(exact, side);
        else
            exact_release(exact);
        TRY(impact_log_status(&exact->ledger, exact->problem));
    }
    return ++exact->arcs >= WATCH_ARCS ? keep_going(exact) : STATUS_OK;
}

// The whole interval in one step, where no stop can be reached. False: it must go by arcs.
static bool fly(Exact *exact) {
    Slice slice;
    if (exact->phase != FLIGHT || exact->is_leaving || exact->lanes.run != NULL ||
        !base_cursor_interval(&exact->base, exact->sample, &slice))
        return false;
    ArcIntegrals integrals;
    integrals.ww = 0;
    const State end = exact_flight_step(&exact->flight, &exact->state, &slice, &integrals);
    if (exact->has_stops) {
        exact->run->work.stop_searches++;
        const double first = fabs(slice.value),
                     last = fabs(slice.value + slice.slope * exact->interval);
        const double most = slice.omega > 0 ? first + fabs(slice.slope)
                            : first > last  ? first
                                            : last;
        const double sag = exact_flight_curvature(&exact->flight, &exact->state, most) *
                           exact->interval * exact->interval / 8;
        const double nearest = exact_room(exact, SIDE_RIGHT) - sag,
                     furthest = sag - exact_room(exact, SIDE_LEFT);
        if (!(exact->state.r < nearest && end.r < nearest && exact->state.r > furthest &&
              end.r > furthest))
            return false;
    }
    take_integrals(exact, &integrals);
    exact->state = end;
    exact->run->steps++;
    exact_count_flight(exact, 1);
    return true;
}

// From the present sample over `length`.
static Status cross(Exact *exact, double length) {
    // Less than this cannot be told from nothing: the clock's resolution at the interval's end.
    const double clock = 2 * DBL_EPSILON * length;
    while (length - exact->offset > clock) {
        const double before = exact->offset;
        const size_t events = exact->events;
        TRY(advance(exact, length - exact->offset));
        // A contact that arcs have found may go on by its closed form, even over samples, but not
        // to the last: the interval before that is the caller's.
        if (exact->lanes.run != NULL && exact->phase == CONTACT && exact->contact_arcs == 0 &&
            exact->sample + 2 < exact->plan->count)
            (void)exact_stride_press(exact, exact->plan->count - 2 - exact->sample);
        if (exact->offset == before && exact->events == events)
            return problem_set(exact->problem, STATUS_UNSTABLE,
                               "the contact is too stiff to be followed: at t = %.6g s a step of "
                               "1/%.6g s is below "
                               "the clock's resolution",
                               exact_time(exact), exact_motion(exact)->rate);
    }
    return STATUS_OK;
}

// Tables of another system are forgotten.
static void keep_tables(Exact *exact) {
    const Motion *left = &exact->touching[SIDE_LEFT], *right = &exact->touching[SIDE_RIGHT];
    const ExactKey key = {.omega2 = exact->flying.omega2,
                          .damping = exact->flying.damping,
                          .share = exact->flying.share,
                          .contact_omega2 = {left->contact_omega2, right->contact_omega2},
                          .contact_damping = {left->contact_damping, right->contact_damping},
                          .interval = exact->interval,
                          .base_omega = exact->run->base->omega};
    if (memcmp(&key, &exact->key, sizeof key) == 0)
        return;
    exact_forget(exact);
    exact->key = key;
}

static Status prepare(Exact *exact, Run *run, Response *response, Problem *problem) {
    const Plan *plan = run->plan;
    memset(exact, 0, offsetof(Exact, key));
    exact->run = run;
    exact->plan = plan;
    exact->damper = plan->dampers;
    exact->problem = problem;
    exact->interval = 1 / plan->sample_rate;
    exact->has_stops = plan->damper_count > 0 && !run->is_clear;
    const double total = plan->mass[0] + exact->damper->mass;
    const double share = exact->damper->mass / total, mass = plan->mass[0] * share;
    Motion flying = {.omega2 = plan->stiffness[0] / plan->mass[0],
                     .damping = plan->damping[0] / plan->mass[0],
                     .share = share};
    const double own = fmax(sqrt(flying.omega2), flying.damping);
    flying.rate = fmax(own, 1e-300);
    exact->flying = exact->resting = flying;
    exact->resting.is_resting = true;
    for (int side = 0; side < 2 && plan->form == CONTACT_LINEAR && exact->has_stops; side++) {
        Motion *touching = &exact->touching[side];
        *touching = flying;
        touching->contact_omega2 = exact->damper->stops[side].stiffness / mass;
        touching->contact_damping = exact->damper->stops[side].damping / mass;
        touching->rate = fmax(own + fmax(sqrt(touching->contact_omega2), touching->contact_damping),
                              flying.rate);
    }
    if (!isfinite(flying.rate) ||
        !isfinite(exact->touching[SIDE_LEFT].rate + exact->touching[SIDE_RIGHT].rate) ||
        !(share > 0 || plan->damper_count == 0) || !(share < 1))
        return problem_set(
            problem, STATUS_UNSTABLE,
            "the scene's masses and stiffnesses are too far apart for double precision");
    keep_tables(exact);
    base_cursor_make(&exact->base, run->base, plan->sample_rate);
    exact->phase = FLIGHT;
    exact->origin = ORIGIN_MIDDLE;
    exact->state = (State){plan->displacement[0], plan->velocity[0], exact->damper->position,
                           exact->damper->velocity};
    trust_start(&exact->trust, &exact->flying, exact->touching, &exact->resting, &exact->state,
                exact->damper->clearance, run->base->form == BASE_SINE, plan->duration);
    const EnergyState energy = exact_energy(exact);
    impact_log_start(&exact->ledger, response, run->impacts_max, &energy);
    exact->ledger.gain_max = IMPACT_LOG_GAIN_EXACT;
    exact_record_start(&exact->recorder, run, response);
    TRY(exact_stride_start(exact));
    if (exact->lanes.run == NULL && !exact->has_flight) {
        exact_flight_make(&exact->flight, &flying, run->base->omega, exact->interval);
        exact->has_flight = true;
    }
    return STATUS_OK;
}

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
static Status settle(Exact *exact) {
    for (bool is_event = true; is_event;) {
        Slice slice;
        Arc arc;
        double s;
        Side side;
        (void)base_cursor_slice(&exact->base, 0, 0, &slice);
        arc_make(&arc, exact_motion(exact), &exact->state, &slice,
                 fmin(exact->interval, 1 / fmax(exact_motion(exact)->rate, slice.omega)));
        is_event = exact->phase == FLIGHT && exact_find_event(exact, &arc, &s, &side) && s == 0;
        if (is_event)
            exact_touch(exact, side);
    }
    return impact_log_status(&exact->ledger, exact->problem);
}

static Status solve(Exact *exact) {
    const Plan *plan = exact->plan;
    TRY(settle(exact));
    Instant at = exact_moment(exact);
    exact_record_take(&exact->recorder, 0, &at, base_cursor_at(&exact->base, 0));
    impact_log_peaks(&exact->ledger, &at);
    while (exact->sample + 1 < plan->count) {
        const size_t most = plan->count - 1 - exact->sample;
        const size_t strode = exact_stride(exact, most < WATCH_ARCS ? most : WATCH_ARCS);
        TRY(impact_log_status(&exact->ledger, exact->problem));
        if ((exact->arcs += strode) >= WATCH_ARCS)
            TRY(keep_going(exact));
        if (strode > 0 && exact->offset == 0)
            continue;
        exact_stride_enter(exact);
        if (!fly(exact)) {
            TRY(cross(exact, exact->interval));
        } else if (++exact->arcs >= WATCH_ARCS) {
            TRY(keep_going(exact));
        }
        exact_pass_sample(exact);
        if (exact->sample % 64 == 0) {
            const EnergyState energy = exact_energy(exact);
            impact_log_balance(&exact->ledger, &energy);
        }
    }
    exact_stride_enter(exact);
    // The duration may end between samples.
    TRY(cross(exact, plan->duration - (double)exact->sample / plan->sample_rate));
    exact_note(exact);
    exact_end_phase(exact);
    trust_tell(&exact->trust, exact->ledger.response);
    TRY(keep_going(exact));
    const EnergyState energy = exact_energy(exact);
    const Status status =
        impact_log_finish(&exact->ledger, &exact->row, 1, &energy, exact->problem);
    impact_log_count(&exact->ledger, &exact->run->work);
    return status;
}

static Status start(Exact *exact, Run *run, Response *response, Problem *problem) {
    TRY(prepare(exact, run, response, problem));
    const Status status = solve(exact);
    exact_record_finish(&exact->recorder, response);
    return status;
}

// Without a workspace: all on the stack.
static __attribute__((noinline)) Status start_alone(Run *run, Response *response,
                                                    Problem *problem) {
    Exact exact;
    memset(&exact, 0, sizeof exact);
    const Status status = start(&exact, run, response, problem);
    exact_forget(&exact);
    return status;
}

static Status run_on_grid(Run *run, Response *response, Problem *problem) {
    Workspace *workspace = run->workspace;
    if (workspace == NULL)
        return start_alone(run, response, problem);
    if (workspace->exact == NULL) {
        // Its vectors want their alignment.
        const size_t room = (sizeof(Exact) + 63) / 64 * 64;
        if ((workspace->exact = aligned_alloc(64, room)) == NULL)
            return start_alone(run, response, problem);
        memset(workspace->exact, 0, sizeof(Exact));
    }
    return start(workspace->exact, run, response, problem);
}

static Status exact_run(Run *run, Response *response, Problem *problem) {
    if (!plan_is_single(run->plan) && !(run->is_clear && plan_is_single_in_flight(run->plan)))
        return event_engine_run(run, response, problem);
    // A base whose samples are further apart than the output's goes by strides once it has them.
    const size_t fine = refine_count(run->base, run->plan->sample_rate, run->plan->count);
    Workspace none = {0}, *workspace = run->workspace == NULL ? &none : run->workspace;
    double *const values = fine == 0 ? NULL : workspace_values(workspace, fine);
    if (values == NULL)
        return run_on_grid(run, response, problem);
    Base refined;
    Run own = *run;
    own.base = &refined;
    Status status = refine_base(run->base, run->plan->sample_rate, fine, values, run->progress,
                                &refined, problem);
    if (status == STATUS_OK)
        status = run_on_grid(&own, response, problem);
    run->steps = own.steps;
    run->work = own.work;
    workspace_tidy(workspace);
    workspace_clear(&none);
    return status;
}

const Solver solver_exact = {
    .kind = {"exact", "each contact state propagated exactly, events located to rounding",
             accuracy_exact_fields, sizeof(AccuracyExact)},
    .run = exact_run,
    .decide = exact_decide,
    .forget_unused = exact_forget_unused,
};
