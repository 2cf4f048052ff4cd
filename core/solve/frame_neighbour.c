#include "core/solve/frame_neighbour.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NUDGE = 4 * DBL_EPSILON, POWER_NUDGE = 1e-12; // an integrated contact's error
static const double PARTED = 0.01; // of the largest displacement: what comes then is chance

static double nudge_of(const Frame *frame) {
    return frame->plan->form == CONTACT_POWER ? POWER_NUDGE : NUDGE;
}

// Some roundings more, of either sign.
static void nudge(Frame *frame) {
    const double by = nudge_of(frame);
    for (size_t i = 0; i < frame->storeys; i++) {
        const double sign = (frame->sample / NEIGHBOUR_SAMPLES + i) % 2 == 0 ? 1 : -1;
        frame->q[i] *= 1 + sign * by;
        frame->p[i] *= 1 - sign * by;
    }
}

static void compare(FrameNeighbour *neighbour, const Frame *frame, size_t before) {
    const size_t n = frame->storeys;
    double *apart = neighbour->apart, bound = 0, difference = 0;
    for (size_t i = 0; i < n; i++) {
        apart[i] = frame->q[i] - neighbour->engine.frame.q[i];
        bound += frame->widest[i] * fabs(apart[i]);
    }
    neighbour->largest = fmax(neighbour->largest, frame->ledger.response->peaks.displacement);
    if (bound <= neighbour->worst)
        return;
    const double *values = frame_spread(frame, apart);
    for (size_t j = 0; j < n; j++)
        difference = fmax(difference, fabs(values[j]));
    neighbour->worst = fmax(neighbour->worst, difference);
    if (isnan(neighbour->horizon) && !(difference <= RESPONSE_PARTING * neighbour->largest))
        neighbour->horizon = (double)before / frame->plan->sample_rate;
    neighbour->is_spent = difference > PARTED * neighbour->largest;
}

bool frame_neighbour_step(FrameNeighbour *neighbour, const Frame *frame) {
    if (neighbour->is_spent)
        return true;
    neighbour->run.steps = frame->run->steps;
    Frame *own = &neighbour->engine.frame;
    const size_t from = own->sample;
    nudge(own);
    while (own->sample < frame->sample && neighbour->is_known)
        neighbour->is_known = frame_engine_step(&neighbour->engine, frame->sample) == STATUS_OK;
    frame->run->steps = neighbour->run.steps;
    if (neighbour->is_known)
        compare(neighbour, frame, from);
    else
        neighbour->is_spent = true;
    return neighbour->is_known;
}

void frame_neighbour_start(FrameNeighbour *neighbour, const FrameEngine *engine) {
    const Frame *frame = &engine->frame;
    memset(neighbour, 0, sizeof *neighbour);
    neighbour->horizon = NAN;
    neighbour->is_known = neighbour->is_spent = true;
    if (frame->dampers == 0)
        return;
    neighbour->run = (Run){.plan = frame->plan,
                           .base = frame->run->base,
                           .watch = frame->run->watch,
                           .impacts_most = frame->run->impacts_most,
                           .steps_most = frame->run->steps_most};
    Frame *own = &neighbour->engine.frame;
    neighbour->apart = calloc(frame->padded, sizeof *neighbour->apart);
    neighbour->is_known =
        neighbour->apart != NULL && frame_engine_shadow(&neighbour->engine, engine, &neighbour->run,
                                                        &neighbour->response) == STATUS_OK;
    if (!neighbour->is_known)
        return;
    nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * nudge_of(own) * own->damper[d].plan->clearance;
    neighbour->is_known = frame_engine_settle(&neighbour->engine) == STATUS_OK;
    neighbour->is_spent = !neighbour->is_known;
}

void frame_neighbour_tell(const FrameNeighbour *neighbour, const Frame *frame, Response *response) {
    const double size = fmax(neighbour->largest, response->peaks.displacement);
    // A frequency's own rounding turns the phase; a pulse is over before it matters.
    const Base *base = frame->run->base;
    const double rate = fmax(frame->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * frame->plan->duration);
    const double error = size > 0 ? fmax(neighbour->worst / size, drift) : 0;
    response->has_trust = neighbour->is_known;
    response->error_estimate = error < PARTED ? error : 1;
    // One that is told all the same was found before the displacement had grown.
    response->trust_horizon = error <= RESPONSE_PARTING ? (double)NAN : neighbour->horizon;
}

void frame_neighbour_clear(FrameNeighbour *neighbour) {
    frame_ode_clear(&neighbour->engine.ode);
    frame_clear(&neighbour->engine.frame);
    response_clear(&neighbour->response);
    free(neighbour->apart);
}
