#include "core/solve/companion_run.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NUDGE = 4 * DBL_EPSILON;
static const double PARTED = 0.01; // of the largest displacement: larger differences are chance
static const double FINER = 30;    // tolerance of the run over that of the companion
static const double CAUTION = 3;   // error of the run over the difference of two stepped runs

// Whether the errors of contacts may exceed rounding.
static bool companion_run_is_loose(const EventEngine *engine) {
    return engine->ode.tolerance > POWER_CONTACT_TOLERANCE;
}

// Changes the modes by a few roundings of either sign.
static void companion_run_nudge(ModalState *state) {
    const double by = NUDGE;
    for (size_t i = 0; i < state->mode_count; i++) {
        const double sign = (state->sample / COMPANION_SAMPLES + i) % 2 == 0 ? 1 : -1;
        state->q[i] *= 1 + sign * by;
        state->p[i] *= 1 - sign * by;
    }
}

// Error of the run over the difference of the two runs.
static double companion_run_factor(const CompanionRun *companion) {
    return companion->is_stepped ? CAUTION : 1;
}

static void companion_run_compare(CompanionRun *companion, const ModalState *state, size_t before) {
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
    const double error = companion_run_factor(companion) * companion->worst;
    if (isnan(companion->horizon) && !(error <= RESPONSE_DIVERGENCE * companion->largest))
        companion->horizon = (double)before / state->plan->sample_rate;
    companion->is_finished = error > (companion->is_stepped ? 1 : PARTED) * companion->largest;
}

bool companion_run_step(CompanionRun *companion, const ModalState *state) {
    if (companion->is_finished)
        return true;
    companion->run.steps = state->run->steps;
    ModalState *own = &companion->engine.state;
    const size_t from = own->sample;
    companion_run_nudge(own);
    while (own->sample < state->sample && companion->is_known)
        companion->is_known = event_engine_step(&companion->engine, state->sample) == STATUS_OK;
    state->run->work.neighbour_samples += own->sample - from;
    state->run->steps = companion->run.steps;
    if (companion->is_known)
        companion_run_compare(companion, state, from);
    else
        companion->is_finished = true;
    return companion->is_known;
}

void companion_run_start(CompanionRun *companion, EventEngine *engine) {
    const ModalState *state = &engine->state;
    memset(companion, 0, sizeof *companion);
    companion->horizon = NAN;
    companion->is_known = companion->is_finished = true;
    if (!state->has_stops)
        return;
    companion->run = (Run){.plan = state->plan,
                           .base = state->run->base,
                           .progress = state->run->progress,
                           .steps_max = state->run->steps_max};
    companion->response.is_unlisted = true;
    ModalState *own = &companion->engine.state;
    companion->is_stepped = state->plan->form == CONTACT_POWER && companion_run_is_loose(engine);
    const size_t tracked = companion->is_stepped ? COMPANION_SAMPLES * state->padded : 0;
    companion->tracks = calloc(2 * tracked + 1, sizeof *companion->tracks);
    companion->is_known =
        companion->tracks != NULL &&
        event_engine_shadow(&companion->engine, engine, &companion->run,
                            fmax(engine->ode.tolerance / FINER, POWER_CONTACT_TOLERANCE),
                            &companion->response) == STATUS_OK;
    if (!companion->is_known)
        return;
    if (companion->is_stepped) {
        engine->track = companion->tracks;
        companion->engine.track = companion->tracks + tracked;
    }
    companion_run_nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * NUDGE * own->damper[d].plan->clearance;
    companion->is_known = event_engine_settle(&companion->engine) == STATUS_OK;
    companion->is_finished = !companion->is_known;
}

void companion_run_report(const CompanionRun *companion, const ModalState *state,
                          Response *response) {
    const double size = fmax(companion->largest, response->peaks.displacement);
    // The rounding of a frequency shifts the phase; a pulse is too short for that.
    const Base *base = state->run->base;
    const double rate = fmax(state->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * state->plan->duration);
    const double worst = companion_run_factor(companion) * companion->worst;
    const double error = size > 0 ? fmax(worst / size, drift) : 0;
    response->has_trust = companion->is_known;
    response->is_stepped = companion->is_stepped;
    response->error_estimate = error < (companion->is_stepped ? 1 : PARTED) ? error : 1;
    // A horizon in spite of a small error was found before the displacement had grown.
    response->trust_horizon = error <= RESPONSE_DIVERGENCE ? (double)NAN : companion->horizon;
}

void companion_run_clear(CompanionRun *companion) {
    power_contact_clear(&companion->engine.ode);
    modal_state_clear(&companion->engine.state);
    response_clear(&companion->response);
    free(companion->tracks);
}
