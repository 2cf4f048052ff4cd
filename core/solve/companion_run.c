#include "core/solve/companion_run.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NUDGE = 4 * DBL_EPSILON;
static const double PARTED = 0.01; // of the largest displacement: what comes then is chance
static const double FINER = 30;    // than the run's tolerance
static const double CAUTION = 3;   // with what comes between two comparisons

// Whether the run's contacts may be wrong by more than rounding.
static bool is_loose(const EventEngine *engine) {
    return engine->ode.tolerance > POWER_CONTACT_TOLERANCE;
}

// Some roundings more, of either sign.
static void nudge(ModalState *state) {
    const double by = NUDGE;
    for (size_t i = 0; i < state->mode_count; i++) {
        const double sign = (state->sample / COMPANION_SAMPLES + i) % 2 == 0 ? 1 : -1;
        state->q[i] *= 1 + sign * by;
        state->p[i] *= 1 - sign * by;
    }
}

// Of a difference, what the run's error is taken for.
static double part_of(const CompanionRun *neighbour) {
    return neighbour->is_stepped ? CAUTION : 1;
}

static void compare(CompanionRun *neighbour, const ModalState *state, size_t before) {
    neighbour->largest = fmax(neighbour->largest, state->impacts.response->peaks.displacement);
    if (neighbour->is_stepped) {
        // Such an error is no growing noise: it swings as the motion does.
        const double *run = neighbour->tracks, *near = run + COMPANION_SAMPLES * state->padded;
        for (size_t k = 0; k < state->sample - before; k++)
            neighbour->worst = modal_state_difference(state, run + k * state->padded,
                                                      near + k * state->padded, neighbour->worst);
    } else {
        neighbour->worst =
            modal_state_difference(state, state->q, neighbour->engine.state.q, neighbour->worst);
    }
    const double error = part_of(neighbour) * neighbour->worst;
    if (isnan(neighbour->horizon) && !(error <= RESPONSE_DIVERGENCE * neighbour->largest))
        neighbour->horizon = (double)before / state->plan->sample_rate;
    neighbour->is_finished = error > (neighbour->is_stepped ? 1 : PARTED) * neighbour->largest;
}

bool companion_run_step(CompanionRun *neighbour, const ModalState *state) {
    if (neighbour->is_finished)
        return true;
    neighbour->run.steps = state->run->steps;
    ModalState *own = &neighbour->engine.state;
    const size_t from = own->sample;
    nudge(own);
    while (own->sample < state->sample && neighbour->is_known)
        neighbour->is_known = event_engine_step(&neighbour->engine, state->sample) == STATUS_OK;
    state->run->work.neighbour_samples += own->sample - from;
    state->run->steps = neighbour->run.steps;
    if (neighbour->is_known)
        compare(neighbour, state, from);
    else
        neighbour->is_finished = true;
    return neighbour->is_known;
}

void companion_run_start(CompanionRun *neighbour, EventEngine *engine) {
    const ModalState *state = &engine->state;
    memset(neighbour, 0, sizeof *neighbour);
    neighbour->horizon = NAN;
    neighbour->is_known = neighbour->is_finished = true;
    if (!state->has_stops)
        return;
    neighbour->run = (Run){.plan = state->plan,
                           .base = state->run->base,
                           .progress = state->run->progress,
                           .steps_max = state->run->steps_max};
    neighbour->response.is_unlisted = true;
    ModalState *own = &neighbour->engine.state;
    neighbour->is_stepped = state->plan->form == CONTACT_POWER && is_loose(engine);
    const size_t tracked = neighbour->is_stepped ? COMPANION_SAMPLES * state->padded : 0;
    neighbour->tracks = calloc(2 * tracked + 1, sizeof *neighbour->tracks);
    neighbour->is_known =
        neighbour->tracks != NULL &&
        event_engine_shadow(&neighbour->engine, engine, &neighbour->run,
                            fmax(engine->ode.tolerance / FINER, POWER_CONTACT_TOLERANCE),
                            &neighbour->response) == STATUS_OK;
    if (!neighbour->is_known)
        return;
    if (neighbour->is_stepped) {
        engine->track = neighbour->tracks;
        neighbour->engine.track = neighbour->tracks + tracked;
    }
    nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * NUDGE * own->damper[d].plan->clearance;
    neighbour->is_known = event_engine_settle(&neighbour->engine) == STATUS_OK;
    neighbour->is_finished = !neighbour->is_known;
}

void companion_run_tell(const CompanionRun *neighbour, const ModalState *state,
                        Response *response) {
    const double size = fmax(neighbour->largest, response->peaks.displacement);
    // A frequency's own rounding turns the phase; a pulse is over before it matters.
    const Base *base = state->run->base;
    const double rate = fmax(state->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * state->plan->duration);
    const double worst = part_of(neighbour) * neighbour->worst;
    const double error = size > 0 ? fmax(worst / size, drift) : 0;
    response->has_trust = neighbour->is_known;
    response->is_stepped = neighbour->is_stepped;
    response->error_estimate = error < (neighbour->is_stepped ? 1 : PARTED) ? error : 1;
    // One that is told all the same was found before the displacement had grown.
    response->trust_horizon = error <= RESPONSE_DIVERGENCE ? (double)NAN : neighbour->horizon;
}

void companion_run_clear(CompanionRun *neighbour) {
    power_contact_clear(&neighbour->engine.ode);
    modal_state_clear(&neighbour->engine.state);
    response_clear(&neighbour->response);
    free(neighbour->tracks);
}
