// The motion between two events takes one of four kinds of step: whole sample intervals of flight,
// where a bound on the curvature of the gaps proves that no stop is reached (flight.c); long steps
// of a mass pressed to a stiff stop that it surely does not leave (sustained_contact.c); steps of
// contact under power laws (power_contact.c); and Taylor steps, whose polynomials locate events to
// rounding (taylor_step.c). Time is the number of a sample and an offset, so that short contacts
// keep their digits late in a run.
#include "core/solve/engine.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "core/solve/rounding_growth.h"

enum { STORM_EVENTS = 100, IDLE_STEPS = 1000 };

// A shorter step changes the state by less than the smallest double: it counts as no step.
static const double SHORTEST = 1e-250; // [s]

static const double GAIN_CONTACTS = 1e3; // energy gain allowed, over the tolerance of one contact

static const double CHECK_STEPS = 3e4; // solver steps between checks of limits and progress
static const double STEP_COST = 60;    // multiplications in a solver step

Status event_engine_check(EventEngine *engine) {
    engine->work = 0;
    return modal_state_check(&engine->state, 0);
}

static double event_engine_cost(const EventEngine *engine, StepWorkKind kind) {
    const ModalState *state = &engine->state;
    return step_work_steps(kind, state->mode_count, state->dampers, state->diagonal == NULL);
}

static Status event_engine_count_steps(EventEngine *engine, double steps) {
    engine->state.run->steps += steps;
    engine->work += steps;
    return engine->work > CHECK_STEPS ? event_engine_check(engine) : STATUS_OK;
}

static void event_engine_add_work(EventEngine *engine, const StepWork *work) {
    impact_log_work(&engine->state.impacts, work->input, work->damping);
    engine->record.base_speed += work->ground;
}

// Adds a step of contact or rest to the row of a damper. The state becomes that of a new peak.
static void event_engine_log_contact(EventEngine *engine, size_t d) {
    ModalState *state = &engine->state;
    DamperState *damper = &state->damper[d];
    const TaylorStep *arc = &engine->arc;
    double s = -1, impulse, lost;
    const double peak =
        linear_motion_largest(taylor_step_force(arc, d), arc->degree - 1,
                              impact_log_least_force(&state->impacts, &damper->row), &s);
    impact_log_force(&state->impacts, &damper->row, peak);
    if (s > 0) {
        taylor_step_state(arc, state, s);
        modal_state_forces(state);
        recorder_acceleration(state);
    }
    taylor_step_contact(arc, state, d, &impulse, &lost);
    impact_log_stretch(&state->impacts, &damper->row, arc->length, impulse, lost);
}

// Logs the step and moves to its end, where event `hit`, or none, occurs.
static void event_engine_accept(EventEngine *engine, const ContactEvent *hit) {
    ModalState *state = &engine->state;
    const TaylorStep *arc = &engine->arc;
    if (!state->is_shadow) {
        const StepWork work = taylor_step_work(arc, state);
        event_engine_add_work(engine, &work);
    }
    for (size_t d = 0; d < state->dampers && !state->is_shadow; d++)
        if (state->damper[d].row.is_open)
            event_engine_log_contact(engine, d);
    if (engine->linearised != NULL)
        linearised_motion_step(engine->linearised, state, arc);
    taylor_step_state(arc, state, 1);
    state->offset += arc->length;
    state->events_at_instant = 0;
    state->chatter_time += arc->length;
    if (state->chatter_time > modal_state_clock(state)) {
        state->chatter_events = 0;
        state->chatter_time = 0;
    }
    for (size_t d = 0; d < state->dampers; d++) {
        DamperState *damper = &state->damper[d];
        damper->just_begun = false;
        if (damper->zero_gap_terms > 0)
            contact_event_leave(damper, hit != NULL && hit->damper == d);
    }
}

