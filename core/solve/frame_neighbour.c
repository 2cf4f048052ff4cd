#include "core/solve/frame_neighbour.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double NUDGE = 4 * DBL_EPSILON;
static const double PARTED = 0.01; // of the largest displacement: what comes then is chance
static const double FINER = 30;    // than the run's tolerance
static const double CAUTION = 2;   // with what comes between two comparisons

// Whether the run's contacts may be wrong by more than rounding.
static bool is_loose(const FrameEngine *engine) {
    return engine->ode.tolerance > FRAME_ODE_TOLERANCE;
}

// Some roundings more, of either sign.
static void nudge(Frame *frame) {
    const double by = NUDGE;
    for (size_t i = 0; i < frame->storeys; i++) {
        const double sign = (frame->sample / NEIGHBOUR_SAMPLES + i) % 2 == 0 ? 1 : -1;
        frame->q[i] *= 1 + sign * by;
        frame->p[i] *= 1 - sign * by;
    }
}

// Of a difference, what the run's error is taken for.
static double part_of(const FrameNeighbour *neighbour) {
    return neighbour->is_stepped ? CAUTION : 1;
}

// What a mode's difference comes to until it is looked at again: as far as it swings.
static double swing(const FrameNeighbour *neighbour, const Frame *frame, size_t i, double apart) {
    const double omega = sqrt(frame->omega2[i]), since = NEIGHBOUR_SAMPLES * frame->interval;
    const double speed = frame->p[i] - neighbour->engine.frame.p[i];
    return hypot(apart, speed * (omega * since > 1 ? 1 / omega : since));
}

static void compare(FrameNeighbour *neighbour, const Frame *frame, size_t before) {
    const size_t n = frame->storeys;
    double *apart = neighbour->apart, bound = 0, difference = 0;
    for (size_t i = 0; i < n; i++) {
        apart[i] = frame->q[i] - neighbour->engine.frame.q[i];
        if (neighbour->is_stepped)
            apart[i] = swing(neighbour, frame, i, apart[i]);
        bound += frame->widest[i] * fabs(apart[i]);
    }
    neighbour->largest = fmax(neighbour->largest, frame->ledger.response->peaks.displacement);
    if (bound <= neighbour->worst)
        return;
    const double *values = frame_spread(frame, apart);
    for (size_t j = 0; j < n; j++)
        difference = fmax(difference, fabs(values[j]));
    if (neighbour->is_stepped)
        difference = bound; // swings need not be in step
    neighbour->worst = fmax(neighbour->worst, difference);
    const double error = part_of(neighbour) * difference;
    if (isnan(neighbour->horizon) && !(error <= RESPONSE_PARTING * neighbour->largest))
        neighbour->horizon = (double)before / frame->plan->sample_rate;
    neighbour->is_spent = error > (neighbour->is_stepped ? 1 : PARTED) * neighbour->largest;
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
        neighbour->apart != NULL &&
        frame_engine_shadow(&neighbour->engine, engine, &neighbour->run,
                            fmax(engine->ode.tolerance / FINER, FRAME_ODE_TOLERANCE),
                            &neighbour->response) == STATUS_OK;
    neighbour->is_stepped = frame->plan->form == CONTACT_POWER && is_loose(engine);
    if (!neighbour->is_known)
        return;
    nudge(own);
    for (size_t d = 0; d < own->dampers; d++)
        own->damper[d].r +=
            (own->damper[d].r > 0 ? -1 : 1) * NUDGE * own->damper[d].plan->clearance;
    neighbour->is_known = frame_engine_settle(&neighbour->engine) == STATUS_OK;
    neighbour->is_spent = !neighbour->is_known;
}

void frame_neighbour_tell(const FrameNeighbour *neighbour, const Frame *frame, Response *response) {
    const double size = fmax(neighbour->largest, response->peaks.displacement);
    // A frequency's own rounding turns the phase; a pulse is over before it matters.
    const Base *base = frame->run->base;
    const double rate = fmax(frame->rate, base->form == BASE_SINE ? base->omega : 0);
    const double drift = DBL_EPSILON * (1 + rate * frame->plan->duration);
    const double worst = part_of(neighbour) * neighbour->worst;
    const double error = size > 0 ? fmax(worst / size, drift) : 0;
    response->has_trust = neighbour->is_known;
    response->is_stepped = neighbour->is_stepped;
    response->error_estimate = error < (neighbour->is_stepped ? 1 : PARTED) ? error : 1;
    // One that is told all the same was found before the displacement had grown.
    response->trust_horizon = error <= RESPONSE_PARTING ? (double)NAN : neighbour->horizon;
}

void frame_neighbour_clear(FrameNeighbour *neighbour) {
    frame_ode_clear(&neighbour->engine.ode);
    frame_clear(&neighbour->engine.frame);
    response_clear(&neighbour->response);
    free(neighbour->apart);
}
