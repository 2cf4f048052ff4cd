// The general engine's stepping. Flight of all masses over a whole sample interval is one step
// where bounds on the gaps' curvature prove that no stop can be reached (frame_flight.h);
// a mass pressed to a stiff stop that it surely does not leave has long steps too (frame_press.h);
// everything else goes by arcs (frame_arc.h), whose polynomials locate events to rounding. Time is
// a sample's number and an offset from it, so that short contacts keep their digits late in a run.
//
// How far the run can be trusted is told by a neighbour: the same run a few roundings away, sample
// by sample beside it until the two have parted.
#include "core/solve/frame.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/frame_arc.h"
#include "core/solve/frame_events.h"
#include "core/solve/frame_flight.h"
#include "core/solve/frame_ode.h"
#include "core/solve/frame_press.h"
#include "core/solve/frame_record.h"
#include "core/solve/frame_state.h"

enum { STILL_EVENTS = 1000, FLIGHT_WORK = 8, PRESS_WORK = 64, PRESS_STEPS = 32 };

enum { NUDGE_SAMPLES = 16 };
static const double NUDGE = 4 * DBL_EPSILON, POWER_NUDGE = 1e-12; // an integrated contact's error
static const double PARTED = 0.01; // of the largest displacement: what comes then is chance

// An arc this short would lose its speeds' digits below the smallest doubles: it takes no time.
static const double SHORTEST = 1e-250; // [s]

static const double WATCH_WORK = 1e6; // multiplications, about, between looks at the watch

typedef struct Engine {
    Frame frame;
    FrameArc arc;
    FrameFlight flight;
    FramePress pressing;
    FrameOde ode;
    FrameRecord record;
    double work; // since the watch was asked
} Engine;

static Status keep_going(Engine *engine) {
    const Frame *frame = &engine->frame;
    engine->work = 0;
    const EnergyState energy = frame_energy(frame);
    double sum = energy.kinetic + energy.strain;
    for (size_t i = 0; i < frame->storeys; i++)
        sum += fabs(frame->q[i]);
    for (size_t d = 0; d < frame->dampers; d++)
        sum += fabs(frame->damper[d].r);
    if (!isfinite(sum))
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "the motion left what double precision can hold at t = %.6g s",
                           frame_time(frame));
    if (frame->run->steps_most > 0 && frame->run->steps > frame->run->steps_most)
        return problem_set(frame->problem, STATUS_LIMIT,
                           "more than %.0f solver steps; stopped at t = %.6g s of %.6g s",
                           frame->run->steps_most, frame_time(frame), frame->plan->duration);
    if (!watch_advance(frame->run->watch, frame_time(frame) / frame->plan->duration))
        return problem_set(frame->problem, STATUS_CANCELLED, "cancelled at t = %.6g s",
                           frame_time(frame));
    return STATUS_OK;
}

// Counts a step of about `each` multiplications per mode. In steps of the single engine it is one
// for each mode and damper, as simulation_cost foresees.
static Status count_step(Engine *engine, double each) {
    const Frame *frame = &engine->frame;
    const double n = (double)frame->storeys, m = (double)frame->dampers;
    const double pairs = frame->diagonal != NULL ? 0 : n * n;
    frame->run->steps += n * (1 + m) + pairs / 4;
    engine->work += each * (n * (1 + m) + pairs);
    return engine->work > WATCH_WORK ? keep_going(engine) : STATUS_OK;
}

static void take_work(Engine *engine, const FrameWork *work) {
    ledger_work(&engine->frame.ledger, work->input, work->damping);
    engine->record.base_speed += work->ground;
}

// What a stretch of contact or rest adds to a damper's row; the state becomes that of a new peak.
static void take_contact(Engine *engine, size_t d) {
    Frame *frame = &engine->frame;
    FrameDamper *damper = &frame->damper[d];
    const FrameArc *arc = &engine->arc;
    double s = -1, impulse, lost;
    const double peak =
        arc_largest(frame_arc_force(arc, d), arc->degree - 1, damper->row.impact.peak_force, &s);
    ledger_force(&frame->ledger, &damper->row, peak);
    if (s > 0) {
        frame_arc_state(arc, frame, s);
        frame_feel(frame);
        frame_record_acceleration(frame);
    }
    frame_arc_contact(arc, frame, d, &impulse, &lost);
    ledger_stretch(&frame->ledger, &damper->row, arc->length, impulse, lost);
}

// After an arc: has the gap of a mass released from rest opened beyond rounding yet? Where the arc
// ends by closing it, the speed stays.
static void leave(FrameDamper *damper, bool is_hit) {
    const double sign = frame_sign((Side)damper->origin);
    if (sign * damper->r < 0)
        damper->leaving = 0;
    else if (!is_hit || sign * damper->w < 0)
        damper->r = damper->w = 0;
}

