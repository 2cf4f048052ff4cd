// The exact solver: between events the scene is a linear system, which is propagated exactly;
// events are located to rounding. Most scenes of one storey with one mass are run by single_mass.c
// (single_mass_serves), all others by the event engine, with a companion run beside it from which
// error estimate and predictability horizon follow.
#include "core/solve/exact.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/solve/engine.h"
#include "core/solve/single_mass.h"

enum { COMPANION_SAMPLES = FLIGHT_BUFFER_MAX };
static const double NUDGE = 4 * DBL_EPSILON;
static const double PARTED =
    0.01; // of the largest displacement: beyond it the difference no longer grows
static const double FINER = 30;  // tolerance of the run over that of the companion
static const double CAUTION = 3; // error of the run over the difference of two stepped runs

// A second run that differs by a few roundings follows the first one, COMPANION_SAMPLES behind,
// until the two have parted.
typedef struct Companion {
    EventEngine engine;
    Run run;
    Response response;
    bool is_finished;      // parted or failed
    Status status;         // of its engine
    bool is_stepped;       // contacts have a tolerance, and this run a finer one
    double largest, worst; // displacement, and difference of displacements, so far [m]
    double horizon;        // [s]; NAN: not reached
    double *tracks;        // of both runs, where every sample is compared
} Companion;

double exact_tolerance(const Accuracy *accuracy) {
    const double asked =
        accuracy == NULL ? (double)NAN : ((const AccuracyExact *)(const void *)accuracy)->tolerance;
    return asked > POWER_CONTACT_TOLERANCE ? asked : POWER_CONTACT_TOLERANCE;
}

// Linear contacts and impulses have closed forms.
static void exact_forget_unused(Accuracy *accuracy, bool has_power_law) {
    if (!has_power_law)
        ((AccuracyExact *)(void *)accuracy)->tolerance = (double)NAN;
}

static Status exact_decide(const Solver *solver, const Accuracy *accuracy, double base_interval,
                           Plan *plan, Problem *problem) {
    (void)solver, (void)base_interval, (void)problem;
    if (plan->form != CONTACT_POWER || plan->damper_count == 0)
        return STATUS_OK;
    const double tolerance = exact_tolerance(accuracy);
    const bool is_asked = tolerance > POWER_CONTACT_TOLERANCE;
    return decisions_add(&plan->report.decisions, "tolerance", is_asked ? "asked" : "rounding",
                         tolerance, NULL,
                         is_asked ? "relative error of a contact at its end; flight is exact, and "
                                    "events are located as accurately as the contacts"
                                  : "contacts are exact to rounding, since no tolerance is "
                                    "requested");
}

// clang-format off
const Field accuracy_exact_fields[] = {
    FIELD_BASE(AccuracyExact, accuracy, accuracy_fields),
    FIELD_REAL(AccuracyExact, tolerance, NULL, WITHIN(1e-15, 1e-1), OPTIONAL, "relative error of a contact under a power law at its end; if absent that of rounding; without effect on other laws, whose contacts have closed forms"),
    FIELD_END
};
// clang-format on

// Changes the modes by a few roundings of either sign.
static void exact_companion_nudge(ModalState *state) {
    const double by = NUDGE;
    for (size_t i = 0; i < state->mode_count; i++) {
        const double sign = (state->sample / COMPANION_SAMPLES + i) % 2 == 0 ? 1 : -1;
        state->q[i] *= 1 + sign * by;
        state->p[i] *= 1 - sign * by;
    }
}

// Error of the run over the difference of the two runs.
static double exact_companion_factor(const Companion *companion) {
    return companion->is_stepped ? CAUTION : 1;
}

static void exact_companion_compare(Companion *companion, const ModalState *state, size_t before) {
    companion->largest = fmax(companion->largest, state->impacts.response->peaks.displacement);
    if (companion->is_stepped) {
        // This error oscillates with the motion, so every sample is compared.
        const double *run = companion->tracks, *near = run + COMPANION_SAMPLES * state->padded;
        for (size_t k = 0; k < state->sample - before; k++)
            companion->worst = modal_state_difference(state, run + k * state->padded,
                                                      near + k * state->padded, companion->worst);
    } else {
        companion->worst =
            modal_state_difference(state, state->q, companion->engine.state.q, companion->worst);
    }
    const double error = exact_companion_factor(companion) * companion->worst;
    if (isnan(companion->horizon) && !(error <= RESPONSE_DIVERGENCE * companion->largest))
        companion->horizon = (double)before / state->plan->sample_rate;
    companion->is_finished = error > (companion->is_stepped ? 1 : PARTED) * companion->largest;
}