// `growth` is that of a single mass on a single storey.
static Status event_engine_apply(EventEngine *engine, const ContactEvent *event) {
    ModalState *state = &engine->state;
    RoundingGrowth *growth = engine->growth;
    if (engine->linearised != NULL)
        linearised_motion_begin_event(engine->linearised, state, event);
    if (growth == NULL) {
        TRY(contact_event_apply(state, event));
        if (engine->linearised != NULL)
            linearised_motion_end_event(engine->linearised, state, event);
        return STATUS_OK;
    }
    const DamperState *damper = &state->damper[0];
    const ContactPhase phase = damper->phase;
    const double shape = state->modes->shapes[0];
    const State before = {state->q[0] * shape, state->p[0] * shape, damper->r, damper->w};
    rounding_growth_end_phase(growth, phase, damper->side, modal_state_time(state), &before,
                              state->impacts.response->peaks.displacement);
    const Status status = contact_event_apply(state, event);
    if (phase == PHASE_FLIGHT && state->plan->form == CONTACT_IMPULSIVE &&
        damper->plan->clearance > 0)
        rounding_growth_bounce(growth, damper->contact.restitution, before.w,
                               state->diagonal[0] * before.v + state->omega2[0] * before.x);
    if (damper->phase == PHASE_RESTING)
        rounding_growth_stick(growth);
    return status;
}

// The longest Taylor step. A half-sine of the base is fast only while it lasts. Longer ones, of
// degree 26 instead of 21, take two thirds of the time where nothing else is made of the step.
static double event_engine_arc_max(const EventEngine *engine, const Slice *slice) {
    return (engine->linearised != NULL ? 2 : 1) /
           fmax(modal_state_rate(&engine->state), slice->omega);
}

// One step of contact under a power law, at most `length` long.
static Status event_engine_step_power(EventEngine *engine, const Slice *slice, double length) {
    ModalState *state = &engine->state;
    PowerContactStep step;
    if (engine->linearised != NULL)
        linearised_motion_begin_step(engine->linearised, state);
    power_contact_step(&engine->power, slice, length, &step);
    if (engine->linearised != NULL)
        linearised_motion_end_step(engine->linearised, state, step.length);
    event_engine_add_work(engine, &step.work);
    const double before = state->offset;
    state->offset += step.length;
    state->base_acceleration = slice_at(slice, step.length);
    state->events_at_instant = 0;
    // Only so many steps in a row may be too short for the clock.
    engine->idle = state->offset > before ? 0 : engine->idle + 1;
    state->events += engine->idle > 0 && engine->idle < IDLE_STEPS;
    if (step.is_event)
        TRY(event_engine_apply(engine, &step.event));
    else
        recorder_update(state);
    state->run->work.steps++;
    return event_engine_count_steps(engine, step.cost / STEP_COST);
}

// A long step of contact. False: it takes Taylor steps.
static bool event_engine_step_sustained(EventEngine *engine, const Slice *slice, double length) {
    ModalState *state = &engine->state;
    StepWork work;
    if ((slice->omega > 0 && state->base_omega == 0) || engine->linearised != NULL)
        return false; // the tables have no such base, or only Taylor steps are followed
    const double taken = sustained_contact_step(&engine->sustained, state, slice, length,
                                                state->is_shadow ? NULL : &work);
    if (taken == 0)
        return false;
    if (!state->is_shadow)
        event_engine_add_work(engine, &work);
    state->offset += taken;
    state->base_acceleration = slice_at(slice, taken);
    return true;
}

// Chatter at one instant is rounding noise, for example between stops without clearance on a storey
// that hardly moves yet. Contact events are suppressed for a time that doubles until the motion
// resolves them. (The impulse law ends such series itself.)
static bool event_engine_is_suppressed(ModalState *state) {
    if (state->chatter_events < STORM_EVENTS * state->dampers ||
        state->plan->form == CONTACT_IMPULSIVE)
        return false;
    const double now = modal_state_time(state);
    const bool goes_on = now - state->suppressed_at <= 4 * state->suppress_time;
    state->suppress_time = fmax(goes_on ? 2 * state->suppress_time : 0, modal_state_clock(state));
    state->suppressed_at = now;
    return true;
}

// The run and what is linearised beside it.
static double event_engine_motions(const EventEngine *engine) {
    return 1 + (engine->linearised != NULL ? (double)engine->linearised->count : 0);
}

