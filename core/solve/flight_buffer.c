#include "core/solve/flight_buffer.h"

#include <stdlib.h>
#include <string.h>

Status flight_buffer_make(FlightBuffer *trail, const ModalState *state, Problem *problem) {
    const size_t m = state->dampers, padded = state->padded;
    trail->padded = padded;
    trail->block =
        calloc(simd_kernels_room((5 * padded + 2 * m + 3) * TRAIL_ROWS), sizeof *trail->block);
    if (trail->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu modes",
                           state->mode_count);
    double *at = simd_kernels_start(trail->block);
    double **const stretches[] = {&trail->q, &trail->p, &trail->moved, &trail->sped,
                                  &trail->elastic};
    for (size_t i = 0; i < COUNT(stretches); i++, at += TRAIL_ROWS * padded)
        *stretches[i] = at;
    trail->r = at;
    trail->z = trail->r + m * TRAIL_ROWS;
    trail->a = trail->z + m * TRAIL_ROWS;
    trail->b = trail->a + TRAIL_ROWS;
    trail->ground = trail->b + TRAIL_ROWS;
    return STATUS_OK;
}

void flight_buffer_clear(FlightBuffer *trail) {
    free(trail->block);
}

void flight_buffer_feel(FlightBuffer *trail, const ModalState *state, size_t count) {
    const size_t padded = trail->padded;
    const double *q = trail->q + padded, *p = trail->p + padded;
    if (state->diagonal != NULL)
        state->lanes->mix(padded, count, state->diagonal, p, state->omega2, q,
                          trail->elastic + padded);
    for (size_t at = padded; at <= count * padded && state->diagonal == NULL; at += padded)
        modal_state_elastic(state, trail->q + at, trail->p + at, trail->elastic + at);
    for (size_t k = 1; k <= count && state->residual_influence != NULL; k++)
        trail->elastic[k * padded + state->mode_count] =
            base_cursor_at(&state->base, state->sample - count + k);
}

void flight_buffer_take(FlightBuffer *trail, const ModalState *state, double ground) {
    const size_t at = trail->padded;
    memcpy(trail->q + at, state->q, at * sizeof *state->q);
    memcpy(trail->p + at, state->p, at * sizeof *state->p);
    memcpy(trail->elastic + at, state->elastic, at * sizeof *state->elastic);
    trail->ground[0] = ground;
    for (size_t d = 0; d < state->dampers; d++) {
        const DamperState *damper = &state->damper[d];
        trail->r[d * TRAIL_ROWS + 1] = damper->r;
        trail->z[d * TRAIL_ROWS + 1] =
            modal_state_dot(damper->shape, state->p, state->mode_count) + damper->w;
    }
}