// Takes what lies on the arc and moves to its end, where `hit` (or none) has its event.
static void pass(Engine *engine, const FrameEvent *hit) {
    Frame *frame = &engine->frame;
    const FrameArc *arc = &engine->arc;
    if (!frame->is_shadow) {
        const FrameWork work = frame_arc_work(arc, frame);
        take_work(engine, &work);
    }
    for (size_t d = 0; d < frame->dampers && !frame->is_shadow; d++)
        if (frame->damper[d].row.is_open)
            take_contact(engine, d);
    frame_arc_state(arc, frame, 1);
    frame->offset += arc->length;
    frame->still_events = 0;
    for (size_t d = 0; d < frame->dampers; d++) {
        FrameDamper *damper = &frame->damper[d];
        damper->is_fresh = false;
        if (damper->leaving > 0)
            leave(damper, hit != NULL && hit->damper == d);
    }
}

static Status happen(Frame *frame, const FrameEvent *event) {
    const size_t most = STILL_EVENTS * frame->dampers;
    frame->events++;
    if (++frame->still_events > most)
        return problem_set(frame->problem, STATUS_UNSTABLE,
                           "more than %zu contact events at one instant, t = %.17g s", most,
                           frame_time(frame));
    frame_happen(frame, event);
    return ledger_status(&frame->ledger, frame->problem);
}

// The longest arc: a half-sine of the base is fast only while it lasts.
static double arc_most(const Frame *frame, const Slice *slice) {
    return 1 / fmax(frame_rate(frame), slice->omega);
}

// One step of contact under a power law, at most `length` long.
static Status press(Engine *engine, const Slice *slice, double length) {
    Frame *frame = &engine->frame;
    FrameOdeStep step;
    TRY(frame_ode_step(&engine->ode, slice, length, &step, frame->problem));
    ledger_work(&frame->ledger, step.input, step.damping);
    engine->record.base_speed += step.ground;
    frame->offset += step.length;
    frame->ground = slice_at(slice, step.length);
    frame->still_events = 0;
    frame_record_note(frame);
    if (step.is_event)
        TRY(happen(frame, &step.event));
    frame->run->steps += PRESS_STEPS; // it takes as long as so many arcs
    return count_step(engine, PRESS_WORK);
}

// A long step of contact. False: it must go by arcs.
static bool hold(Engine *engine, const Slice *slice, double length) {
    Frame *frame = &engine->frame;
    FrameWork work;
    if (slice->omega > 0 && frame->turning == 0)
        return false; // its steps know no such base
    const double taken =
        frame_press_step(&engine->pressing, frame, slice, length, frame->is_shadow ? NULL : &work);
    if (taken == 0)
        return false;
    if (!frame->is_shadow)
        take_work(engine, &work);
    frame->offset += taken;
    frame->ground = slice_at(slice, taken);
    return true;
}

// One arc, at most `length` long, up to its end or the first event.
static Status advance(Engine *engine, double length) {
    Frame *frame = &engine->frame;
    FrameArc *arc = &engine->arc;
    Slice slice;
    const double knot = base_cursor_slice(&frame->base, frame->sample, frame->offset, &slice);
    frame->ground = slice.value;
    if (frame_ode_serves(&engine->ode))
        return press(engine, &slice, fmin(length, knot));
    if (hold(engine, &slice, fmin(length, knot)))
        return count_step(engine, PRESS_WORK);
    frame_arc_make(arc, frame, &slice, fmin(fmin(length, knot), arc_most(frame, &slice)));
    FrameEvent event;
    const bool is_event = frame_find_event(frame, arc, &event);
    if (is_event)
        frame_arc_cut(arc, frame, event.s * arc->length < SHORTEST ? 0 : event.s);
    if (arc->length > 0)
        pass(engine, is_event ? &event : NULL);
    if (is_event)
        TRY(happen(frame, &event));
    return count_step(engine, 2 * (double)arc->degree);
}

// From the present sample over `length`.
static Status cross(Engine *engine, double length) {
    Frame *frame = &engine->frame;
    // Less than this cannot be told from nothing: the clock's resolution at the interval's end.
    const double clock = 2 * DBL_EPSILON * length;
    while (length - frame->offset > clock) {
        const double before = frame->offset;
        const size_t events = frame->events;
        TRY(advance(engine, length - frame->offset));
        if (frame->offset == before && frame->events == events)
            return problem_set(frame->problem, STATUS_UNSTABLE,
                               "the contact is too stiff to be followed: at t = %.6g s a step of "
                               "1/%.6g s is below the clock's resolution",
                               frame_time(frame), frame_rate(frame));
    }
    return STATUS_OK;
}