// One step of at most `length`, up to the first event.
static Status event_engine_advance(EventEngine *engine, double length) {
    ModalState *state = &engine->state;
    TaylorStep *arc = &engine->arc;
    Slice slice;
    const double knot = base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    state->base_acceleration = slice.value;
    if (power_contact_is_active(&engine->power))
        return event_engine_step_power(engine, &slice, fmin(length, knot));
    if (event_engine_step_sustained(engine, &slice, fmin(length, knot)))
        return event_engine_count_steps(engine, event_engine_cost(engine, STEP_WORK_SUSTAINED));
    if (engine->sustained.lacks_memory) // other steps would round differently
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    const bool is_suppressed = event_engine_is_suppressed(state);
    const double max = fmin(fmin(length, knot), is_suppressed ? state->suppress_time : INFINITY);
    taylor_step_make(arc, state, &slice, fmin(max, event_engine_arc_max(engine, &slice)));
    state->run->work.arcs++;
    ContactEvent event;
    const bool is_event = contact_event_find(state, arc, &event) &&
                          !(is_suppressed && event.s * arc->length <= modal_state_clock(state));
    if (is_event)
        taylor_step_cut(arc, state, event.s * arc->length < SHORTEST ? 0 : event.s);
    if (arc->length > 0)
        event_engine_accept(engine, is_event ? &event : NULL);
    if (is_event)
        TRY(event_engine_apply(engine, &event));
    return event_engine_count_steps(
        engine, event_engine_cost(engine, STEP_WORK_ARC) * event_engine_motions(engine) +
                    (is_event ? event_engine_cost(engine, STEP_WORK_EVENT) : 0));
}

Status event_engine_cross(EventEngine *engine, double length) {
    ModalState *state = &engine->state;
    // The clock's resolution at the end of the interval.
    const double clock = 2 * DBL_EPSILON * length;
    while (length - state->offset > clock) {
        const double before = state->offset;
        const size_t events = state->events;
        TRY(event_engine_advance(engine, length - state->offset));
        if (state->offset == before && state->events == events)
            return problem_set(state->problem, STATUS_UNSTABLE,
                               "the contact is too stiff to be followed: at t = %.6g s a step of "
                               "1/%.6g s is below the clock's resolution",
                               modal_state_time(state), modal_state_rate(state));
    }
    return STATUS_OK;
}

// a_g over whole intervals from the present sample on. Returns the number of those without a kink.
static size_t event_engine_find_slices(const ModalState *state, size_t count, Slice *slices) {
    size_t found = 0;
    for (; found < count; found++) {
        if (found > 0 && state->base.base->form == BASE_SINE) {
            const Slice *last = &slices[found - 1];
            slices[found] = (Slice){
                last->value * state->base_rotation[0] + last->slope * state->base_rotation[1],
                last->slope * state->base_rotation[0] - last->value * state->base_rotation[1],
                last->omega};
        } else if (!base_cursor_interval(&state->base, state->sample + found, &slices[found]))
            break;
    }
    return found;
}

// Moves over whole intervals of flight, up to sample `until`, and records them. Returns their
// number.
static size_t event_engine_fly(EventEngine *engine, size_t until) {
    ModalState *state = &engine->state;
    Recorder *record = &engine->record;
    Slice slices[FLIGHT_BUFFER_MAX];
    StepWork work;
    for (size_t d = 0; d < state->dampers; d++)
        if (state->damper[d].phase != PHASE_FLIGHT || state->damper[d].zero_gap_terms > 0)
            return 0;
    size_t count = until - state->sample;
    if (count > FLIGHT_BUFFER_MAX)
        count = FLIGHT_BUFFER_MAX;
    // Statistics begin at the first row of a buffer.
    if (state->sample + 1 < record->statistics_start &&
        state->sample + count >= record->statistics_start)
        count = record->statistics_start - 1 - state->sample;
    count = engine->flight.length == 0 ? 0 : event_engine_find_slices(state, count, slices);
    state->run->work.stop_searches += count > 0 && state->has_stops;
    if (count > 0)
        count = flight_run(&engine->flight, &record->buffer, state, slices, count,
                           state->is_shadow ? NULL : &work);
    state->sample += count;
    if (count == 0 || state->is_shadow)
        return count;
    WorkCounters *done = &state->run->work;
    *(state->base.base->form == BASE_STILL ? &done->unforced_samples : &done->flight_samples) +=
        count;
    done->mode_samples += count * state->mode_count;
    impact_log_work(&state->impacts, work.input, work.damping);
    recorder_flight(record, state, count);
    return count;
}

