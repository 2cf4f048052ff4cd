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
static bool is_loose(const FrameEngine *engine) {
    return engine->ode.tolerance > FRAME_ODE_TOLERANCE;
}

// Some roundings more, of either sign.
static void nudge(Frame *frame) {
    const double by = NUDGE;
    for (size_t i = 0; i < frame->mode_count; i++) {
        const double sign = (frame->sample / NEIGHBOUR_SAMPLES + i) % 2 == 0 ? 1 : -1;
        frame->q[i] *= 1 + sign * by;
        frame->p[i] *= 1 - sign * by;
    }
}

// Of a difference, what the run's error is taken for.
static double part_of(const FrameNeighbour *neighbour) {
    return neighbour->is_stepped ? CAUTION : 1;
}

// Of the modes' displacements at one sample.
static void look(FrameNeighbour *neighbour, const Frame *frame, const double *run,
                 const double *near) {
    const size_t n = frame->mode_count;
    double *apart = neighbour->apart, bound = 0, difference = 0;
    for (size_t i = 0; i < n; i++) {
        apart[i] = run[i] - near[i];
        bound += frame->widest[i] * fabs(apart[i]);
    }
    if (bound <= neighbour->worst)
        return;
    const double *values = frame_spread(frame, apart);
    for (size_t j = 0; j < frame->storey_count; j++)
        difference = fmax(difference, fabs(values[j]));
    neighbour->worst = fmax(neighbour->worst, difference);
}

static void compare(FrameNeighbour *neighbour, const Frame *frame, size_t before) {
    neighbour->largest = fmax(neighbour->largest, frame->ledger.response->peaks.displacement);
    if (neighbour->is_stepped) {
        // Such an error is no growing noise: it swings as the motion does.
        const double *run = neighbour->tracks, *near = run + NEIGHBOUR_SAMPLES * frame->padded;
        for (size_t k = 0; k < frame->sample - before; k++)
            look(neighbour, frame, run + k * frame->padded, near + k * frame->padded);
    } else {
        look(neighbour, frame, frame->q, neighbour->engine.frame.q);
    }
    const double error = part_of(neighbour) * neighbour->worst;
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
    frame->run->work.neighbour_samples += own->sample - from;
    frame->run->steps = neighbour->run.steps;
    if (neighbour->is_known)
        compare(neighbour, frame, from);
    else
        neighbour->is_spent = true;
    return neighbour->is_known;
}

void frame_neighbour_start(FrameNeighbour *neighbour, FrameEngine *engine) {
    const Frame *frame = &engine->frame;
    memset(neighbour, 0, sizeof *neighbour);
    neighbour->horizon = NAN;
    neighbour->is_known = neighbour->is_spent = true;
    if (!frame->has_stops)
        return;
    neighbour->run = (Run){.plan = frame->plan,
                           .base = frame->run->base,
                           .progress = frame->run->progress,
                           .steps_max = frame->run->steps_max};
    neighbour->response.is_unlisted = true;
    Frame *own = &neighbour->engine.frame;
    neighbour->is_stepped = frame->plan->form == CONTACT_POWER && is_loose(engine);
    const size_t tracked = neighbour->is_stepped ? NEIGHBOUR_SAMPLES * frame->padded : 0;
    neighbour->tracks = calloc(2 * tracked + 1, sizeof *neighbour->tracks);
    neighbour->apart = calloc(frame->padded, sizeof *neighbour->apart);
    neighbour->is_known =
        neighbour->apart != NULL && neighbour->tracks != NULL &&
        frame_engine_shadow(&neighbour->engine, engine, &neighbour->run,
                            fmax(engine->ode.tolerance / FINER, FRAME_ODE_TOLERANCE),
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
    free(neighbour->tracks);
}
