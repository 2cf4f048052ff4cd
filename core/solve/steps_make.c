// A run by steps made ready, and given back.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/plan/plan.h"
#include "core/solve/time_stepping.h"

// Explicit steps that are too long for what is known beforehand to move.
static Status check_reach(const Steps *steps) {
    const ModalState *state = &steps->state;
    const double most = steps->stepper->stability_limit / steps->length;
    if (!(steps->stepper->stability_limit > 0))
        return STATUS_OK;
    if (state->rate > most)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "%s is unstable with a step of %.4g s: the structure's motion has a "
                           "rate of up to %.4g 1/s, so a step must be at most %.3g s",
                           steps->stepper->name, steps->length, state->rate,
                           steps->stepper->stability_limit / state->rate);
    double rate = 0;
    for (size_t d = 0;
         d < state->dampers && state->has_stops && state->plan->form == CONTACT_LINEAR; d++)
        for (int side = 0; side < 2; side++) {
            const double mass = state->damper[d].effective_mass;
            const PlanStop *stop = &state->damper[d].plan->stops[side];
            const ContactRows *rows = &stop->contact.numbers.rows;
            for (size_t i = 0; i < (rows->count > 0 ? rows->count : 1); i++) {
                const ContactParameters at =
                    stops_freeze(stop, rows->count > 0 ? rows->at[i].approach_speed : 1);
                rate = fmax(rate, fmax(sqrt(state->stiff + at.stiffness / mass),
                                       state->viscous + at.damping / mass));
            }
        }
    if (rate > most)
        return problem_set(state->problem, STATUS_UNSTABLE,
                           "%s is unstable with a step of %.4g s: a contact has a rate of up to "
                           "%.4g 1/s, so a step must be at most %.3g s",
                           steps->stepper->name, steps->length, rate,
                           steps->stepper->stability_limit / rate);
    return STATUS_OK;
}

static Status make_room(Steps *steps) {
    const size_t n = steps->state.mode_count, m = steps->state.dampers;
    steps->size = 2 * (n + m);
    // y; impulse and work; before; force and rates behind it; elastic
    steps->block = calloc(2 * steps->size + 4 * m + n + 1, sizeof *steps->block);
    if (steps->block == NULL)
        return problem_set(steps->state.problem, STATUS_NO_MEMORY,
                           "no memory for a run of %zu modes", n);
    steps->y = steps->block;
    steps->sums.impulse = steps->y + steps->size;
    steps->sums.work = steps->sums.impulse + m;
    steps->before = steps->sums.work + m;
    steps->force = steps->before + m;
    steps->elastic = steps->force + m + steps->size;
    return STATUS_OK;
}

Status steps_make(Steps *steps, const Stepper *stepper, Run *run, size_t share, double tolerance,
                  bool is_shadow, Response *response, Problem *problem) {
    ModalState *state = &steps->state;
    memset(steps, 0, sizeof *steps);
    steps->stepper = stepper;
    steps->tolerance = tolerance;
    TRY(modal_state_make(state, run, problem));
    state->is_shadow = is_shadow;
    steps->share = share;
    steps->length = state->interval / (double)share;
    TRY(make_room(steps));
    TRY(check_reach(steps));
    if (!is_shadow) {
        TRY(flight_buffer_make(&steps->trail, state, problem));
        TRY(recorder_start(&steps->record, &steps->trail, state, response, problem));
    }
    const EnergyState energy = modal_state_energy(state);
    impact_log_start(&state->impacts, response, run->impacts_max, &energy);
    double making = 0;
    (void)stepper->cost(state->mode_count, state->dampers, state->diagonal == NULL, &making);
    run->steps += making;
    return stepper->make != NULL ? stepper->make(steps) : STATUS_OK;
}

void steps_clear(Steps *steps) {
    if (steps->stepper != NULL && steps->stepper->clear != NULL)
        steps->stepper->clear(steps);
    recorder_clear(&steps->record);
    flight_buffer_clear(&steps->trail);
    modal_state_clear(&steps->state);
    free(steps->block);
}