// The whole interval in one step. False: it must go by arcs.
static bool fly(Engine *engine) {
    Frame *frame = &engine->frame;
    Slice slice;
    FrameWork work;
    if (engine->flight.length == 0 || !base_cursor_interval(&frame->base, frame->sample, &slice))
        return false;
    for (size_t d = 0; d < frame->dampers; d++)
        if (frame->damper[d].phase != FRAME_FLIGHT || frame->damper[d].leaving > 0)
            return false;
    if (!frame_flight_step(&engine->flight, frame, &slice, frame->is_shadow ? NULL : &work))
        return false;
    if (!frame->is_shadow)
        take_work(engine, &work);
    return true;
}

// A mass that starts on a stop may touch it at t = 0; the first sample shows the moment after.
static Status settle(Engine *engine) {
    Frame *frame = &engine->frame;
    for (bool is_event = true; is_event;) {
        Slice slice;
        FrameEvent event;
        (void)base_cursor_slice(&frame->base, 0, 0, &slice);
        frame_arc_make(&engine->arc, frame, &slice, fmin(frame->interval, arc_most(frame, &slice)));
        is_event = frame_find_event(frame, &engine->arc, &event) && event.s == 0 &&
                   frame->damper[event.damper].phase == FRAME_FLIGHT;
        if (is_event)
            TRY(happen(frame, &event));
    }
    return STATUS_OK;
}

static void take_sample(Engine *engine) {
    Frame *frame = &engine->frame;
    if (frame->is_shadow)
        return;
    frame->ground = base_cursor_at(&frame->base, frame->sample);
    frame_feel(frame);
    if (frame->sample == engine->record.statistics_start && frame->sample > 0)
        frame_record_forget(frame);
    frame_record_take(&engine->record, frame);
    frame_record_peaks(frame);
    if (frame->sample % 64 == 0) {
        const EnergyState energy = frame_energy(frame);
        ledger_balance(&frame->ledger, &energy);
    }
}

static Status step(Engine *engine) {
    Frame *frame = &engine->frame;
    if (fly(engine))
        TRY(count_step(engine, FLIGHT_WORK));
    else
        TRY(cross(engine, frame->interval));
    frame->sample++;
    frame->offset = 0;
    take_sample(engine);
    return STATUS_OK;
}

static Status prepare(Engine *engine, Run *run, Response *response, Problem *problem) {
    Frame *frame = &engine->frame;
    TRY(frame_make(frame, run, problem));
    TRY(frame_arc_room(&engine->arc, frame, problem));
    TRY(frame_flight_make(&engine->flight, frame, problem));
    TRY(frame_press_make(&engine->pressing, frame, problem));
    TRY(frame_ode_make(&engine->ode, frame, problem));
    TRY(frame_record_start(&engine->record, frame, response, problem));
    const EnergyState energy = frame_energy(frame);
    ledger_start(&frame->ledger, response, run->impacts_most, &energy);
    frame->ledger.gain_most = LEDGER_GAIN_EXACT;
    return STATUS_OK;
}

// A run of its own that shares what the other has made once, and of which only the motion matters.
static Status prepare_shadow(Engine *engine, const Engine *of, Run *run, Response *response) {
    Frame *frame = &engine->frame;
    TRY(frame_make(frame, run, NULL));
    TRY(frame_ode_make(&engine->ode, frame, NULL));
    engine->arc = of->arc;
    engine->flight = of->flight;
    engine->pressing = of->pressing;
    frame->is_shadow = true;
    const EnergyState energy = frame_energy(frame);
    ledger_start(&frame->ledger, response, run->impacts_most, &energy);
    return STATUS_OK;
}

typedef struct Neighbour {
    Engine engine;
    Run run;
    Response response;
    bool is_spent;         // parted, or failed: nothing is left to follow
    bool is_known;         // never failed
    double largest, worst; // displacement, and difference of displacements, so far [m]
    double horizon;        // [s]; NAN: not reached
    double *apart;         // scratch, of all modes
} Neighbour;

static double nudge_of(const Frame *frame) {
    return frame->plan->form == CONTACT_POWER ? POWER_NUDGE : NUDGE;
}

// Some roundings more, of either sign.
static void nudge(Frame *frame) {
    const double by = nudge_of(frame);
    for (size_t i = 0; i < frame->storeys; i++) {
        const double sign = (frame->sample / NUDGE_SAMPLES + i) % 2 == 0 ? 1 : -1;
        frame->q[i] *= 1 + sign * by;
        frame->p[i] *= 1 - sign * by;
    }
}