// Follows the run to its present sample; the steps count as the run's. False: it has failed just
// now, perhaps by the run's own limit.
static bool exact_companion_step(Companion *companion, const ModalState *state) {
    if (companion->is_finished)
        return true;
    companion->run.steps = state->run->steps;
    ModalState *own = &companion->engine.state;
    const size_t from = own->sample;
    exact_companion_nudge(own);
    while (own->sample < state->sample && companion->status == STATUS_OK)
        companion->status = event_engine_step(&companion->engine, state->sample);
    state->run->work.neighbour_samples += own->sample - from;
    state->run->steps = companion->run.steps;
    if (companion->status == STATUS_OK)
        exact_companion_compare(companion, state, from);
    else
        companion->is_finished = true;
    return companion->status == STATUS_OK;
}

// Starts beside an engine that has settled. A failure only leaves the run without an estimate,
// unless memory ran out: the same scene would have one at another time.
static void exact_companion_start(Companion *companion, EventEngine *engine) {
    const ModalState *state = &engine->state;
    memset(companion, 0, sizeof *companion);
    companion->horizon = NAN;
    companion->is_finished = true;
    if (!state->has_stops)
        return;
    companion->run = (Run){.plan = state->plan,
                           .base = state->run->base,
                           .progress = state->run->progress,
                           .steps_max = state->run->steps_max};
    companion->response.is_unlisted = true;
    ModalState *own = &companion->engine.state;
    companion->is_stepped =
        state->plan->form == CONTACT_POWER && engine->power.tolerance > POWER_CONTACT_TOLERANCE;
    const size_t tracked = companion->is_stepped ? COMPANION_SAMPLES * state->padded : 0;
    companion->tracks = calloc(2 * tracked + 1, sizeof *companion->tracks);
    companion->status =
        companion->tracks == NULL
            ? STATUS_NO_MEMORY
            : event_engine_shadow(&companion->engine, engine, &companion->run,
                                  fmax(engine->power.tolerance / FINER, POWER_CONTACT_TOLERANCE),
                                  &companion->response);
    if (companion->status != STATUS_OK)
        return;
    if (companion->is_stepped) {
        engine->track = companion->tracks;
        companion->engine.track = companion->tracks + tracked;
    }
    exact_companion_nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * NUDGE * own->damper[d].plan->clearance;
    companion->status = event_engine_settle(&companion->engine);
    companion->is_finished = companion->status != STATUS_OK;
}

// Error estimate and horizon.
static void exact_companion_report(const Companion *companion, const ModalState *state,
                                   Response *response) {
    const double size = fmax(companion->largest, response->peaks.displacement);
    // The rounding of a frequency shifts the phase; a pulse is too short for that.
    const Base *base = state->run->base;
    const double rate = fmax(state->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * state->plan->duration);
    const double worst = exact_companion_factor(companion) * companion->worst;
    const double error = size > 0 ? fmax(worst / size, drift) : 0;
    response->has_trust = companion->status == STATUS_OK;
    response->is_stepped = companion->is_stepped;
    response->error_estimate = error < (companion->is_stepped ? 1 : PARTED) ? error : 1;
    // A small error means that the horizon was found while the displacement was still small.
    response->trust_horizon = error <= RESPONSE_DIVERGENCE ? (double)NAN : companion->horizon;
}

static void exact_companion_clear(Companion *companion) {
    power_contact_clear(&companion->engine.power);
    modal_state_clear(&companion->engine.state);
    response_clear(&companion->response);
    free(companion->tracks);
}