Status event_engine_settle(EventEngine *engine) {
    ModalState *state = &engine->state;
    for (bool is_event = true; is_event;) {
        Slice slice;
        ContactEvent event;
        (void)base_cursor_slice(&state->base, 0, 0, &slice);
        taylor_step_make(&engine->arc, state, &slice,
                         fmin(state->interval, event_engine_arc_max(engine, &slice)));
        is_event = contact_event_find(state, &engine->arc, &event) && event.s == 0 &&
                   state->damper[event.damper].phase == PHASE_FLIGHT;
        if (is_event)
            TRY(event_engine_apply(engine, &event));
    }
    return STATUS_OK;
}

static void event_engine_balance(ModalState *state) {
    if (state->is_shadow || state->sample % 64 != 0)
        return;
    const EnergyState energy = modal_state_energy(state);
    impact_log_balance(&state->impacts, &energy);
}

// Stores the modes of the last `flown` samples, or of the present one.
static void event_engine_track(EventEngine *engine, size_t flown) {
    const ModalState *state = &engine->state;
    const FlightBuffer *buffer = &engine->record.buffer;
    for (size_t k = 1; k <= (flown > 0 ? flown : 1); k++) {
        const size_t sample = flown > 0 ? state->sample - flown + k : state->sample;
        memcpy(engine->track + (sample - 1) % FLIGHT_BUFFER_MAX * state->padded,
               flown > 0 ? buffer->q + k * state->padded : state->q,
               state->mode_count * sizeof *engine->track);
    }
}

Status event_engine_finish_interval(EventEngine *engine) {
    ModalState *state = &engine->state;
    TRY(event_engine_cross(engine, state->interval));
    state->run->work.mode_samples += state->mode_count;
    state->sample++;
    state->offset = 0;
    recorder_sample(&engine->record, state);
    return STATUS_OK;
}

Status event_engine_step(EventEngine *engine, size_t until) {
    ModalState *state = &engine->state;
    const size_t flown = event_engine_fly(engine, until);
    if (flown > 0) {
        TRY(event_engine_count_steps(engine,
                                     (double)flown * event_engine_cost(engine, STEP_WORK_FLIGHT)));
    } else {
        TRY(event_engine_finish_interval(engine));
    }
    if (engine->track != NULL)
        event_engine_track(engine, flown);
    event_engine_balance(state);
    return STATUS_OK;
}

Status event_engine_make(EventEngine *engine, Run *run, double tolerance, Response *response,
                         Problem *problem) {
    ModalState *state = &engine->state;
    TRY(modal_state_make(state, run, problem));
    TRY(taylor_step_allocate(&engine->arc, state, problem));
    if (engine->linearised == NULL) { // whose steps have no use for these tables
        TRY(flight_make(&engine->flight, state, problem));
        TRY(sustained_contact_make(&engine->sustained, state, problem));
    }
    TRY(power_contact_make(&engine->power, state, tolerance, problem));
    TRY(recorder_start(&engine->record, state, response, problem));
    const EnergyState energy = modal_state_energy(state);
    impact_log_start(&state->impacts, response, run->impacts_max, &energy);
    // The errors of many contacts.
    state->impacts.gain_max = fmax(
        IMPACT_LOG_GAIN_EXACT, tolerance > POWER_CONTACT_TOLERANCE ? GAIN_CONTACTS * tolerance : 0);
    return STATUS_OK;
}

Status event_engine_shadow(EventEngine *engine, const EventEngine *of, Run *run, double tolerance,
                           Response *response) {
    ModalState *state = &engine->state;
    TRY(modal_state_make(state, run, NULL));
    TRY(power_contact_make(&engine->power, state, tolerance, NULL));
    engine->arc = of->arc;
    engine->flight = of->flight;
    engine->sustained = of->sustained;
    engine->record.buffer = of->record.buffer;
    state->is_shadow = true;
    const EnergyState energy = modal_state_energy(state);
    impact_log_start(&state->impacts, response, run->impacts_max, &energy);
    return STATUS_OK;
}

void event_engine_clear(EventEngine *engine) {
    recorder_clear(&engine->record);
    flight_clear(&engine->flight);
    sustained_contact_clear(&engine->sustained);
    power_contact_clear(&engine->power);
    taylor_step_clear(&engine->arc);
    modal_state_clear(&engine->state);
}