static void compare(Neighbour *neighbour, const Frame *frame) {
    const size_t n = frame->storeys;
    double *apart = neighbour->apart, bound = 0, difference = 0;
    for (size_t i = 0; i < n; i++) {
        apart[i] = frame->q[i] - neighbour->engine.frame.q[i];
        bound += frame->widest[i] * fabs(apart[i]);
    }
    neighbour->largest = fmax(neighbour->largest, frame->ledger.response->peaks.displacement);
    if (bound <= neighbour->worst)
        return;
    for (size_t j = 0; j < n; j++)
        difference = fmax(difference, fabs(frame_dot(frame->modes->shapes + j * n, apart, n)));
    neighbour->worst = fmax(neighbour->worst, difference);
    if (isnan(neighbour->horizon) && !(difference <= RESPONSE_PARTING * neighbour->largest))
        neighbour->horizon = (double)(frame->sample - 1) / frame->plan->sample_rate;
    neighbour->is_spent = difference > PARTED * neighbour->largest;
}

static void step_neighbour(Neighbour *neighbour, const Frame *frame) {
    if (neighbour->is_spent)
        return;
    if (frame->sample % NUDGE_SAMPLES == 0)
        nudge(&neighbour->engine.frame);
    if (step(&neighbour->engine) == STATUS_OK)
        compare(neighbour, frame);
    else
        neighbour->is_spent = true, neighbour->is_known = false;
}

static void start_neighbour(Neighbour *neighbour, const Engine *engine) {
    const Frame *frame = &engine->frame;
    memset(neighbour, 0, sizeof *neighbour);
    neighbour->horizon = NAN;
    neighbour->is_known = neighbour->is_spent = true;
    if (frame->dampers == 0)
        return;
    neighbour->run = (Run){.plan = frame->plan,
                           .base = frame->run->base,
                           .impacts_most = frame->run->impacts_most,
                           .steps_most = frame->run->steps_most};
    Frame *own = &neighbour->engine.frame;
    neighbour->apart = malloc(frame->storeys * sizeof *neighbour->apart);
    neighbour->is_known =
        neighbour->apart != NULL && prepare_shadow(&neighbour->engine, engine, &neighbour->run,
                                                   &neighbour->response) == STATUS_OK;
    if (!neighbour->is_known)
        return;
    nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * nudge_of(own) * own->damper[d].plan->clearance;
    neighbour->is_known = settle(&neighbour->engine) == STATUS_OK;
    neighbour->is_spent = !neighbour->is_known;
}

static void tell(const Neighbour *neighbour, const Frame *frame, Response *response) {
    const double size = fmax(neighbour->largest, response->peaks.displacement);
    // A frequency's own rounding turns the phase; a pulse is over before it matters.
    const Base *base = frame->run->base;
    const double rate = fmax(frame->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * frame->plan->duration);
    const double error = size > 0 ? fmax(neighbour->worst / size, drift) : 0;
    response->has_trust = neighbour->is_known;
    response->error_estimate = error < PARTED ? error : 1;
    response->trust_horizon = neighbour->horizon;
}

static void clear(Engine *engine) {
    frame_record_clear(&engine->record);
    frame_flight_clear(&engine->flight);
    frame_press_clear(&engine->pressing);
    frame_ode_clear(&engine->ode);
    frame_arc_clear(&engine->arc);
    frame_clear(&engine->frame);
}

static void clear_neighbour(Neighbour *neighbour) {
    frame_ode_clear(&neighbour->engine.ode);
    frame_clear(&neighbour->engine.frame);
    response_clear(&neighbour->response);
    free(neighbour->apart);
    free(neighbour);
}

static Status solve(Engine *engine, Neighbour *neighbour) {
    Frame *frame = &engine->frame;
    const Plan *plan = frame->plan;
    TRY(settle(engine));
    take_sample(engine);
    start_neighbour(neighbour, engine);
    while (frame->sample + 1 < plan->count) {
        TRY(step(engine));
        step_neighbour(neighbour, frame);
    }
    tell(neighbour, frame, frame->ledger.response);
    // The duration may end between samples.
    TRY(cross(engine, plan->duration - (double)frame->sample / plan->sample_rate));
    frame_record_note(frame);
    TRY(keep_going(engine));
    LedgerRow *rows = calloc(frame->dampers + 1, sizeof *rows);
    if (rows == NULL)
        return problem_set(frame->problem, STATUS_NO_MEMORY, "no memory for the list of impacts");
    for (size_t d = 0; d < frame->dampers; d++)
        rows[d] = frame->damper[d].row;
    const EnergyState energy = frame_energy(frame);
    const Status status =
        ledger_finish(&frame->ledger, rows, frame->dampers, &energy, frame->problem);
    free(rows);
    return status;
}

Status frame_run(Run *run, Response *response, Problem *problem) {
    Engine engine;
    Neighbour *neighbour = calloc(1, sizeof *neighbour);
    if (neighbour == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    memset(&engine, 0, sizeof engine);
    Status status = prepare(&engine, run, response, problem);
    if (status == STATUS_OK)
        status = solve(&engine, neighbour);
    if (engine.record.block != NULL)
        frame_record_finish(&engine.record, &engine.frame, response);
    clear(&engine);
    clear_neighbour(neighbour);
    return status;
}
