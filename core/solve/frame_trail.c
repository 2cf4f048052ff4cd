#include "core/solve/frame_trail.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { VECTOR = FRAME_LANES * sizeof(double) };

Status frame_trail_make(FrameTrail *trail, const Frame *frame, Problem *problem) {
    const size_t n = frame->storeys, m = frame->dampers, padded = frame_lanes_padded(n);
    const size_t rows = 5 * TRAIL_ROWS + 3 + m, others = (2 * m + 3) * TRAIL_ROWS;
    trail->lanes = &frame_lanes_kinds[frame_lanes_widest()];
    trail->padded = padded;
    trail->block = calloc(rows * padded + others + FRAME_LANES, sizeof *trail->block);
    if (trail->block == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a run of %zu storeys", n);
    // Whole vectors lie in whole lines of the processor's memory.
    double *at = trail->block + (VECTOR - (uintptr_t)trail->block % VECTOR) % VECTOR / sizeof *at;
    double **const stretches[] = {&trail->q, &trail->p, &trail->moved, &trail->sped,
                                  &trail->elastic};
    for (size_t i = 0; i < sizeof stretches / sizeof *stretches; i++, at += TRAIL_ROWS * padded)
        *stretches[i] = at;
    trail->omega2 = at;
    trail->damping = at + padded;
    trail->widest = at + 2 * padded;
    trail->shapes = at + 3 * padded;
    trail->r = at + (3 + m) * padded;
    trail->z = trail->r + m * TRAIL_ROWS;
    trail->a = trail->z + m * TRAIL_ROWS;
    trail->b = trail->a + TRAIL_ROWS;
    trail->ground = trail->b + TRAIL_ROWS;
    memcpy(trail->omega2, frame->omega2, n * sizeof *at);
    memcpy(trail->widest, frame->widest, n * sizeof *at);
    for (size_t d = 0; d < m; d++)
        memcpy(trail->shapes + d * padded, frame->damper[d].shape, n * sizeof *at);
    if (frame->diagonal != NULL)
        memcpy(trail->damping, frame->diagonal, n * sizeof *at);
    else
        trail->damping = NULL;
    return STATUS_OK;
}

void frame_trail_clear(FrameTrail *trail) {
    free(trail->block);
}

void frame_trail_feel(FrameTrail *trail, const Frame *frame, size_t count) {
    const size_t padded = trail->padded;
    if (trail->damping != NULL)
        trail->lanes->mix(padded, count, trail->damping, trail->p + padded, trail->omega2,
                          trail->q + padded, trail->elastic + padded);
    for (size_t at = padded; at <= count * padded && trail->damping == NULL; at += padded)
        frame_elastic(frame, trail->q + at, trail->p + at, trail->elastic + at);
}

void frame_trail_take(FrameTrail *trail, const Frame *frame, double ground) {
    const size_t n = frame->storeys, at = trail->padded;
    memcpy(trail->q + at, frame->q, n * sizeof *frame->q);
    memcpy(trail->p + at, frame->p, n * sizeof *frame->p);
    memcpy(trail->elastic + at, frame->elastic, n * sizeof *frame->elastic);
    trail->ground[0] = ground;
    for (size_t d = 0; d < frame->dampers; d++) {
        const FrameDamper *damper = &frame->damper[d];
        trail->r[d * TRAIL_ROWS + 1] = damper->r;
        trail->z[d * TRAIL_ROWS + 1] =
            frame_dot(damper->shape, frame->p, frame->storeys) + damper->w;
    }
}