static Status exact_solve(EventEngine *engine, Companion *companion) {
    ModalState *state = &engine->state;
    const Plan *plan = state->plan;
    TRY(event_engine_settle(engine));
    recorder_sample(&engine->record, state);
    exact_companion_start(companion, engine);
    while (state->sample + 1 < plan->count && companion->status != STATUS_NO_MEMORY) {
        const size_t next = (state->sample / COMPANION_SAMPLES + 1) * COMPANION_SAMPLES;
        const size_t until = next < plan->count - 1 ? next : plan->count - 1;
        while (state->sample < until)
            TRY(event_engine_step(engine, until));
        if (!exact_companion_step(companion, state))
            TRY(event_engine_check(engine)); // the cause may be the run's own limit
    }
    if (companion->status == STATUS_NO_MEMORY)
        return problem_set(state->problem, STATUS_NO_MEMORY, "no memory for a run");
    exact_companion_report(companion, state, state->impacts.response);
    // The duration may end between samples.
    TRY(event_engine_cross(engine, plan->duration - (double)state->sample / plan->sample_rate));
    recorder_update(state);
    TRY(event_engine_check(engine));
    return recorder_finish_log(state);
}

Status exact_run_engine(Run *run, Response *response, Problem *problem) {
    EventEngine engine;
    Companion *companion = calloc(1, sizeof *companion);
    if (companion == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run");
    memset(&engine, 0, sizeof engine);
    Status status =
        event_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = exact_solve(&engine, companion);
    if (engine.record.block != NULL)
        recorder_finish(&engine.record, &engine.state, response);
    event_engine_clear(&engine);
    exact_companion_clear(companion);
    free(companion);
    return status;
}

static Status exact_advance(EventEngine *engine, double time) {
    const ModalState *state = &engine->state;
    const double rate = state->plan->sample_rate;
    const size_t sample = (size_t)floor(time * rate);
    if (state->offset > 0 && state->sample < sample)
        TRY(event_engine_finish_interval(engine));
    while (state->sample < sample)
        TRY(event_engine_step(engine, sample));
    return event_engine_cross(engine, time - (double)sample / rate);
}

static ContactPoint exact_point(ModalState *state, size_t index, Side side, double time) {
    const DamperState *damper = &state->damper[index];
    const double sign = modal_state_sign(side);
    const bool is_inside = damper->phase == PHASE_CONTACT || damper->phase == PHASE_INSIDE;
    Slice slice;
    (void)base_cursor_slice(&state->base, state->sample, state->offset, &slice);
    state->base_acceleration = slice.value;
    modal_state_forces(state);
    return (ContactPoint){time, sign * damper->force, is_inside ? fmax(sign * damper->r, 0) : 0,
                          sign * damper->w};
}

static Status exact_sample(EventEngine *engine, const OutputWindow *window) {
    engine->state.sample = window->first;
    if (window->first == 0)
        TRY(event_engine_settle(engine));
    for (size_t k = 0; k < window->count; k++) {
        const double time = window->start + (double)(k + 1) * window->interval;
        TRY(exact_advance(engine, time));
        window->points[k] = exact_point(&engine->state, window->damper, window->side, time);
    }
    TRY(exact_advance(engine, window->end));
    TRY(event_engine_check(engine));
    return recorder_finish_log(&engine->state);
}

Status exact_run_window(Run *run, const OutputWindow *window, Response *response,
                        Problem *problem) {
    EventEngine engine;
    memset(&engine, 0, sizeof engine);
    Status status =
        event_engine_make(&engine, run, exact_tolerance(run->accuracy), response, problem);
    if (status == STATUS_OK)
        status = exact_sample(&engine, window);
    event_engine_clear(&engine);
    return status;
}

static Status exact_run(const Solver *solver, Run *run, Response *response, Problem *problem) {
    (void)solver;
    if (!single_mass_serves(run->plan, run->base, run->is_clear))
        return exact_run_engine(run, response, problem);
    // With values at all output samples single_mass.h moves over many of them at once.
    const size_t fine =
        base_cursor_refined_count(run->base, run->plan->sample_rate, run->plan->count);
    double *const values = fine == 0 ? NULL : malloc(fine * sizeof *values);
    if (values == NULL)
        return single_mass_run(run, response, problem);
    Base refined;
    Run own = *run;
    own.base = &refined;
    Status status = base_cursor_refine(run->base, run->plan->sample_rate, fine, values,
                                       run->progress, &refined, problem);
    if (status == STATUS_OK)
        status = single_mass_run(&own, response, problem);
    run->steps = own.steps;
    run->work = own.work;
    free(values);
    return status;
}

const Solver solver_exact = {
    .kind = {"exact", "each contact state propagated exactly, events located to rounding",
             accuracy_exact_fields, sizeof(AccuracyExact)},
    .run = exact_run,
    .decide = exact_decide,
    .forget_unused = exact_forget_unused,
};
